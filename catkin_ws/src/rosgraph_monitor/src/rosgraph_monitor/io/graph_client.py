"""Asks the master for the graph, also while it holds parameters that it can't tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from node_kit.io.xml_rpc import DeniedError, GarbageError
from node_kit.one_line import one_line
from ros_model.graph.snapshot import build_snapshot, node_names, topic_types
from ros_model.io.master import MasterClient

if TYPE_CHECKING:
    from ros_model.graph.snapshot import GraphSnapshot, ParameterTree


class GraphClient(MasterClient):
    """A client of the master that keeps the last parameters while they can't be read, and asks for the rest.

    The master takes some values, such as integers of more than 32 bits, that it can't put into an answer. Then it tells
    no tree that holds one.

    Attributes:
        problem: what of the last snapshot is not of its moment, and what to do; empty if all is.
    """

    problem = ""
    _latest: GraphSnapshot | None = None

    def snapshot(self) -> GraphSnapshot:
        """Take a snapshot. While nothing has changed, it is the same object as before.

        Raises:
            GoneError: nobody listens at the master's address.
            CallError: the master did not answer in time, or gave garbage or an error where it tells no parameters.
        """
        try:
            found = super().snapshot()
        except GarbageError:
            found = self._without_parameters()
        else:
            self.problem = ""
        self._latest = found
        return found

    def _without_parameters(self) -> GraphSnapshot:
        """Take a snapshot with the last parameters, or with those that can be read one by one where none are known."""
        state, types = self._client.call("getSystemState"), self._client.call("getTopicTypes")
        try:
            names, pairs = node_names(state), topic_types(types)
        except ValueError as error:
            raise GarbageError(f"ROS master {self.uri}: {error}") from error
        parameters = self._latest.parameters if self._latest else {}
        if not self.problem:
            readable, bad = self._one_by_one()
            parameters = parameters if bad and parameters else readable
            self.problem = _told(bad) if bad else ""
        found = build_snapshot(state, pairs, parameters, self._addresses(names))
        return self._latest if self._latest is not None and found == self._latest else found

    def _one_by_one(self) -> tuple[ParameterTree, list[str]]:
        """Ask for each parameter. Return the tree of those that can be read, and the names of the others."""
        tree: ParameterTree = {}
        bad = []
        for name in map(str, self._client.call("getParamNames")):
            try:
                value = self._client.call("getParam", name)
            except DeniedError:
                continue  # it has been deleted meanwhile
            except GarbageError:
                bad.append(name)
                continue
            *above, last = name.strip("/").split("/")
            branch: dict[str, Any] = tree
            for part in above:
                branch = branch.setdefault(part, {})
            branch[last] = value
        return tree, bad


def _told(bad: list[str]) -> str:
    return one_line(
        f"parameter {', '.join(bad)}: the master can't tell its value, such as an integer of more than 32 bits, so all "
        f"parameters count as they were before: set it anew or delete it (rosparam delete {bad[0]})"
    )
