"""The text over the robot in RViz and in PyBullet's window: configurations, quality levels, failed components."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from metacontrol_msgs.msg import DiagnosticWords, FunctionGrounding


class StatusText:
    """Collects reports and writes them as a few short lines."""

    def __init__(self) -> None:
        """Start with nothing known."""
        self._configurations: list[str] = []
        self._levels: dict[str, float | None] = {}
        self._limits: Mapping[str, float] = {}
        self._failed: set[str] = set()
        self._is_changing = False

    @property
    def alarm(self) -> bool:
        """Whether a component has failed or a configuration is not stable."""
        return bool(self._failed) or self._is_changing

    def take_configuration(self, message: Any) -> None:
        """Take a metacontrol_msgs/ActiveConfiguration."""
        grounded = [function for function in message.functions if function.configuration]
        self._is_changing = any(function.state != FunctionGrounding.STABLE for function in grounded)
        self._configurations = [self._configuration(function, alone=len(grounded) == 1) for function in grounded]

    def take_limits(self, limits: Mapping[str, float]) -> None:
        """Take the required levels of quality attributes, by their names."""
        self._limits = limits

    def take_diagnostics(self, message: Any) -> None:
        """Take a diagnostic_msgs/DiagnosticArray."""
        for status in message.status:
            for number, pair in enumerate(status.values):
                if status.message == DiagnosticWords.QA_STATUS:
                    self._take_level(pair.key, pair.value)
                elif status.message == DiagnosticWords.QA_STALE:
                    self._levels[pair.key] = None
                elif status.message == DiagnosticWords.COMPONENT_STATUS and number == 0:
                    (self._failed.add if pair.value == DiagnosticWords.COMPONENT_FALSE else self._failed.discard)(
                        pair.key
                    )

    def lines(self) -> tuple[str, ...]:
        """Return the lines, from top to bottom."""
        levels = (self._level(name, level) for name, level in sorted(self._levels.items()))
        return (*self._configurations, *levels, *(f"{name} failed" for name in sorted(self._failed)))

    def _level(self, name: str, level: float | None) -> str:
        limit = f" (limit {self._limits[name]:g})" if name in self._limits else ""
        return f"{name} {'stale' if level is None else f'{level:.2f}'}{limit}"

    @staticmethod
    def _configuration(grounding: Any, *, alone: bool) -> str:
        """Return what a function runs; the function is named where there are several."""
        what = "" if alone else f"{grounding.function}: "
        state = "" if grounding.state == FunctionGrounding.STABLE else f" {grounding.state.lower()}"
        return f"{what}{grounding.configuration}{state}"

    def _take_level(self, name: str, value: str) -> None:
        try:
            level = float(value)
        except ValueError:
            return
        if math.isfinite(level):
            self._levels[name] = level
