"""A simulated robot with its meta-controller: parts that respawn, faults that strike, and what can be seen of both."""

from __future__ import annotations

import traceback
from collections import Counter
from collections.abc import Callable
from typing import Any

from mros1_reasoner.loop import entries
from mros1_reasoner.loop.requesting import Answer, Wanted
from mros1_reasoner.loop.settings import Settings as LoopSettings

from simulated.faults import Fault
from simulated.host import Behaviour, Host, NodeProcess
from simulated.kernel import Kernel, Process
from simulated.launcher import LauncherPart
from simulated.manipulator import ManipulatorPart
from simulated.manipulator import Settings as ManipulatorSettings
from simulated.monitor import MonitorPart
from simulated.network import Topic
from simulated.reasoner import Goals, ReasonerPart
from simulated.systems import System

RESPAWN = (0.5, 2.5)  # s, from a part's end until its next process has started


class World:
    """All that runs.

    Attributes:
        kernel: the clock.
        host: the processes of nodes, and the master.
        launcher, manipulator, monitor, reasoner: the present process of each part; None: there is none.
        goals: those at the manipulator.
        broken: what has gone wrong that never may.
        disturbed: when the last fault struck or ended, s.
    """

    def __init__(
        self, system: System, seed: int, manipulator: ManipulatorSettings, reasoner: LoopSettings, counts: Counter[str]
    ) -> None:
        """Start the base's drivers and all parts.

        Args:
            system: the robot's.
            seed: of all chance.
            manipulator: its parameters.
            reasoner: its settings.
            counts: of messages and the like, to add to.
        """
        self.system = system
        self.kernel = Kernel(seed)
        self.host = Host(self.kernel, counts)
        self.counts = counts
        self.broken: list[str] = []
        self.disturbed = 0.0
        self.launcher: LauncherPart | None = None
        self.manipulator: ManipulatorPart | None = None
        self.monitor: MonitorPart | None = None
        self.reasoner: ReasonerPart | None = None
        self._settings, self._loop = manipulator, reasoner
        self._topics = {
            "active": Topic(self.kernel, counts, latched=True),
            "functions": Topic(self.kernel, counts, latched=True),
            "diagnostics": Topic(self.kernel, counts, latched=False),
        }
        self.goals = Goals(self.host, lambda: self.manipulator)
        self.host.on_end.append(self._on_end)
        for node in system.base_nodes:
            self.host.start(node, None)
        for name in _MAKERS:
            self.kernel.after(self.kernel.uniform(0.0, 1.0), lambda name=name: self._start(name))

    def strike(self, fault: Fault) -> None:
        """Have a fault happen now."""
        self.counts[fault.kind.value] += 1
        self._disturb()
        getattr(self, f"_{fault.kind.name.lower()}")(fault.target, fault.value)

    def end_faults(self) -> None:
        """Lift all that still goes on but what has broken for good."""
        self.host.behaviours.clear()
        self.host.broken_files.clear()
        self.host.silent_until = min(self.host.silent_until, self.kernel.now)
        self._clock_goes()
        for process in self.host.living():
            if process.name not in self.system.base_nodes:
                self.host.thaw(process)
            if process.owner is None and process.name not in self.system.base_nodes:
                self.host.ask_to_end(process)
        for part in (self.launcher, self.manipulator, self.monitor, self.reasoner):
            if part is not None:
                part.process.thaw()
        if self.launcher is None:
            self._start("launcher")
        self._resume()
        self._unlock("")
        self._disturb()

    def close(self) -> None:
        """End all tasks: those that wait would be kept for ever, and all else with them."""
        for part in (self.launcher, self.manipulator, self.monitor, self.reasoner):
            if part is not None:
                part.process.kill()

    # -- parts ----------------------------------------------------------------------------------------------------

    def _start(self, name: str) -> None:
        if getattr(self, name) is None:
            process = Process(self.kernel, name, self._on_error)
            setattr(self, name, _MAKERS[name](self, process))
            self._disturb()

    def _end_part(self, name: str, away: float = 0.0) -> None:
        """End a part; it starts again after so many s, 0: after a usual time."""
        part = getattr(self, name)
        if part is None:
            return
        setattr(self, name, None)
        part.process.kill()
        if name == "launcher":
            part.end()
        elif name == "manipulator":
            self.goals.lost(part)
        self._disturb()
        self.kernel.after(away or self.kernel.uniform(*RESPAWN), lambda: self._start(name))

    def _on_error(self, name: str, error: BaseException) -> None:
        where = traceback.format_exception(error)[-4:]
        self.broken.append(f"an exception left {name}: {type(error).__name__}: {error}\n{''.join(where)}")
        self._end_part(name)

    def _on_end(self, process: NodeProcess) -> None:
        self._disturb()

    def _disturb(self) -> None:
        self.disturbed = self.kernel.now

    def make_launcher(self, process: Process) -> LauncherPart:
        """Start the launcher's process."""
        return LauncherPart(process, self.host, self._topics["functions"])

    def make_manipulator(self, process: Process) -> ManipulatorPart:
        """Start the manipulator's process."""
        return ManipulatorPart(process, self.host, self.system, self._topics, lambda: self.launcher, self._settings)

    def make_monitor(self, process: Process) -> MonitorPart:
        """Start the monitor's process."""
        others = (self.launcher, self.manipulator, self.reasoner)
        head_start = max([0.0, *(process.started - part.process.started for part in others if part is not None)])
        return MonitorPart(process, self.host, self.system, self._topics, head_start)

    def make_reasoner(self, process: Process) -> ReasonerPart:
        """Start the reasoner's process."""
        return ReasonerPart(process, self.host, self.system, self._topics, self.goals, self._loop)

    # -- faults ---------------------------------------------------------------------------------------------------

    def _kill_part(self, target: str, value: float) -> None:
        self._end_part(target, value)

    def _dismiss_part(self, target: str, value: float) -> None:
        if target == "manipulator" and self.manipulator is not None and not self.manipulator.process.frozen:
            self.manipulator.say_goodbye()
        self._end_part(target)

    def _freeze_part(self, target: str, value: float) -> None:
        part = getattr(self, target)
        if part is not None:
            part.process.freeze()
            self._later(value, part.process.thaw)

    def _own(self, node: str) -> NodeProcess | None:
        return next((p for p in self.host.living() if p.name == node), None)

    def _kill_node(self, target: str, value: float) -> None:
        process = self._own(target)
        if process:
            self.host.kill(process, -9)

    def _freeze_node(self, target: str, value: float) -> None:
        process = self._own(target)
        if process:
            self.host.freeze(process)
            if value:
                self._later(value, lambda: self.host.thaw(process))

    def _kill_driver(self, target: str, value: float) -> None:
        self._kill_node(target, value)
        if value:
            self._later(value, lambda: self._own(target) or self.host.start(target, None))

    def _behave(self, node: str, **changes: Any) -> None:
        behaviour = self.host.behaviours.setdefault(node, Behaviour())
        for name, value in changes.items():
            setattr(behaviour, name, value)

    def _dies_at_start(self, target: str, value: float) -> None:
        self._behave(target, dies_at_start=int(value))

    def _never_ready(self, target: str, value: float) -> None:
        self._behave(target, never_ready=True)
        self._later(value, lambda: self._behave(target, never_ready=False))

    def _dies_later(self, target: str, value: float) -> None:
        self._behave(target, dies_after=value)

    def _deaf(self, target: str, value: float) -> None:
        self._behave(target, deaf=True)

    def _slow(self, target: str, value: float) -> None:
        topic = self._topics[target]
        topic.slow_until, topic.slowness = self.kernel.now + value, value

    def _reconnect(self, target: str, value: float) -> None:
        self._topics[target].reconnect()

    def _master_silent(self, target: str, value: float) -> None:
        self.host.silent_until = self.kernel.now + value

    def _clock_stands(self, target: str, value: float) -> None:
        self.host.clock_stands_at = self.host.ros_time()
        self._later(value, self._clock_goes)

    def _clock_goes(self) -> None:
        if self.host.clock_stands_at is not None:
            self.host.ros_offset = self.host.clock_stands_at - self.kernel.now
            self.host.clock_stands_at = None

    def _clock_jumps(self, target: str, value: float) -> None:
        self.host.ros_offset += value

    def _wall_jumps(self, target: str, value: float) -> None:
        self.host.wall_offset += value

    def _foreign(self, target: str, value: float) -> None:
        process = self.host.start(target, None)
        self._later(value, lambda: self.host.kill(process, -2))

    def _drift(self, target: str, value: float) -> None:
        self.host.parameters[target] = "overwritten"

    def _file_gone(self, target: str, value: float) -> None:
        self.host.broken_files.add(target)
        self._later(value, lambda: self.host.broken_files.discard(target))

    def _request(self, target: str, value: float) -> Any:
        if not self.goals.is_there():
            return None
        function = self.system.options.configurations[target].function
        client = Process(self.kernel, "operator", self._on_error)
        return self.goals.send(client, Wanted(function, target), _ignore, lambda work: work())

    def _cancelled_request(self, target: str, value: float) -> None:
        handle = self._request(target, value)
        if handle:
            self._later(value, handle.cancel)

    def _lock(self, target: str, value: float) -> None:
        self._command(entries.Lock(target))
        self._later(value, lambda: self._unlock(target))

    def _unlock(self, target: str) -> None:
        self._insist(entries.Unlock(target), lambda: bool(self.host.held & {target} if target else self.host.held))

    def _pause(self, target: str, value: float) -> None:
        self._command(entries.Pause())
        self._later(value, self._resume)

    def _resume(self) -> None:
        self._insist(entries.Resume(), lambda: self.host.is_paused)

    def _insist(self, command: entries.Command, is_needed: Callable[[], bool]) -> None:
        """Give a command, and repeat it: a service says so where there is no reasoner, or where that dies with it."""
        self._command(command)
        self._later(1.0, lambda: self._insist(command, is_needed) if is_needed() else None)

    def _command(self, command: entries.Command) -> None:
        if self.reasoner is not None:
            self.reasoner.command(command)

    def _later(self, delay: float, work: Callable[[], object]) -> None:
        def done() -> None:
            self._disturb()
            work()

        self.kernel.after(delay, done)


_MAKERS: dict[str, Callable[[World, Process], Any]] = {
    "launcher": World.make_launcher,
    "manipulator": World.make_manipulator,
    "monitor": World.make_monitor,
    "reasoner": World.make_reasoner,
}


def _ignore(answer: Answer) -> None:
    pass
