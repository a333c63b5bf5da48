"""Parameters of nodes that start are kept as they were set, until the nodes have come up."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

from node_kit.io.xml_rpc import CallError
from rosgraph_launcher.description import owner_of

from rosgraph_manipulator.change.surroundings import Surroundings
from rosgraph_manipulator.configuration.difference import same_value

_PERIOD = 0.1  # s, wall, between two looks
_SHARE = 0.1  # of the time, at most, that looks may take


def changed(wanted: Mapping[str, Any], around: Surroundings) -> dict[str, Any]:
    """Return what is wanted where the parameter server has another value, or none.

    Raises:
        CallError: the master does not answer.
    """
    live = around.parameters(wanted)
    return {name: value for name, value in wanted.items() if name not in live or not same_value(live[name], value)}


class HeldParameters:
    """The private parameters of nodes that start: what others change meanwhile is put back, until a node is up.

    A node reads them a moment after it is up, and may set its own from then on.
    """

    def __init__(
        self,
        function: str,
        wanted: Mapping[str, Any],
        nodes: Iterable[str],
        is_up: Callable[[str], bool],
        around: Surroundings,
    ) -> None:
        """Begin to look.

        Args:
            function: that the nodes are started for.
            wanted: the values that they are to read, by full name.
            nodes: all of them.
            is_up: tells whether a node is up.
            around: the clock and the master.
        """
        self._function, self._is_up, self._around = function, is_up, around
        names = tuple(nodes)
        self._wanted = {name: (owner_of(name, names), value) for name, value in wanted.items()}
        self._next = around.now()

    def look(self, nodes: Collection[str]) -> None:
        """Put back what somebody has changed of those of these nodes that are not up; call it again and again."""
        begin = self._around.now()
        if begin < self._next:
            return
        try:
            wanted = self._of(node for node in nodes if not self._is_up(node))
            # Meanwhile one may have come up.
            if wanted and (lost := changed(wanted, self._around)) and (lost := self._still_read(lost, nodes)):
                self._around.set_parameters(lost)
                names = ", ".join(sorted(lost))
                self._around.log.warn(f"{self._function}: put back, because nodes start: {names}")
        except CallError:
            pass  # the next look comes
        end = self._around.now()
        self._next = end + max(_PERIOD, (end - begin) / _SHARE)

    def _of(self, nodes: Iterable[str]) -> dict[str, Any]:
        meant = set(nodes)
        return {name: value for name, (owner, value) in self._wanted.items() if owner in meant}

    def _still_read(self, lost: Mapping[str, Any], nodes: Collection[str]) -> dict[str, Any]:
        left = self._of(node for node in nodes if not self._is_up(node))
        return {name: value for name, value in lost.items() if name in left}
