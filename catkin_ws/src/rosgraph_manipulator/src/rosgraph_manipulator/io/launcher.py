"""Owns the nodes of the configuration that runs: starts and stops them, and starts those again that die.

Not for several threads: the main thread of the node rosgraph_launcher calls everything here.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import rospkg

from rosgraph_manipulator.change.supervision import RestartPolicy, Supervisor
from rosgraph_manipulator.configuration.description import NodeDescription, SystemDescription
from rosgraph_manipulator.io import processes
from rosgraph_manipulator.io.launch_files import (
    LaunchFile,
    LaunchFileError,
    command_line,
    process_environment,
    read_launch_file,
)
from rosgraph_manipulator.io.master import (
    MasterError,
    NodeApi,
    advertised,
    forget_node,
    get_parameters,
    set_parameters,
)
from rosgraph_manipulator.io.processes import Command, Process, StartError

COMMAND_TIMEOUT = 5.0  # s, wall, for a `rosparam` call of a launch file
ASK_THREADS = 8  # nodes are asked to end side by side
OFFER_AGE = 1.0  # s, wall, after a node's start, when it has advertised what it offers
REASON = "replaced by another configuration"

STABLE, CHANGING, RECOVERING, FAILED = "STABLE", "CHANGING", "RECOVERING", "FAILED"  # LauncherState.msg


class LauncherError(Exception):
    """A change can't be made; the message says why, in one line."""


@dataclass(frozen=True)
class Options:
    """What the launcher is told at its start; times in s, wall.

    Attributes:
        mark: names this launcher and its master, in the environment of all that it starts.
        run_id: of the roslaunch run, names the folder of logs.
        shutdown_timeout: for a node to end after it was asked to over XML-RPC; then comes SIGINT.
        sigint_timeout: to end after SIGINT; then comes SIGKILL.
        standby: whether a warm process waits for the next variant of every Python node.
        policy: when nodes that die are started again.
    """

    mark: str
    run_id: str = ""
    shutdown_timeout: float = 2.0
    sigint_timeout: float = 2.0
    standby: bool = False
    policy: RestartPolicy = field(default_factory=RestartPolicy)


@dataclass
class _Node:
    """A node that should run."""

    description: NodeDescription
    process: Process | None = None
    restart_at: float | None = None  # time.monotonic(), where it died
    offers: bool | None = None  # whether it has topics or services of its own; None: not looked at yet
    finished: bool = False  # it had something to do once, and has done it


