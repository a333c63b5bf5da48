"""Parameters that somebody has changed since a design was deployed: how long a report holds, when they are left alone.

Times are s of ROS time.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from mros1_reasoner.loop.readable_state import Drift, Running
from mros1_reasoner.loop.settings import Settings


def noted(running: Running, node: str, parameters: str, stamp: float, now: float) -> Running:
    """Return what runs after a report of drifted parameters of a node; an old report changes nothing.

    Args:
        running: what runs.
        node: whose parameters they are.
        parameters: their names.
        stamp: of the diagnostic; 0 where it has none.
        now: present time.
    """
    if now < running.drifts_from:
        return running
    before = running.drifts.get(node, Drift(parameters, stamp or now, now))
    return replace(running, drifts={**running.drifts, node: replace(before, parameters=parameters, seen=now)})


def judged(running: Running, settings: Settings, now: float) -> Running:
    """Return what runs without drifts that are reported no more; those that come back again and again are left."""

    def is_left(node: str) -> bool:
        return running.drifts[node].is_left or len(_lately(running, node, settings, now)) >= settings.restart_limit

    told = {node: drift for node, drift in running.drifts.items() if now < drift.seen + settings.level_timeout}
    drifts = {node: replace(drift, is_left=is_left(node)) for node, drift in told.items()}
    return running if drifts == running.drifts else replace(running, drifts=drifts)


def put_back(running: Running, nodes: Collection[str], settings: Settings, now: float) -> Running:
    """Return what runs after parameters of nodes were put back, or that was tried; reports may still be old ones."""
    again = {node: (*_lately(running, node, settings, now), now) for node in nodes}
    drifts = {node: drift for node, drift in running.drifts.items() if node not in nodes}
    return replace(
        running,
        drifts=drifts,
        drifts_from=now + settings.restart_grace,
        put_back={**running.put_back, **again},
    )


def _lately(running: Running, node: str, settings: Settings, now: float) -> tuple[float, ...]:
    """Return when the parameters of a node were put back within the time that counts."""
    return tuple(moment for moment in running.put_back.get(node, ()) if now - moment < settings.error_log_expiry)
