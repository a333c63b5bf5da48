"""Time of a change of D2's configuration by dynamic_reconfigure, and whether the robot goes on meanwhile."""

from __future__ import annotations

from typing import Any

from support.changes import PAPER, PAPER_S, changes, entries

_CHANGES = 30
_CONFIGURATIONS = ("f2_v1_r2", "f1_v2_r1")  # they differ in everything but the sensor


def run() -> list[dict[str, Any]]:
    """Return median and 95th percentile in s, wall, and the robot's least speed during any change, m/s."""
    found = changes(_CONFIGURATIONS, _CHANGES, pause=1.0)
    if {change.tactic for change in found} != {"parameters"}:
        raise RuntimeError(f"not all changes were made by parameters: {[change.tactic for change in found]}")
    return [
        *entries("reconfigure_parameters", [change.accepted for change in found], "s", PAPER, PAPER_S),
        *entries("reconfigure_parameters_speed", [min(change.slowest for change in found)], "m/s", tail=False),
    ]