class ParameterMemory:
    """What stood on the parameter server before configurations wrote over it."""

    def __init__(self) -> None:
        self._before: dict[str, Any] = {}
        self._absent: set[str] = set()

    def unknown(self, wanted: Mapping[str, Any]) -> list[str]:
        """Return the parameters of which `remember` has to be told before they are set."""
        return [name for name in wanted if name not in self._before and name not in self._absent]

    def remember(self, asked: Iterable[str], found: Mapping[str, Any]) -> None:
        """Take in what parameters had as values; those not found were not set."""
        for name in asked:
            if name in found:
                self._before[name] = found[name]
            else:
                self._absent.add(name)

    def transition(self, wanted: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
        """Return what to set and what to delete, so that nothing is left of other configurations."""
        restored = {name: value for name, value in self._before.items() if name not in wanted}
        return {**restored, **wanted}, sorted(self._absent - set(wanted))


class Launcher:
    """The nodes of one configuration, and the processes that stand by for the next one."""

    def __init__(self, options: Options, changed: Callable[[], None], log: Callable[[str], None]) -> None:
        """Start clean: nothing runs, and what an earlier launcher of the same mark left behind is killed.

        Args:
            options: see there.
            changed: called after every change of what can be read here.
            log: takes a line for the operator.
        """
        self.configuration = ""
        self.state = STABLE
        self.message = ""
        self.changes = 0  # so far
        self._options = options
        self._changed = changed
        self._log = log
        self._nodes: dict[str, _Node] = {}
        self._standby: dict[tuple[Any, ...], Process] = {}
        self._parameters = ParameterMemory()
        self._supervisor = Supervisor(options.policy)
        for pid in processes.kill_marked(options.mark):
            log(f"killed process {pid}, which an earlier launcher had left behind")
        self._reaper = processes.start_reaper(options.mark)

    # -- what runs ------------------------------------------------------------------------------------------------

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of the nodes that should run; those that have done their work are none of them."""
        return tuple(name for name, node in self._nodes.items() if not node.finished)

    @property
    def dead(self) -> tuple[str, ...]:
        """Names of those that don't."""
        return tuple(name for name, node in self._nodes.items() if node.process is None and not node.finished)

    def pidfds(self) -> dict[int, str]:
        """Return what becomes readable when a node ends: file descriptor -> node."""
        return {node.process.pidfd: name for name, node in self._nodes.items() if node.process is not None}

    def next_due(self) -> float | None:
        """When `look_after` has something to do at the latest, time.monotonic()."""
        return min((node.restart_at for node in self._nodes.values() if node.restart_at is not None), default=None)

    # -- changes --------------------------------------------------------------------------------------------------

    def change(self, configuration: str, launch_file: str, args: list[str], start: list[str]) -> dict[str, float]:
        """Go over to a configuration: nodes that it has not end, those in `start` are started, others run on.

        Nodes are looked up before anything is touched. New processes do their imports while old ones end, and begin
        when those are gone.

        Returns:
            Durations of the phases, s.

        Raises:
            LauncherError: it can't be done; nodes that were to be stopped may have been, started ones are stopped.
        """
        phases: dict[str, float] = {}
        began = time.monotonic()
        self.changes += 1
        if not configuration:
            self.stop_all()
            return {"stop": time.monotonic() - began}
        launch, commands = self._look_up(launch_file, args, start)
        self.state, self.message = CHANGING, ""
        self._changed()
        leaving = [name for name in self._nodes if name in start or name not in launch.system.nodes]
        self._ask_to_end(leaving)
        prepared: dict[str, Process] = {}
        try:
            for name, command in commands.items():
                process = self._take_standby(command) or processes.prepare(command)
                if process:
                    prepared[name] = process
            phases["prepare"] = time.monotonic() - began
            self._run_commands(launch)
            self._set_parameters(launch)
            self._end(leaving, forget=[name for name in leaving if name not in start])
            phases["stop"] = time.monotonic() - began - phases["prepare"]
            self._adopt(configuration, launch.system, start)
            self._changed()
            for name, command in commands.items():
                self._begin(self._nodes[name], command, prepared.pop(name, None))
        except (MasterError, StartError, OSError, subprocess.SubprocessError) as error:
            self._end([name for name in start if name in self._nodes])
            for name in start:
                self._nodes.pop(name, None)
            self.state = STABLE
            self._changed()
            raise LauncherError(" ".join(str(error).split())) from error
        finally:
            for process in prepared.values():
                process.close()
        phases["start"] = time.monotonic() - began - phases["prepare"] - phases["stop"]
        self.state = STABLE
        self._changed()
        return phases

    def stop_all(self, gently: bool = True) -> None:
        """Stop what runs, and what stands by.

        Args:
            gently: ask the nodes first; else, where the master is gone and does not know them, begin with SIGINT.
        """
        self.state = CHANGING
        if gently:
            self._ask_to_end(list(self._nodes))
        self._end(list(self._nodes), forget=list(self._nodes) if gently else (), patience=gently)
        for process in self._standby.values():
            process.close()
        self._nodes, self._standby, self.configuration, self.state = {}, {}, "", STABLE
        self._supervisor.reset()
        self._changed()

    def close(self, gently: bool = True) -> None:
        """Stop everything; the launcher ends."""
        self.stop_all(gently)
        self._reaper.kill()
        self._reaper.wait()
        processes.kill_marked(self._options.mark)

    # -- supervision ----------------------------------------------------------------------------------------------

    def look_after(self) -> None:
        """Take in what nodes ended, and start again those that are due."""
        now = time.monotonic()
        self._see_what_nodes_offer(now)
        for name, node in self._nodes.items():
            if node.process is not None and node.process.status is not None:
                self._died(name, node, now)
                if self.state == FAILED:
                    return
        for name, node in list(self._nodes.items()):
            if node.restart_at is not None and now >= node.restart_at:
                node.restart_at = None
                self._restart(name, node)
        if self.state == RECOVERING and not self.dead:
            self.state = STABLE
            self._changed()

    def stand_by(self) -> None:
        """Have one warm process for each kind of Python node that runs, and none for others."""
        if not self._options.standby or self.state != STABLE:
            return
        wanted = {}
        for node in self._nodes.values():
            command = self._command(node.description)
            if command.interpreter:
                wanted[_kind(command)] = command
        for kind, process in list(self._standby.items()):
            if kind not in wanted or process.status is not None:
                self._standby.pop(kind).close()
        for kind, command in wanted.items():
            if kind not in self._standby and (warm := processes.prepare(command)):
                self._standby[kind] = warm

    def _see_what_nodes_offer(self, now: float) -> None:
        """Tell nodes that serve from those that do something once: the latter may end."""
        new = [
            name
            for name, node in self._nodes.items()
            if node.offers is None and node.process is not None and now - node.process.started > OFFER_AGE
        ]
        for name in new:
            try:
                own = {topic for topic in advertised([name]) if not topic.startswith((f"{name}/get_logg", "/rosout"))}
            except MasterError:
                return
            self._nodes[name].offers = bool(own - {f"{name}/set_logger_level"})

    def _died(self, name: str, node: _Node, now: float) -> None:
        assert node.process is not None  # noqa: S101
        status, age = node.process.status, now - node.process.started
        node.process.close()
        node.process = None
        if status == 0 and not node.offers and not node.description.respawn:
            node.finished = True
            self._log(f"node {name} has finished, {age:.1f} s after its start")
            self._changed()
            return
        how = f"by signal {-status}" if status is not None and status < 0 else f"with status {status}"
        self.message = f"node {name} ended {how}, {age:.1f} s after its start"
        node.restart_at = self._supervisor.died(name, now)
        if node.restart_at is None:
            policy = self._options.policy
            deaths = f"{policy.intensity + 1} deaths in {policy.period:g} s"
            self.message = f"{self.message}; {deaths} are too many: {self.configuration} is stopped"
            self._log(self.message)
            self._give_up()
        else:
            self.state = RECOVERING
            self._log(f"{self.message}: starting it again in {node.restart_at - now:.1f} s")
        self._changed()

    def _give_up(self) -> None:
        self._ask_to_end(list(self._nodes))
        self._end(list(self._nodes), forget=list(self._nodes))
        for node in self._nodes.values():
            node.restart_at = None
        self.state = FAILED

    def _restart(self, name: str, node: _Node) -> None:
        try:
            command = self._command(node.description)
            self._begin(node, command, self._take_standby(command))
        except (LaunchFileError, StartError, OSError) as error:
            self.message = f"node {name} can't be started again: {' '.join(str(error).split())}"
            self._log(self.message)
            node.restart_at = self._supervisor.died(name, time.monotonic())
            if node.restart_at is None:
                self._give_up()
        self._changed()

    # -- steps ----------------------------------------------------------------------------------------------------

    def _look_up(self, launch_file: str, args: list[str], start: list[str]) -> tuple[LaunchFile, dict[str, Command]]:
        try:
            launch = read_launch_file(launch_file, args)
            unknown = [name for name in start if name not in launch.system.nodes]
            if unknown:
                raise LauncherError(f"{launch_file} starts no node {', '.join(unknown)}")
            return launch, {name: self._command(launch.system.nodes[name]) for name in start}
        except LaunchFileError as error:
            raise LauncherError(str(error)) from error

    def _command(self, node: NodeDescription) -> Command:
        words, prefixed = command_line(node)
        folder, log = self._log_folder(), None
        file_name = node.name.strip("/").replace("/", "-")
        if folder:
            words.append(f"__log:={folder}/{file_name}.log")
            log = f"{folder}/{file_name}-stdout.log" if node.output != "screen" else None
        cwd = {"node": os.path.dirname(words[prefixed]), "cwd": os.getcwd()}.get(node.cwd or "", rospkg.get_ros_home())
        environment = {**os.environ, processes.MARK: self._options.mark}
        return Command(tuple(words), cwd, process_environment(node, environment), log, prefixed=bool(prefixed))

    def _log_folder(self) -> str:
        folder = os.path.join(rospkg.get_log_dir(), self._options.run_id)
        try:
            os.makedirs(folder, exist_ok=True)
        except OSError as error:
            self._log(f"nodes run without logs: {folder}: {error.strerror or error}")
            return ""
        return folder

    def _run_commands(self, launch: LaunchFile) -> None:
        for command in launch.commands:
            subprocess.run(["/usr/bin/env", *command], check=True, timeout=COMMAND_TIMEOUT, stdout=subprocess.DEVNULL)

    def _set_parameters(self, launch: LaunchFile) -> None:
        wanted = launch.system.all_parameters()
        asked = self._parameters.unknown(wanted)
        self._parameters.remember(asked, get_parameters(asked))
        values, gone = self._parameters.transition(wanted)
        set_parameters(values, delete=[*launch.clear, *gone])

    def _adopt(self, configuration: str, system: SystemDescription, start: list[str]) -> None:
        """Take on the configuration's nodes: those to start, and those that run already."""
        if configuration != self.configuration:
            self._supervisor.reset()
        kept = {name: node for name, node in self._nodes.items() if name in system.nodes and name not in start}
        self._nodes = {
            name: replace(kept[name], description=description) if name in kept else _Node(description)
            for name, description in system.nodes.items()
            if name in kept or name in start
        }
        self.configuration, self.message = configuration, ""

    def _begin(self, node: _Node, command: Command, prepared: Process | None) -> None:
        if prepared is None:
            node.process = processes.start(command)
        else:
            node.process = prepared
            prepared.begin(command)
        node.offers, node.finished = None, False

    def _take_standby(self, command: Command) -> Process | None:
        process = self._standby.pop(_kind(command), None)
        if process is not None and process.status is not None:
            process.close()
            return None
        return process

    def _ask_to_end(self, names: list[str]) -> None:
        """Ask nodes over their own API, side by side: a hung one must not keep the others waiting."""
        alive = [(name, node.process) for name in names if (node := self._nodes[name]).process is not None]
        if not alive:
            return
        pool = ThreadPoolExecutor(ASK_THREADS, thread_name_prefix="ask to end")
        for name, process in alive:
            pool.submit(_ask_to_end, name, process)
        pool.shutdown(wait=False)

    def _end(self, names: list[str], forget: Iterable[str] = (), patience: bool = True) -> None:
        """Wait until nodes that were asked to end are gone; escalate where they are not, or without patience."""
        leaving = {name: node.process for name in names if (node := self._nodes[name]).process is not None}
        alive = [process for process in leaving.values() if process is not None]
        if not processes.wait_for_ends(alive, self._options.shutdown_timeout if patience else 0.0):
            for process in alive:
                if process.status is None:
                    process.signal(signal.SIGINT)
            processes.wait_for_ends(alive, self._options.sigint_timeout)
        for name, process in leaving.items():
            if process is None:
                continue
            if process.status is None:
                self._log(f"node {name} (process {process.pid}) does not end by itself: killing it")
            process.close()
            self._nodes[name].process = None
        for name in forget:
            try:
                forget_node(name)
            except MasterError as error:
                self._log(f"node {name} may still be listed: {error}")


def _ask_to_end(name: str, process: Process) -> None:
    if not NodeApi.request_shutdown(name, REASON) and process.status is None:
        process.signal(signal.SIGINT)  # it is not registered yet, or does not listen


def _kind(command: Command) -> tuple[Any, ...]:
    """What a warm process must have in common with the command whose role it takes."""
    return (command.words[0], command.interpreter, tuple(sorted(command.environment.items())))
