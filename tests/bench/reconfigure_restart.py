"""Time of a change of D2's configuration by restart: from the request to the navigation goal at work again."""

from __future__ import annotations

from typing import Any

from support.changes import PAPER, PAPER_S, changes, entries

_CHANGES = 30
_CONFIGURATIONS = ("f2_v1_r3", "f2_v1_r3_k")  # laser and camera: no running node takes that as a parameter
_PAUSE_S = 3.0  # 2 s after a change the manipulator asks the new node what it takes by dynamic_reconfigure


def run() -> list[dict[str, Any]]:
    """Return median and 95th percentile, and the median of each part and phase, in s, wall, at real-time factor 1."""
    return measure("reconfigure_restart", standby=False)


def measure(name: str, standby: bool) -> list[dict[str, Any]]:
    """Measure with or without standby.

    `NAME_until_...` are the consecutive parts of the whole, by the master's log: until the old server has said goodbye,
    the new one begins to register (its imports are done), its action registers (it is constructed), and the goal is at
    work. All others are the manipulator's phases.
    """
    found = changes(_CONFIGURATIONS, _CHANGES, {"/rosgraph_launcher/standby": standby}, _PAUSE_S)
    if {change.tactic for change in found} != {"restart"}:
        raise RuntimeError(f"not all changes were made by restart: {[change.tactic for change in found]}")
    times = [change.accepted for change in found]
    results = [
        *entries(name, times, "s", PAPER, PAPER_S),
        *entries(f"{name}_result", [change.result for change in found], "s"),
    ]
    for part in found[0].parts:
        results += entries(f"{name}_until_{part}", [change.parts[part] for change in found], "s", tail=False)
    for phase in found[0].phases:
        results += entries(f"{name}_{phase}", [change.phases.get(phase, 0.0) for change in found], "s", tail=False)
    return results
