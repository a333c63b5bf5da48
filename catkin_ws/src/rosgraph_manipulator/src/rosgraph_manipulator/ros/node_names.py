"""Looks up whether the nodes of a configuration answer under their names, or somebody else does."""

from __future__ import annotations

from collections.abc import Collection

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.ownership import look_up
from rosgraph_launcher.io.scripts import script_is_at_work

from rosgraph_manipulator.change.progress import ChangeProgress
from rosgraph_manipulator.ros.launchers import Launchers
from rosgraph_manipulator.ros.running_system import RunningSystem


class NodeNames:
    """The names of the nodes of the configuration that is being deployed."""

    def __init__(self, system: RunningSystem, progress: ChangeProgress, launchers: Launchers) -> None:
        self._system, self._progress, self._launchers = system, progress, launchers
        self._takers: dict[str, str] = {}  # who had the name of a node that was to be started

    @property
    def contested(self) -> tuple[str, ...]:
        """The nodes whose names somebody else had when they were to be started."""
        return tuple(self._takers)

    def begin(self) -> None:
        """Begin a change: nobody is known to have had a name."""
        self._takers.clear()

    def see_takers(self, nodes: Collection[str]) -> None:
        """See who answers under the names of nodes that do not run: whoever does is somebody else."""
        for node in nodes:
            description = self._description(node)
            if description and not self._launchers.is_here(description):
                taker = self._launchers.check(description)[1]
            else:
                taker = look_up(node).successor(self._launchers.mark(description))
            if taker:
                self._takers[node] = taker

    def is_up(self, node: str) -> bool:
        """Tell whether a node is up, or has done its work."""
        description = self._description(node)
        if description and not self._launchers.is_here(description):
            return self._launchers.check(description)[0] or self._progress.has_finished(node)
        mark, answer = self._launchers.mark(description), look_up(node)
        return (
            (answer.is_own(mark, self._takers[node]) if node in self._takers else answer.is_up(mark))
            or self._progress.has_finished(node)
            or (description is not None and script_is_at_work(description, mark))
        )

    def conflict(self, node: str) -> str:
        """Return who has taken a node's name, for the end of a line; empty where nobody has."""
        description = self._description(node)
        if description and not self._launchers.is_here(description):
            conflict = self._launchers.check(description)[1]
        else:
            mark, answer = self._launchers.mark(description), look_up(node)
            conflict = answer.conflict(mark)
            if answer.answers and node in self._takers and not answer.is_own(mark, self._takers[node]):
                conflict = answer.successor(mark)
        return conflict and f" ({conflict})"

    def _description(self, node: str) -> NodeDescription | None:
        wanted = self._progress.wanted
        return self._system.launch_file(wanted).system.nodes.get(node) if wanted else None
