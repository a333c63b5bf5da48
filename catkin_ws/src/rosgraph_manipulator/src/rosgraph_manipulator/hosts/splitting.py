"""What each launcher is asked for in one change of a function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rosgraph_launcher.launching.report import LauncherReport


@dataclass(frozen=True)
class Part:
    """What one launcher is asked for.

    Attributes:
        launcher: its name.
        nodes: those nodes of the wanted configuration that are its own.
        stop: the nodes that it stops.
        start: the nodes that it starts.
        releases: whether it has nothing of the function any more after that.
        comes_first: whether other launchers have to wait for it: a node of it moves to another host.
    """

    launcher: str
    nodes: tuple[str, ...] = ()
    stop: tuple[str, ...] = ()
    start: tuple[str, ...] = ()
    releases: bool = False
    comes_first: bool = False


def split(
    places: Mapping[str, str], reports: Mapping[str, LauncherReport], stop: Sequence[str], start: Sequence[str]
) -> list[Part]:
    """Return what each launcher is asked for, in the order of their names.

    A launcher that has anything of the function is asked, too, so that all have the same configuration after it. One
    that starts nodes and loses some to other hosts is asked twice, so that these have ended before they start there.

    Args:
        places: for each node of the wanted configuration the launcher that is to run it.
        reports: what each launcher tells of the function.
        stop: the nodes to stop.
        start: the nodes to start.
    """
    has_something = {name for name, report in reports.items() if report.configuration or report.nodes}
    parts = []
    for launcher in sorted({*places.values(), *has_something}):
        running = reports[launcher].nodes if launcher in reports else ()
        own = tuple(node for node, place in places.items() if place == launcher)
        moving = tuple(node for node in start if node in running and node not in own)
        stops = tuple(dict.fromkeys((*(node for node in stop if node in running), *moving)))
        left = [node for node in running if node not in stops and node not in own]
        starts = tuple(node for node in start if node in own)
        if moving and starts:
            kept = tuple(node for node in own if node not in starts)
            parts.append(Part(launcher, kept, stops, releases=not kept and not left, comes_first=True))
            parts.append(Part(launcher, own, (), starts))
        else:
            parts.append(Part(launcher, own, stops, starts, not own and not left, bool(moving)))
    return parts
