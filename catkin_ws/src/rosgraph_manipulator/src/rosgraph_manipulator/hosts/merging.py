"""What several launchers tell of one function, as the report of one launcher."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rosgraph_launcher.launching.report import CHANGING, FAILED, STABLE, STATES, LauncherReport


def merged(
    function: str,
    reports: Mapping[str, LauncherReport],
    parts: Collection[str] | None = None,
    lost: Mapping[str, str] | None = None,
) -> LauncherReport:
    """Return what the launchers tell together.

    Nodes and dead nodes are united, and the state is the worst one. Numbers of changes are added up: each grows with
    the changes of its launcher, so the sum tells whether all launchers have reported a change. The configuration is
    empty unless all that should have a part of it tell the same one.

    Args:
        function: name of the function.
        reports: what each launcher tells of the function.
        parts: the launchers that should have a part of the configuration; None: all that have a part of any.
        lost: for each launcher whose host is lost, a line that says so. Its nodes are dead.
    """
    if parts is None:
        parts = [name for name, report in reports.items() if report.configuration]
    lost = {name: line for name, line in (lost or {}).items() if name in parts}
    own = {name: reports.get(name, LauncherReport(function)) for name in sorted(parts)}
    told = [LauncherReport(function, state=FAILED, message=line) for line in lost.values()] + list(own.values())
    state = max((report.state for report in told), key=STATES.index, default=STABLE)
    names = {report.configuration for report in own.values()}
    dead = {node: None for name, report in own.items() for node in (report.nodes if name in lost else report.dead)}
    messages = [report.message for report in told if report.state == state and report.message]
    return LauncherReport(
        function,
        names.pop() if len(names) == 1 else "",
        sum(report.change for report in reports.values()),
        state,
        tuple(dict.fromkeys(node for report in own.values() for node in report.nodes)),
        tuple(dead),
        messages[0] if messages else next((report.message for report in told if report.message), ""),
    )


def stale(reports: Mapping[str, LauncherReport], parts: Collection[str]) -> list[str]:
    """Return the launchers that run something of a function and should not, such as one whose host was lost."""
    return [
        name
        for name, report in reports.items()
        if name not in parts and report.configuration and report.state != CHANGING
    ]
