"""Measures what nodes use, on this host and, through their launchers, on others, in a thread of its own."""

from __future__ import annotations

import os
import threading
import time
from concurrent.futures import wait
from functools import partial
from typing import TYPE_CHECKING

import rospy
from metacontrol_msgs.srv import ReadUsage
from node_kit.io.background import in_background
from node_kit.ros.services import SERVICE_FAILURES
from rosgraph_launcher.io.ownership import is_this_host
from rosgraph_launcher.io.this_host import resolved as addresses_of
from rosgraph_launcher.io.usage import read_samples
from rosgraph_launcher.ros.node_messages import samples_from

from rosgraph_monitor.graph.names import resolved
from rosgraph_monitor.health.usage import THIS_HOST, UsageMeter, host_of, launchers_in, tellers

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from concurrent.futures import Future

    from ros_model.graph.snapshot import GraphSnapshot
    from rosgraph_launcher.usage import Sample

    from rosgraph_monitor.diagnostics.status import Status

_PERIOD = 1.0
"""Wall s between two measurements."""
_DEADLINE = 0.5
"""Wall s in which all launchers must answer."""
_LAUNCHERS = "rosgraph_launcher/functions"
_MAIN_LAUNCHER = "rosgraph_launcher"


class UsageWatch:
    """Measures nodes again and again. A launcher that does not answer costs the figures of its host, nothing else."""

    def __init__(
        self,
        names: Sequence[str],
        graph: Callable[[], GraphSnapshot | None],
        pids: Callable[[], Mapping[tuple[str, str], int]],
        publish: Callable[[list[Status]], None],
    ) -> None:
        """Begin.

        Args:
            names: the nodes, as the statuses name them.
            graph: returns the running graph; None: it has not been seen yet.
            pids: returns the process id, on its own host, of each other node that lives, by name and address.
            publish: takes the statuses, in the thread that measures.
        """
        self._names = {resolved(name, rospy.get_namespace()): name for name in names}
        self._graph, self._pids, self._publish = graph, pids, publish
        self._topic = rospy.resolve_name(_LAUNCHERS)
        self._meter = UsageMeter()
        self._asked: dict[str, Future[dict[int, Sample]]] = {}  # launchers that have not answered yet
        self._warned: set[tuple[str, type[BaseException]]] = set()
        threading.Thread(target=self._run, name="usage", daemon=True).start()

    def _run(self) -> None:
        while not rospy.is_shutdown():
            try:
                graph = self._graph()
                if graph is not None:
                    self._publish(self._meter.tell(self._measure(graph)))
            except Exception as error:  # it costs this look, and not those to come
                if not rospy.core.is_shutdown_requested():
                    self._warn("CPU and memory are not reported", error)
            time.sleep(_PERIOD)

    def _measure(self, graph: GraphSnapshot) -> dict[tuple[str, str], Sample]:
        """Return a sample of each node, by its name and who has looked."""
        pids = self._live_pids(graph)
        hosts = {node: host_of(graph.nodes[node].uri) for node in pids if node in self._names}
        launchers = launchers_in(graph, self._topic, pids)
        here = {host for host in set(hosts.values()) if is_this_host(host)}
        far = {host: addresses_of(host) for host in set(hosts.values()) - here} if launchers else {}
        wanted: dict[str, dict[str, int]] = {}
        for node, teller in tellers(hosts, here, launchers, far).items():
            wanted.setdefault(teller, {})[node] = pids[node]
        # The children of a launcher are nodes of their own.
        alone = {rospy.resolve_name(_MAIN_LAUNCHER), *(launcher.name for launcher in launchers)}
        told = self._ask({teller: nodes for teller, nodes in wanted.items() if teller != THIS_HOST}, alone)
        mine = wanted.get(THIS_HOST, {})
        told[THIS_HOST] = read_samples(mine.values(), {pid for node, pid in mine.items() if node in alone})
        return {
            (self._names[node], teller): told[teller][pid]
            for teller, nodes in wanted.items()
            for node, pid in nodes.items()
            if pid in told.get(teller, {})
        }

    def _live_pids(self, graph: GraphSnapshot) -> dict[str, int]:
        """Return the process id of each node that lives where the graph has it."""
        own = rospy.get_name()
        addresses = {(name, node.uri) for name, node in graph.nodes.items()}
        pids = {key[0]: pid for key, pid in self._pids().items() if key in addresses}
        return pids | ({own: os.getpid()} if own in graph.nodes else {})

    def _ask(self, wanted: Mapping[str, Mapping[str, int]], alone: Collection[str]) -> dict[str, dict[int, Sample]]:
        """Ask launchers side by side, each for its nodes; return what those tell that answer in time.

        One that has left a question unanswered is not asked again before it has answered that.
        """
        self._asked = {name: question for name, question in self._asked.items() if not question.done()}
        new = {
            name: in_background(partial(_read, name, nodes, alone), "ask for usage")
            for name, nodes in wanted.items()
            if name not in self._asked
        }
        self._asked.update(new)
        wait(new.values(), _DEADLINE)
        told = {}
        for name, question in new.items():
            if not question.done():
                continue
            error = question.exception()
            if error is None:
                told[name] = question.result()
            else:
                self._warn(f"CPU and memory of nodes on the host of {name} are not reported", error)
        return told

    def _warn(self, what: str, error: BaseException) -> None:
        """Warn once of each kind of error."""
        trouble = what, type(error)
        if trouble not in self._warned:
            self._warned.add(trouble)
            rospy.logwarn("%s: %s: %s", what, type(error).__name__, error)


def _read(launcher: str, nodes: Mapping[str, int], alone: Collection[str]) -> dict[int, Sample]:
    """Return what a launcher tells of processes of its host; nothing where it fails."""
    without_children = [pid for node, pid in nodes.items() if node in alone]
    try:
        answer = rospy.ServiceProxy(f"{launcher}/usage", ReadUsage)(list(nodes.values()), without_children)
    except SERVICE_FAILURES:
        return {}
    return samples_from(answer.processes)
