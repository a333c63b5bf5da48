"""Polls the graph in a thread of its own, so that a slow master delays nothing else."""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from node_kit.io.xml_rpc import CallError

if TYPE_CHECKING:
    from collections.abc import Callable

    from ros_model.graph.snapshot import GraphSnapshot

    from rosgraph_monitor.health.liveness import Life
    from rosgraph_monitor.io.graph_client import GraphClient
    from rosgraph_monitor.io.node_connections import NodeConnections

_log = logging.getLogger(__name__)

_SHORTEST = 0.1
"""Wall s between polls at least: many nodes may come or go at once."""


@dataclass(frozen=True)
class PolledGraph:
    """The graph as one poll found it.

    Attributes:
        snapshot: what the master lists.
        lives: what was known of each node before the master was asked: a node that was dead by then and is listed
            has not unregistered (`liveness.is_newer`).
        duration: wall s that the master took.
        problem: what of the snapshot is older; empty if nothing is.
    """

    snapshot: GraphSnapshot
    lives: dict[tuple[str, str], Life]
    duration: float
    problem: str = ""


class GraphPoller:
    """Asks the master at a fixed rate and on request. Start it once, close it at the end."""

    def __init__(
        self,
        client: GraphClient,
        connections: NodeConnections,
        period: float,
        own_name: str,
        on_poll: Callable[[], None],
    ) -> None:
        """Prepare.

        Args:
            client: asks the master; nobody else may use it.
            connections: is told which nodes to watch.
            period: wall s between polls.
            own_name: resolved name of this node, which need not be watched.
            on_poll: called in the polling thread after each poll; one that fails leaves the latest as it was.
        """
        self._client = client
        self._connections = connections
        self._period = period
        self._own_name = own_name
        self._on_poll = on_poll
        self._requested = threading.Event()
        self._closing = False
        self.latest: PolledGraph | None = None
        self.count = 0
        self._thread = threading.Thread(target=self._run, name="graph poller", daemon=True)

    def start(self) -> None:
        """Begin to poll."""
        self._thread.start()

    def request(self) -> None:
        """Poll soon, before the next poll is due."""
        self._requested.set()

    def close(self) -> None:
        """Stop polling."""
        self._closing = True
        self._requested.set()
        self._thread.join(timeout=2.0)

    def _run(self) -> None:
        due = time.monotonic()
        while not self._closing:
            self._requested.clear()
            begin = time.monotonic()
            try:
                self._poll(begin)
            except Exception:  # it costs this poll, and not those to come
                _log.exception("the graph could not be looked at")
            if begin >= due:
                due = max(due + self._period, begin)
            if not self._requested.wait(max(due - time.monotonic(), 0.0)):
                continue
            time.sleep(max(begin + _SHORTEST - time.monotonic(), 0.0))
        self._client.close()

    def _poll(self, begin: float) -> None:
        lives = self._connections.lives()
        try:
            snapshot = self._client.snapshot()
        except CallError:
            return  # who watches the master tells of it
        self.count += 1
        self.latest = PolledGraph(snapshot, lives, time.monotonic() - begin, self._client.problem)
        self._connections.watch({name: node.uri for name, node in snapshot.nodes.items() if name != self._own_name})
        self._on_poll()
