"""The launcher's process: its real supervision over simulated processes, and its service and topic."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_launcher.launching.supervision import LauncherError, Supervisor

from simulated.host import FOUND_DEAD, Host, NodeProcess
from simulated.kernel import Inbox, Process
from simulated.network import Topic

LOOK_PERIOD = 0.2  # s, as the shell's
HANG = 1.5  # s, after which a node that does not answer is killed, as in io/node_processes.py


@dataclass
class Call:
    """A call of the service `change`; `done` when it is answered, or its connection is broken."""

    function: str
    configuration: str
    nodes: Mapping[str, NodeDescription]
    stop: Collection[str]
    start: Collection[str]
    done: bool = False
    broken: bool = False
    error: str = ""
    number: int = 0
    phases: Mapping[str, float] = field(default_factory=dict)


class LauncherPart:
    """One process of the launcher. Its children end with it."""

    def __init__(self, process: Process, host: Host, topic: Topic) -> None:
        """Begin; a former launcher's children have been killed by now."""
        self.process, self.host = process, host
        self._calls: list[Call] = []
        self._inbox = Inbox(process)
        self._topic = topic
        self.busy = False
        self.reports: tuple[LauncherReport, ...] = ()
        for left in list(host.living()):
            if isinstance(left.owner, LauncherPart):
                host.kill(left)
        topic.advertise(process)
        names = _Names(self)
        self._processes = _Processes(self)
        self._supervisor = Supervisor(
            LauncherOptions(mark="", standby=False),
            self._publish,
            lambda line: None,
            _Commands(),
            self._processes,
            names,
            lambda: host.kernel.now,
        )
        process.start(self._spin)

    @property
    def is_idle(self) -> bool:
        """Whether nothing is under way."""
        return not self._calls and not self.busy

    def call(self, call: Call) -> None:
        """Take in a call."""
        self._calls.append(call)
        self._inbox.put()

    def wake(self) -> None:
        """Have it look after its nodes."""
        self._inbox.put()

    def end(self) -> None:
        """Break all calls, and kill the children: the process is dead."""
        for call in self._calls:
            call.broken = True
        for child in list(self.host.living()):
            if child.owner is self:
                self.host.kernel.after(self.host.kernel.uniform(*FOUND_DEAD), lambda child=child: self.host.kill(child))

    def _spin(self) -> None:
        while True:
            due = self._supervisor.next_restart()
            now = self.host.kernel.now
            self._inbox.wait(LOOK_PERIOD if due is None else min(LOOK_PERIOD, max(0.0, due - now)))
            self.busy = True
            self._inbox.drain()
            if self._calls:
                self._answer(self._calls[0])
                self._calls.pop(0)
            self._supervisor.look_after()
            self.busy = False

    def _answer(self, call: Call) -> None:
        try:
            call.phases = self._supervisor.change(
                call.function, call.configuration, call.nodes, call.stop, list(call.start)
            )
        except LauncherError as error:
            call.error = str(error)
        call.number = self._supervisor.changes
        call.done = True

    def _publish(self, reports: tuple[LauncherReport, ...]) -> None:
        self.reports = reports
        self._topic.publish(self.process, reports)


class _Commands:
    def command(self, node: NodeDescription) -> NodeDescription:
        return node


class _Names:
    def __init__(self, launcher: LauncherPart) -> None:
        self._launcher = launcher

    def successor(self, name: str) -> str:
        process = self._launcher.host.answering(name)
        if process is None or process.owner is self._launcher:
            return ""
        return f"its name is taken by process {process.pid}"

    def is_own(self, name: str, conflict: str) -> bool:
        process = self._launcher.host.answering(name)
        return process is not None and process.owner is self._launcher

    def advertised(self, name: str) -> set[str]:
        return {f"{name}/state"}


class _Processes:
    """What io/node_processes.py does, on the simulated host."""

    def __init__(self, launcher: LauncherPart) -> None:
        self._launcher, self._host = launcher, launcher.host
        self._running: dict[str, NodeProcess] = {}
        self._seen: set[NodeProcess] = set()  # ended, as the launcher has seen
        self._host.on_end.append(self._on_end)

    def _on_end(self, process: NodeProcess) -> None:
        if process.owner is self._launcher:
            kernel = self._host.kernel
            kernel.after(kernel.uniform(*FOUND_DEAD), lambda: self._see(process))

    def _see(self, process: NodeProcess) -> None:
        self._seen.add(process)
        self._launcher.wake()

    def take_ended(self) -> dict[str, int]:
        self._launcher.process.check()
        ended = {name: process.status or 0 for name, process in self._running.items() if process in self._seen}
        for name in ended:
            self._seen.discard(self._running.pop(name))
        return ended

    def prepare(self, command: NodeDescription) -> None:
        self._launcher.process.pause(self._host.kernel.uniform(0.0, 0.01))

    def begin(self, name: str, command: NodeDescription, prepared: Any) -> float:
        self._launcher.process.check()
        self._running[name] = self._host.start(name, self._launcher)
        return self._host.kernel.now

    def begin_again(self, name: str, command: NodeDescription) -> float:
        return self.begin(name, command, None)

    def run(self, command: NodeDescription, timeout: float) -> None:
        self._launcher.process.pause(0.1)

    def ask_to_end(self, names: Iterable[str]) -> None:
        for name in names:
            if name in self._running:
                self._host.ask_to_end(self._running[name])

    def end(self, names: Iterable[str], forget: Collection[str] = (), patience: bool = True) -> None:
        leaving = [self._running.pop(name) for name in list(names) if name in self._running]
        wait = self._launcher.process.wait_for

        def gone() -> bool:
            return not any(process.alive for process in leaving)

        first = HANG if patience else 0.0
        if not wait(gone, first):
            for process in leaving:
                if process.alive and process.hung:
                    self._host.kill(process)
            if not wait(gone, 2.0 - HANG if patience else 0.0):
                for process in leaving:
                    if process.alive:
                        self._host.ask_to_end(process)
                wait(gone, 2.0)
        for process in leaving:
            self._host.kill(process)
        for name in forget:
            known = self._host.registered.get(name)
            if known is not None and not known.alive:
                del self._host.registered[name]

    def expect(self, commands: Iterable[NodeDescription]) -> None:
        pass

    def stand_by(self, names: Iterable[str], may_start: bool) -> bool:
        return False

    def end_standby(self) -> None:
        pass

    def close(self) -> None:
        pass
