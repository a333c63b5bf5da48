"""The monitor's process: its real evaluation and liveness over the simulated master."""

from __future__ import annotations

import errno
from collections.abc import Iterable, Mapping
from types import SimpleNamespace
from typing import Any

from ros_model.errors import ModelError
from ros_model.graph.snapshot import GraphSnapshot, build_snapshot
from ros_model.language.metamodel import PortKind, RosSystem
from rosgraph_monitor.diagnostics.status import Status
from rosgraph_monitor.evaluation import GraphEvaluator, Patience
from rosgraph_monitor.graph.comparison import Scope
from rosgraph_monitor.graph.desired import DesiredModel, Grounding
from rosgraph_monitor.health import liveness
from rosgraph_monitor.health.liveness import Action, Liveness, Timing

from simulated.host import Host, NodeProcess
from simulated.kernel import Inbox, Process
from simulated.network import Topic
from simulated.systems import System

PERIOD = 0.5  # s, of polls
PROBES = 0.25  # s, between two looks at the connections
NAME = "rosgraph_monitor"


class MonitorPart:
    """One process of the monitor.

    Attributes:
        head_start: for how long others had run when it began, s.
        told: what it has published last.
    """

    def __init__(
        self, process: Process, host: Host, system: System, topics: Mapping[str, Topic], head_start: float
    ) -> None:
        """Begin."""
        self.process, self._host, self._system, self._topics = process, host, system, topics
        self.head_start = head_start
        self.told: tuple[Any, ...] = ()
        self._inbox = Inbox(process)
        self._model = DesiredModel(system.base, self._read, system.variants.values)
        self._monitor = GraphEvaluator(system.components, scope=Scope(namespace=system.namespace))
        self._lives: dict[tuple[str, str], Liveness] = {}
        self._known: dict[str, NodeProcess] = {}
        self._grace = Patience().grace(head_start)
        self._snapshot: GraphSnapshot | None = None
        self._shown: tuple[Any, ...] = ()  # what the snapshot shows
        topics["diagnostics"].advertise(process)
        topics["active"].subscribe(process, self._follow, queue=5)
        host.on_end.append(self._on_end)
        process.start(self._run)
        process.start(self._probe)

    def _run(self) -> None:
        while True:
            if self._poll() and self._snapshot is not None:
                lives = {key: state.life for key, state in self._lives.items()}
                now, desired = self._host.kernel.now, self._model.current
                statuses = self._monitor.evaluate(self._snapshot, lives, desired, now, grace=self._grace)
                self.told = _messages(statuses)
                self._topics["diagnostics"].publish(self.process, self.told)
            self.process.pause(0.02)
            self._inbox.wait(PERIOD)
            self._inbox.drain()

    def _poll(self) -> bool:
        self.process.pause(0.01)
        if self._host.kernel.now < self._host.silent_until:
            return self._snapshot is not None
        shown = dict(self._host.registered), dict(self._host.parameters)
        if shown != self._shown:  # while nothing has changed, it is the same object as before, as in io/graph_client.py
            self._shown, self._snapshot = shown, _snapshot(self._system, self._host)
        self._known = shown[0]
        keys = {_key(process): process for process in self._known.values()}
        self._lives = {key: self._lives.get(key, Liveness()) for key in keys}
        return True

    def _probe(self) -> None:
        """Hold a connection to each node, and ask it now and then."""
        timing = Timing()
        while True:
            for process in list(self._known.values()):
                key, now = _key(process), self._host.kernel.now
                state = self._lives.get(key)
                if state is not None:
                    self._take(key, _next(state, process, now, timing))
            self.process.pause(PROBES)

    def _on_end(self, process: NodeProcess) -> None:
        """The kernel closes the connection of a process that ends."""
        key = _key(process)
        if self.process.alive and not self.process.frozen and key in self._lives:
            self._take(key, _next(self._lives[key], process, self._host.kernel.now, Timing()))

    def _take(self, key: tuple[str, str], state: Liveness) -> None:
        before = self._lives.get(key, Liveness()).life
        self._lives[key] = state
        if state.life is not before:
            self._inbox.put()

    def _follow(self, active: Iterable[Any]) -> None:
        def take() -> None:
            self._model.follow(Grounding(a.function, a.configuration, a.state) for a in active)
            self._inbox.put()

        self.process.call(take)

    def _read(self, name: str) -> RosSystem:
        if name not in self._system.variants:
            raise ModelError(f"no variant {name}")
        return self._system.variants[name]


def _key(process: NodeProcess) -> tuple[str, str]:
    return process.name, f"http://host:{process.pid}/"


def _next(state: Liveness, process: NodeProcess, now: float, timing: Timing) -> Liveness:
    """Return the state of a connection after all that happens at once on it."""
    answers = process.alive and not process.hung
    if state.connected and not process.alive:  # the kernel has closed it; a monitor that hung meanwhile sees it now
        state = liveness.on_closed(state, now, timing)
    for _ in range(4):
        state, action = liveness.due(state, now, timing)
        if action is Action.CONNECT and not process.alive:
            return liveness.on_connect_error(state, errno.ECONNREFUSED, now, timing)
        if action is Action.CONNECT:
            state = liveness.on_connected(state, now)
        elif answers and (action is Action.PROBE or state.asked_at is not None):
            return liveness.on_answer(state, now, timing)
        else:
            return state
    return state


def _snapshot(system: System, host: Host) -> GraphSnapshot:
    kinds: tuple[dict[str, list[str]], ...] = ({}, {}, {})
    of_kind = {PortKind.PUBLISHER: kinds[0], PortKind.SUBSCRIBER: kinds[1], PortKind.SERVICE_SERVER: kinds[2]}
    for name in host.registered:
        component = system.component_of(name)
        kinds[0].setdefault("/rosout", []).append(name)
        for port in component.ports if component else ():
            if port.kind in of_kind:
                of_kind[port.kind].setdefault(f"{system.namespace}{port.name.strip('/')}", []).append(name)
    state = [[[topic, nodes] for topic, nodes in kind.items()] for kind in kinds]
    addresses = dict(map(_key, host.registered.values()))
    return build_snapshot(state, [], _tree(host.parameters), addresses)


def _tree(parameters: Mapping[str, Any]) -> dict[str, Any]:
    tree: dict[str, Any] = {}
    for name, value in parameters.items():
        *path, last = name.strip("/").split("/")
        branch = tree
        for part in path:
            branch = branch.setdefault(part, {})
        branch[last] = value
    return tree


def _messages(statuses: Iterable[Status]) -> tuple[Any, ...]:
    """Return what diagnostic_msgs/DiagnosticStatus would hold."""
    return tuple(
        SimpleNamespace(
            level=int(status.level),
            name=status.name,
            message=status.message,
            hardware_id=status.hardware_id,
            values=[SimpleNamespace(key=key, value=value) for key, value in status.values],
        )
        for status in statuses
    )
