"""The manipulator's process: its real decisions, changes and requests over the simulated host."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from dataclasses import replace as replace_fields
from typing import Any

from node_kit.io.xml_rpc import CallError
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.report import FAILED, LauncherReport
from rosgraph_manipulator.change.deployment import DeploymentError, Outcome
from rosgraph_manipulator.change.execution import Execution
from rosgraph_manipulator.change.journal import Journal, begin_journal, parse_journal
from rosgraph_manipulator.change.manipulation import Manipulation, resumptions
from rosgraph_manipulator.change.parameters import OverwrittenParameters
from rosgraph_manipulator.change.request_queue import Policy
from rosgraph_manipulator.change.requests import Requests
from rosgraph_manipulator.change.tactics import NoRunningNodes, nothing, parameters, replace, restart
from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_manipulator.hosts.merging import merged, stale
from rosgraph_manipulator.hosts.reported import Reported
from rosgraph_manipulator.io.launch_files import LaunchFile

from simulated.host import Host
from simulated.kernel import Inbox, Process
from simulated.launcher import Call, LauncherPart
from simulated.network import Topic
from simulated.systems import System

TACTICS = {"nothing": nothing, "parameters": parameters, "restart": restart, "replace": replace}
LAUNCHER = "rosgraph_launcher"
LOOK_PERIOD = 0.5  # s
FIND = 10.0  # s, for a launcher to be found
JUST_NOW = 1.0  # s, in which the launcher may have stopped since it was found
EPOCH = 1.7e9  # s, of the wall clock at the start
ROSLAUNCH = "roslaunch"  # starts each manipulator


@dataclass(frozen=True)
class Active:
    """What runs for a function, as rosgraph_manipulator/active_configuration tells it."""

    function: str
    configuration: str
    state: str


@dataclass(frozen=True)
class Settings:
    """The manipulator's parameters."""

    policy: Policy = Policy.WAIT
    initial: tuple[str, ...] = ()


class ManipulatorPart:
    """One process of the manipulator."""

    def __init__(
        self,
        process: Process,
        host: Host,
        system: System,
        topics: Mapping[str, Topic],
        launcher: Callable[[], LauncherPart | None],
        settings: Settings,
    ) -> None:
        """Begin; all else happens in a task."""
        self.process, self.host, self.system, self._topics = process, host, system, topics
        self._settings, self._launcher = settings, launcher
        self._inbox = Inbox(process)
        self.busy = True
        self.serves = False
        self.found = float("-inf")  # when it was seen last that the launcher answers, s
        self.told: dict[str, Active] = {}
        self.heard: tuple[LauncherReport, ...] | None = None  # the launcher's last reports
        topics["active"].advertise(process)
        topics["diagnostics"].advertise(process)
        topics["functions"].subscribe(process, self._take_reports, queue=20)
        self.requests: Requests | None = None
        self.say_goodbye: Callable[[], object] = lambda: None
        self._launchers = _Launchers(self, launcher)
        process.start(self._run)

    @property
    def is_idle(self) -> bool:
        """Whether it serves, and nothing waits or is under way, nor a report of the launcher."""
        return self.serves and not self.busy and not self._inbox and not self._topics["functions"].brings(self.process)

    def _take_reports(self, reports: tuple[LauncherReport, ...]) -> None:
        self.heard = reports
        told = {report.function: report for report in reports}
        self._launchers.told.take(told, self._topics["functions"].delivers)
        self.process.call(self._launchers.on_reports)

    def _run(self) -> None:
        system, host = self.system, self.host
        around = _Around(self)
        self.process.wait_for(lambda: self.heard is not None, FIND)
        prefix = "/rosgraph_manipulator"
        journal = parse_journal(host.parameters.get(f"{prefix}/journal"))
        initial = {system.options.configurations[name].function: name for name in self._settings.initial}
        begun = resumptions(system.options, journal, self._launchers.reports(), initial, self.wall(), ROSLAUNCH)

        def follow_launcher() -> None:
            manipulation.follow_launcher()

        executor = Execution(
            system.options,
            {},
            OverwrittenParameters.from_parameter(host.parameters.get(f"{prefix}/overwritten")),
            ready_timeout=15.0,
            settle_time=0.5,
            launchers=self._launchers,
            on_report=lambda: self._inbox.put(follow_launcher),
            around=around,
            adjusting=_NoServers(),
            make_names=lambda _describe, has_finished: _Names(self, has_finished),
        )
        keeper = _JournalKeeper(self, begin_journal(begun.values(), ROSLAUNCH))
        manipulation = Manipulation(
            system.options, TACTICS, 5.0, executor, _Announcer(self), keeper, around, lambda _runs: None
        )
        requests = Requests(
            system.options,
            self._settings.policy,
            manipulation.carry_out,
            self._inbox.put,
            contextlib.nullcontext(),
            manipulation.make_whole,
        )
        executor.check = requests.check
        self.process.start(lambda: self._beat(manipulation))
        self.say_goodbye = manipulation.end
        manipulation.begin(begun)
        self.requests, self.serves = requests, True
        while True:
            self.busy = False
            self._inbox.wait(LOOK_PERIOD)
            if self._inbox:
                self.busy = True
                self._inbox.do_next()
            else:
                manipulation.look()

    def _beat(self, manipulation: Manipulation) -> None:
        while True:
            self.process.pause(0.5)
            manipulation.heartbeat()

    def wall(self) -> float:
        """Return the time of the wall clock, s since the epoch."""
        return EPOCH + self.host.kernel.now + self.host.wall_offset

    def launcher_answers(self) -> bool:
        """Tell whether the launcher is there and does not hang."""
        launcher = self._launcher()
        return launcher is not None and not launcher.process.frozen

    @property
    def launcher(self) -> LauncherPart | None:
        """The launcher's present process; None: there is none."""
        return self._launcher()


