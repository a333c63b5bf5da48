"""The text over the robot in RViz and in PyBullet's window: configuration, quality levels, failed components."""

from __future__ import annotations

import math
from typing import Any

from metacontrol_msgs.msg import DiagnosticWords, FunctionGrounding


class StatusText:
    """Collects reports and writes them as a few short lines."""

    def __init__(self) -> None:
        """Start with nothing known."""
        self._configurations: list[str] = []
        self._levels: dict[str, float | None] = {}
        self._failed: set[str] = set()

    @property
    def alarm(self) -> bool:
        """Whether a component has failed or a configuration is not stable."""
        return bool(self._failed) or any(" " in line for line in self._configurations)

    def take_configuration(self, message: Any) -> None:
        """Take a metacontrol_msgs/ActiveConfiguration."""
        self._configurations = [
            f.configuration if f.state == FunctionGrounding.STABLE else f"{f.configuration} {f.state.lower()}"
            for f in message.functions
        ]

    def take_diagnostics(self, message: Any) -> None:
        """Take a diagnostic_msgs/DiagnosticArray."""
        for status in message.status:
            for pair in status.values:
                if status.message == DiagnosticWords.QA_STATUS:
                    self._take_level(pair.key, pair.value)
                elif status.message == DiagnosticWords.QA_STALE:
                    self._levels[pair.key] = None
                elif status.message == DiagnosticWords.COMPONENT_STATUS:
                    (self._failed.add if pair.value == DiagnosticWords.COMPONENT_FALSE else self._failed.discard)(
                        pair.key
                    )

    def lines(self) -> tuple[str, ...]:
        """Return the lines, from top to bottom."""
        levels = (
            f"{name} {'stale' if level is None else f'{level:.2f}'}" for name, level in sorted(self._levels.items())
        )
        return (*self._configurations, *levels, *(f"{name} failed" for name in sorted(self._failed)))

    def _take_level(self, name: str, value: str) -> None:
        try:
            level = float(value)
        except ValueError:
            return
        if math.isfinite(level):
            self._levels[name] = level
