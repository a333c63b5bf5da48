"""Looks up whether the nodes of a configuration answer under their names, or somebody else does."""

from __future__ import annotations

from collections.abc import Callable, Collection

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.ownership import look_up
from rosgraph_launcher.io.scripts import script_is_at_work

from rosgraph_manipulator.ros.launchers import Launchers


class NodeNames:
    """The names of the nodes of a configuration that is being deployed."""

    def __init__(
        self,
        launchers: Launchers,
        describe: Callable[[str], NodeDescription | None],
        has_finished: Callable[[str], bool],
    ) -> None:
        """Begin without a node.

        Args:
            launchers: those of all hosts.
            describe: returns how a node of the configuration is started; None: it has no such node.
            has_finished: tells whether a node has done its work and ended.
        """
        self._launchers, self._description, self._has_finished = launchers, describe, has_finished
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
            return self._launchers.check(description)[0] or self._has_finished(node)
        mark, answer = self._launchers.mark(description), look_up(node)
        return (
            (answer.is_own(mark, self._takers[node]) if node in self._takers else answer.is_up(mark))
            or self._has_finished(node)
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