class _JournalKeeper:
    def __init__(self, part: ManipulatorPart, journal: Journal) -> None:
        self._part, self._journal = part, journal
        self._is_behind = False

    def update(self, change: Callable[[Journal, float], Journal]) -> None:
        self._part.process.check()
        journal = change(self._journal, self._part.wall())
        if journal is not self._journal or self._is_behind:
            self._journal, self._is_behind = journal, True
            with contextlib.suppress(CallError):
                self._part.host.set({"/rosgraph_manipulator/journal": journal.as_parameter()})
                self._is_behind = False


class _Announcer:
    def __init__(self, part: ManipulatorPart) -> None:
        self._part = part

    def begin(self, states: Mapping[Configuration, str]) -> None:
        for configuration, state in states.items():
            self._part.told[configuration.function] = Active(configuration.function, configuration.name, state)
        self._publish()

    def announce(
        self,
        configuration: Configuration,
        state: str,
        outcome: Outcome | None = None,
        phases: Mapping[str, float] | None = None,
    ) -> None:
        self._part.told[configuration.function] = Active(configuration.function, configuration.name, state)
        self._publish()

    def announce_release(self, function: str, outcome: Outcome, phases: Mapping[str, float]) -> None:
        self._part.told.pop(function, None)
        self._publish()

    def diagnose(self, ok: bool, message: str, configuration: str) -> None:
        pass

    def _publish(self) -> None:
        self._part._topics["active"].publish(self._part.process, tuple(self._part.told.values()))


class _NoServers(NoRunningNodes):
    def set(self, server: str, values: Mapping[str, Any]) -> None:
        raise DeploymentError(f"{server} does not answer")


class _Log:
    def info(self, line: str) -> None:
        pass

    def warn(self, line: str, once: bool = False) -> None:
        pass

    def error(self, line: str) -> None:
        pass


