"""CPU load of the robot's computer."""

from __future__ import annotations

from typing import TYPE_CHECKING

import psutil
from robot_formulas.level import normalised

from rosgraph_monitor.observer import Observer, StaleInputError

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus


class CpuLoadQualityObserver(Observer):
    """Publishes `cpu_load` at 1 Hz: the share of all cores of this computer that was busy since the last time."""

    qa_name = "cpu_load"
    hysteresis = 0.02

    def __init__(self, name: str = "CpuLoadQualityObserver") -> None:
        super().__init__(name, 1.0)
        self._before: tuple[float, float] | None = None

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:  # noqa: ARG002 - interface
        """Return the load since the last evaluation; `now` is not used, since processes need wall time."""
        times = psutil.cpu_times()
        present = sum(times), times.idle + getattr(times, "iowait", 0.0)
        before, self._before = self._before, present
        if before is None or present[0] <= before[0]:
            raise StaleInputError("no time has passed to measure over")
        busy = 1.0 - (present[1] - before[1]) / (present[0] - before[0])
        return [self.qa_status(normalised(busy, 0.0, 1.0))]
