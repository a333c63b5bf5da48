"""Energy: the present power load as a level from 0 to 1."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from robot_formulas.power import energy_level
from std_msgs.msg import Float32

from rosgraph_monitor.observer import StaleInputError, TopicObserver

if TYPE_CHECKING:
    from diagnostic_msgs.msg import DiagnosticStatus


class EnergyQualityObserver(TopicObserver):
    """Publishes `energy` at 1 Hz from the power load."""

    qa_name = "energy"
    max_age = 3.0

    def __init__(self, name: str = "EnergyQualityObserver") -> None:
        super().__init__(name, 1.0, [("power_load", Float32)])

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the level of the latest load."""
        load = msgs[0].data
        if not math.isfinite(load):
            raise StaleInputError(f"power_load {load} is not finite")
        return self.qa_status(energy_level(load))
