"""The simulated computer: its processes, the master with its parameters, and how nodes behave."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from mros1_reasoner.loop import entries
from node_kit.io.xml_rpc import SilentError

from simulated.kernel import Kernel

REGISTER = (0.15, 1.5)  # s, from a node's start to its registration: rospy's imports take 0.3
END = (0.05, 0.6)  # s, from the request to end to the end: rospy takes up to 0.5
FOUND_DEAD = (0.001, 0.05)  # s, until a process's parent sees its end


@dataclass(eq=False)
class NodeProcess:
    """A process of a node.

    Attributes:
        name: of the node.
        pid: its id.
        owner: the launcher's process that has started it; None: somebody else has.
        parameters: what it has read at its start.
        ready: whether it is registered and answers.
        alive: whether it runs.
        hung: whether it is stopped or stuck.
        since: when it last began or ceased to work, s.
        status: exit status once it has ended.
        ending: whether it was asked to end.
        configuration: for which it was started last.
    """

    name: str
    pid: int
    owner: object
    parameters: Mapping[str, Any]
    ready: bool = False
    alive: bool = True
    hung: bool = False
    since: float = 0.0
    status: int | None = None
    ending: bool = False

    @property
    def answers(self) -> bool:
        """Whether it works."""
        return self.alive and self.ready and not self.hung


@dataclass
class Behaviour:
    """How the nodes of a name behave from their next start on.

    Attributes:
        dies_at_start: how often a process still dies right after its start.
        never_ready: whether it never registers.
        dies_after: s after its registration at which it dies, again and again; None: it does not.
        deaf: whether it ignores requests to end.
    """

    dies_at_start: int = 0
    never_ready: bool = False
    dies_after: float | None = None
    deaf: bool = False


class Host:
    """The processes of nodes, and the master.

    Attributes:
        parameters: on the parameter server, by full name.
        registered: the process that each name belongs to, as the master has it: also a dead one.
        behaviours: by name of the node.
        on_end: are called with each process that has ended.
    """

    def __init__(self, kernel: Kernel, counts: Counter[str]) -> None:
        """Begin without processes."""
        self.kernel, self.counts = kernel, counts
        self.parameters: dict[str, Any] = {}
        self.registered: dict[str, NodeProcess] = {}
        self.behaviours: dict[str, Behaviour] = {}
        self.on_end: list[Callable[[NodeProcess], object]] = []
        self.processes: list[NodeProcess] = []
        self.silent_until = 0.0
        self.wall_offset = 0.0
        self.ros_offset = 1000.0
        self.held: set[str] = set()
        self.is_paused = False
        self.clock_stands_at: float | None = None
        self.broken_files: set[str] = set()
        self._pids = itertools.count(1000)

    def living(self) -> Iterator[NodeProcess]:
        """Yield the processes that run."""
        return (process for process in self.processes if process.alive)

    def start(self, name: str, owner: object) -> NodeProcess:
        """Start a node."""
        own = {key: value for key, value in self.parameters.items() if key.startswith(f"{name}/")}
        process = NodeProcess(name, next(self._pids), owner, own)
        self.processes = [*self.living(), process]
        behaviour = self.behaviours.get(name, Behaviour())
        if behaviour.dies_at_start:
            behaviour.dies_at_start -= 1
            self.kernel.after(self.kernel.uniform(0.01, 0.6), lambda: self.kill(process, 1))
        elif not behaviour.never_ready:
            self.kernel.after(self.kernel.uniform(*REGISTER), lambda: self._register(process))
        return process

    def kill(self, process: NodeProcess, status: int = -9) -> None:
        """End a process at once; it stays registered."""
        if process.alive:
            process.alive, process.status, process.since = False, status, self.kernel.now
            for told in self.on_end:
                told(process)

    def ask_to_end(self, process: NodeProcess) -> None:
        """Ask a process to end, as its API or SIGINT does; one that hangs does nothing."""
        process.ending = True
        if not process.hung and not self.behaviours.get(process.name, Behaviour()).deaf:
            self.kernel.after(self.kernel.uniform(*END), lambda: self._end(process))

    def freeze(self, process: NodeProcess) -> None:
        """Have a process hang."""
        self._hang(process, True)

    def thaw(self, process: NodeProcess) -> None:
        """Have a process go on; it heeds a request that came meanwhile."""
        self._hang(process, False)
        if process.alive and process.ending:
            self.ask_to_end(process)

    def answering(self, name: str) -> NodeProcess | None:
        """Return the process that answers under a name; None: nobody does."""
        process = self.registered.get(name)
        return process if process and process.answers else None

    def ros_time(self) -> float:
        """Return ROS time, s: it may stand or jump where a simulator gives it."""
        if self.clock_stands_at is not None:
            return self.clock_stands_at
        return self.kernel.now + self.ros_offset

    def heed_operator(self, command: entries.Command, objectives: Iterable[str]) -> None:
        """Note what an operator's command that was carried out holds, or sets free, of all objectives if of none."""
        match command:
            case entries.Lock(objective):
                self.held |= {objective} if objective else set(objectives)
            case entries.Unlock(objective):
                self.held = {name for name in self.held if objective not in ("", name)}
            case entries.Pause():
                self.is_paused = True
            case entries.Resume():
                self.is_paused = False

    def call(self) -> None:
        """Call the master.

        Raises:
            CallError: it does not answer.
        """
        if self.kernel.now < self.silent_until:
            raise SilentError("master: no answer in time")

    def get(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters that are set."""
        self.call()
        return {name: self.parameters[name] for name in names if name in self.parameters}

    def set(self, values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
        """Delete parameters, then set others."""
        self.call()
        for name in delete:
            self.parameters.pop(name, None)
        self.parameters.update(values)

    def _hang(self, process: NodeProcess, hung: bool) -> None:
        if process.alive and process.hung is not hung:
            process.hung, process.since = hung, self.kernel.now

    def _register(self, process: NodeProcess) -> None:
        if not process.alive:
            return
        if process.hung:
            self.kernel.after(0.1, lambda: self._register(process))
            return
        before = self.registered.get(process.name)
        if before is not None and before is not process and before.alive:
            self.ask_to_end(before)  # as the master does
        self.registered[process.name] = process
        process.ready, process.since = True, self.kernel.now
        behaviour = self.behaviours.get(process.name)
        if behaviour and behaviour.dies_after is not None:
            self.kernel.after(behaviour.dies_after, lambda: self.kill(process, 1))

    def _end(self, process: NodeProcess) -> None:
        if process.alive and not process.hung:
            if self.registered.get(process.name) is process:
                del self.registered[process.name]
            self.kill(process, 0)