class _Around:
    """The `Surroundings` of the simulated manipulator."""

    failures: tuple[type[Exception], ...] = (OSError,)
    is_ending = False

    def __init__(self, part: ManipulatorPart) -> None:
        self._part, self._host = part, part.host
        self.log = _Log()

    def now(self) -> float:
        self._part.process.check()
        return self._host.kernel.now

    def pause(self, duration: float) -> None:
        self._part.process.pause(duration)

    @contextmanager
    def news(self) -> Iterator[None]:
        yield

    def wait_for_news(self, condition: Callable[[], bool], timeout: float) -> bool:
        return self._part.process.wait_for(condition, timeout)

    def resolve(self, name: str) -> str:
        return name if name.startswith("/") else f"{self._part.system.namespace}{name.lstrip('~')}"

    def publishers(self, topic: str) -> set[str]:
        self._host.call()
        return set()

    def drivers(self) -> set[str]:
        self._host.call()
        return set()

    def halt(self) -> None:
        self._part.process.check()

    def advertised(self, nodes: Collection[str]) -> set[str]:
        self._host.call()
        return set()

    def parameters(self, names: Iterable[str]) -> dict[str, Any]:
        self._part.process.pause(0.001)
        return self._host.get(names)

    def set_parameters(self, values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
        self._part.process.pause(0.001)
        self._host.set(values, delete)

    def run(self, command: Sequence[str]) -> None:
        raise DeploymentError(f"no command {command[0]} here")

    def silent(self, nodes: Collection[str]) -> set[str]:
        self._part.process.pause(0.01)
        return {node for node in nodes if self._host.answering(node) is None}

    def shut_down(self, node: str, reason: str) -> bool:
        process = self._host.answering(node)
        if process is not None and self.now() >= self._host.silent_until:  # else nobody knows where it is
            if not self._part.launcher_answers() and self.now() - self._part.found > JUST_NOW:
                raise AssertionError(f"node {node} is ended, and nobody can start another one in its place")
            self._host.ask_to_end(process)
            return True
        return False

    def is_answering(self, node: str) -> bool:
        return self._host.answering(node) is not None

    def end_node(self, node: str) -> None:
        raise DeploymentError(f"node {node} does not end")

    def launch_file(self, configuration: Configuration) -> LaunchFile:
        self._part.process.pause(0.005)
        if configuration.name in self._host.broken_files:
            raise DeploymentError(f"{configuration.launch_file}: no such file")
        return LaunchFile(self._part.system.described[configuration.name])

    def why_not_started(self, node: NodeDescription) -> str:
        return ""


class _Names:
    def __init__(self, part: ManipulatorPart, has_finished: Callable[[str], bool]) -> None:
        self._part, self._has_finished = part, has_finished
        self.contested: tuple[str, ...] = ()

    def begin(self) -> None:
        self.contested = ()

    def see_takers(self, nodes: Collection[str]) -> None:
        self.contested = tuple(node for node in sorted(nodes) if self._part.host.answering(node) is not None)

    def is_up(self, node: str) -> bool:
        self._part.process.pause(0.002)
        process = self._part.host.answering(node)
        return self._is_own(process) or self._has_finished(node)

    def conflict(self, node: str) -> str:
        process = self._part.host.answering(node)
        taken = process is not None and not self._is_own(process)
        return f" (its name is taken by process {process.pid})" if process and taken else ""

    def _is_own(self, process: Any) -> bool:
        return process is not None and isinstance(process.owner, LauncherPart)


@dataclass(frozen=True)
class _Changed:
    number: int
    phases: Mapping[str, float]


class _Launchers:
    """What ros/launchers.py and ros/launcher_reports.py do, for the one launcher of this host."""

    def __init__(self, part: ManipulatorPart, present: Callable[[], LauncherPart | None]) -> None:
        self._part, self._present = part, present
        self.on_reports: Callable[[], object] = lambda: None
        self.losses = 0
        self.told = Reported()
        self._parts: dict[str, frozenset[str]] = {}

    def reports(self) -> dict[str, LauncherReport]:
        functions = sorted({*self.told.functions, *self._parts})
        return {name: merged(name, self._of(name), self._parts.get(name), {}) for name in functions}

    def _of(self, function: str) -> dict[str, LauncherReport]:
        report = self.told.report(function)
        return {} if report is None else {LAUNCHER: report}

    def lost_hosts(self, function: str) -> list[str]:
        return []

    def unconnected(self, function: str) -> str:
        return "" if self._is_connected() or not self._parts.get(function) else f"/{LAUNCHER}"

    def _is_connected(self) -> bool:
        present = self._present()
        topic = self._part._topics["functions"]
        return present is not None and topic.connected(self._part.process, present.process)

    def main_has_ended(self, function: str) -> bool:
        return bool(self.unconnected(function))

    def is_here(self, node: NodeDescription) -> bool:
        return True

    def adopt(self, function: str, nodes: Iterable[NodeDescription]) -> None:
        self._parts[function] = frozenset({LAUNCHER})
        self.on_reports()

    def expect_nothing(self, function: str) -> None:
        self._parts[function] = frozenset()
        self.on_reports()

    def require(self, function: str, nodes: Iterable[NodeDescription]) -> None:
        self._find(FIND, self._part.launcher_answers)
        self._part.found = self._part.host.kernel.now

    def _find(self, timeout: float, is_found: Callable[[], bool]) -> None:
        if not self._part.process.wait_for(is_found, timeout):
            raise DeploymentError(f"/{LAUNCHER} has failed (timeout exceeded): check that it runs")

    def change(
        self,
        function: str,
        configuration: str,
        nodes: Iterable[NodeDescription],
        stop: Iterable[str],
        start: Iterable[str],
        found: Callable[[], None],
    ) -> _Changed:
        described = {node.name: node for node in nodes}
        self._parts[function] = frozenset({LAUNCHER})
        call = self._ask(Call(function, configuration, described, list(stop), list(start)), found)
        self._parts[function] = frozenset({LAUNCHER} if configuration else ())
        self.on_reports()
        numbers = {LAUNCHER: call.number}
        return _Changed(sum(numbers.values()), call.phases)

    def clear(self, function: str) -> list[str]:
        if function not in self._parts or not self._is_connected():
            return []
        names = stale(self._of(function), self._parts[function])
        if names:
            self._release(function)
        return names

    def stop_rest(self, function: str) -> None:
        report = self.told.report(function)
        if report and report.configuration and report.nodes and report.state != FAILED:
            self._release(function)

    def _release(self, function: str) -> None:
        with contextlib.suppress(DeploymentError):
            self._ask(Call(function, "", {}, [], []), lambda: None)

    def _ask(self, call: Call, found: Callable[[], None]) -> Call:
        """Return the answered call. One that reached a launcher that has died is left for its successor."""
        process, kernel = self._part.process, self._part.host.kernel
        deadline = kernel.now + FIND
        while True:
            self._find(max(deadline - kernel.now, 0.01), lambda: self._present() is not None)
            found()
            launcher = self._present()
            process.pause(kernel.uniform(0.001, 0.01))
            attempt, connection = replace_fields(call), self.told.connection
            if launcher is not None and launcher.process.alive:
                self._wait_for_answer(launcher, attempt)
            if attempt.done and attempt.error:
                raise DeploymentError(attempt.error)
            if attempt.done:
                self.told.answer(call.function, attempt.number, connection)
                return attempt
            if kernel.now > deadline:
                raise DeploymentError(f"{LAUNCHER} has failed: check that it runs")

    def _wait_for_answer(self, launcher: LauncherPart, call: Call) -> None:
        process, kernel = self._part.process, self._part.host.kernel
        launcher.call(call)
        process.wait_for(lambda: call.done or not launcher.process.alive, float("inf"), 0.005)
        process.pause(kernel.uniform(0.0005, 0.005))
