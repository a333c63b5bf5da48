"""Looks after the nodes of the functions that run: changes them, and starts again those that die.

What is reached outside is handed over: processes, commands, names and the clock.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, Protocol

from node_kit.io.xml_rpc import CallError

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.command_lines import CommandLineError
from rosgraph_launcher.io.processes import StartError
from rosgraph_launcher.launching.managed_nodes import ManagedNodes
from rosgraph_launcher.launching.nodelets import unloading
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_launcher.launching.restarts import Ending, Verdict

UNLOAD_TIMEOUT = 2.0  # s, for a nodelet's manager to answer; it takes about 0.1
STANDBY_PERIOD = 1.0  # s, from one warm process to the next one, so that their imports take no more than one core


class LauncherError(Exception):
    """A change can't be made; the message says why, in one line."""


class Commands(Protocol):
    """Turns descriptions of nodes into commands."""

    def command(self, node: NodeDescription) -> Any:
        """Return the command that starts a node; raise CommandLineError where there is none."""


class Processes(Protocol):
    """The processes of nodes, by the nodes' names. A start raises StartError where the system refuses it."""

    def take_ended(self) -> dict[str, int]:
        """Return the exit status of each node that has ended by itself, and forget its process."""

    def prepare(self, command: Any) -> Any:
        """Return a process that does imports and then waits; None where that makes no sense."""

    def begin(self, name: str, command: Any, prepared: Any) -> float:
        """Begin a node, in a prepared process where there is one; return the time of its start."""

    def discard(self, prepared: Any) -> None:
        """End a process that nothing is begun in."""

    def begin_again(self, name: str, command: Any) -> float:
        """Begin a node that died; return the time of its start."""

    def run(self, command: Any, timeout: float) -> None:
        """Run a command to its end, or for `timeout` (s)."""

    def ask_to_end(self, names: Iterable[str]) -> None:
        """Ask nodes to end, without waiting."""

    def end(self, names: Iterable[str], forget: Collection[str] = (), patience: bool = True) -> None:
        """Wait until nodes that were asked to end are gone, and end those that stay."""

    def expect(self, commands: Iterable[Any]) -> None:
        """Note by which commands nodes may be begun that do not run now."""

    def stand_by(self, names: Iterable[str], may_start: bool) -> bool:
        """End the warm processes that serve none of these nodes, and start one that lacks; return whether one was."""

    def end_standby(self) -> None:
        """End all warm processes."""

    def close(self) -> None:
        """Kill what is left of all that was started."""


class NodeNames(Protocol):
    """What answers under the names of nodes."""

    def successor(self, name: str) -> str:
        """Return who has taken the name of a node whose own process has ended; empty where nobody has."""

    def is_own(self, name: str, conflict: str) -> bool:
        """Tell whether the launcher's own node answers under a name again that somebody else had taken."""

    def advertised(self, name: str) -> set[str]:
        """Return the topics and services of a node; raise CallError where the master does not answer."""


class Supervisor:
    """The nodes of all functions, and the warm processes that wait for the next ones. For one thread only."""

    def __init__(
        self,
        options: LauncherOptions,
        changed: Callable[[tuple[LauncherReport, ...]], None],
        log: Callable[[str], None],
        commands: Commands,
        processes: Processes,
        names: NodeNames,
        clock: Callable[[], float],
    ) -> None:
        """Begin without nodes.

        Args:
            options: the launcher's parameters.
            changed: is called with the reports of all functions, whenever one differs.
            log: takes a line for the operator.
            commands: turns descriptions into commands.
            processes: those of the nodes.
            names: tells what answers under the names of nodes.
            clock: returns s of one clock that never goes back.
        """
        self._options = options
        self._changed = changed
        self._log = log
        self._nodes = ManagedNodes(options.policy)
        self._commands, self._processes, self._names, self._clock = commands, processes, names, clock
        self._next_standby = 0.0
        self._report()

    @property
    def changes(self) -> int:
        """Number of the changes that were asked for."""
        return self._nodes.changes

    def next_restart(self) -> float | None:
        """Return the time  of the next restart; None where no node waits for one."""
        return self._nodes.next_restart()

    def find(self, name: str) -> NodeDescription | None:
        """Return, in any thread, how a node is started; None: there is no such node."""
        return self._nodes.find(name)

    # -- changes --------------------------------------------------------------------------------------------------

    def change(
        self,
        function: str,
        configuration: str,
        nodes: Mapping[str, NodeDescription],
        stop: Collection[str],
        start: Sequence[str],
    ) -> dict[str, float]:
        """Change the nodes of a function: end those in `stop`, start those in `start`, keep all others.

        The executables are found before anything is touched. The new processes do their imports while the old nodes
        end. A node that another function needs does not end, unless it is in `start` too.

        Args:
            function: its name.
            configuration: the name of its configuration; empty: end all nodes that no other function needs.
            nodes: all nodes of the configuration, by full name.
            stop: the nodes to end.
            start: the nodes to start; those that run already are restarted.

        Returns:
            The durations of the phases, s.

        Raises:
            LauncherError: the change failed. Nodes may have been stopped; none of those in `start` runs.
        """
        began = self._clock()
        self._nodes.ask_for_change(function)
        if not configuration:
            try:
                self._release(function)
            except Exception as error:
                raise LauncherError(_told(error)) from error
            return {"stop": self._clock() - began}
        commands = self._look_up(nodes, start)
        idle = [name for name in start if not self._nodes.runs(name)]
        taken = {name: self._names.successor(name) for name in idle}
        leaving = self._nodes.begin_change(function, stop, start)
        prepared: dict[str, Any] = {}
        try:
            self._report()
            self._processes.ask_to_end(leaving)
            for name, command in commands.items():
                process = self._processes.prepare(command)
                if process:
                    prepared[name] = process
            prepared_at = self._clock()
            self._end(leaving, forget=[name for name in leaving if name not in start])
            stopped_at = self._clock()
            self._nodes.adopt(function, configuration, nodes, stop, start, stopped_at, taken)
            self._report()
            for name, command in commands.items():
                self._nodes.started(name, self._processes.begin(name, command, prepared.pop(name, None)))
        except Exception as error:  # whatever it is, the function must not stay CHANGING
            try:
                self._end(start)
            finally:
                self._nodes.end_change(function, self._clock(), failed_to_start=start)
                self._report()
            raise LauncherError(_told(error)) from error
        finally:
            for process in prepared.values():
                self._processes.discard(process)
        ended_at = self._clock()
        self._nodes.end_change(function, ended_at)
        self._report()
        return {"prepare": prepared_at - began, "stop": stopped_at - prepared_at, "start": ended_at - stopped_at}

    def close(self, gently: bool = True) -> None:
        """Stop everything, because the launcher ends.

        Args:
            gently: ask the nodes first. Without a master they can't be asked; then begin with SIGINT.
        """
        names = self._nodes.names
        if gently:
            self._processes.ask_to_end(names)
        self._processes.end(names, forget=names if gently else (), patience=gently)
        self._processes.end_standby()
        self._processes.close()

    def _release(self, function: str) -> None:
        leaving = self._nodes.begin_release(function)
        try:
            self._report()
            self._processes.ask_to_end(leaving)
            self._end(leaving, forget=leaving)
        finally:
            self._nodes.end_release(function, self._clock())
            self._report()
        self._processes.stand_by(self._nodes.needed, may_start=False)

    # -- supervision ----------------------------------------------------------------------------------------------

    def look_after(self) -> None:
        """Deal with the nodes that have ended, and start again those that are due."""
        now = self._clock()
        self._inspect(self._nodes.to_inspect(now), now)
        stopped: set[str] = set()
        for name, status in self._processes.take_ended().items():
            if name not in stopped:
                if status == 0:  # the master may still know what it has advertised since the last look
                    self._inspect([name], now)
                conflict = self._names.successor(name)
                stopped.update(self._follow(self._nodes.ended(name, status, now, conflict)))
        for name in self._nodes.to_restart(now):
            if name not in stopped:
                stopped.update(self._restart(name))
        for name, conflict in self._nodes.contested.items():
            self._nodes.seen(name, self._names.is_own(name, conflict), now)
        for name in self._nodes.hanging(now):
            if name not in stopped:
                self._end([name], patience=False)
                stopped.update(self._follow(self._nodes.hung(name, now)))
        if self._nodes.recovered():
            self._report()

    def stand_by(self) -> None:
        """Keep a warm process for each Python node that runs or is expected, where that is wanted.

        None is started right after a change.
        """
        now = self._clock()
        if self._options.standby:
            may_start = now >= self._next_standby and self._nodes.may_stand_by(now)
            if self._processes.stand_by(self._nodes.needed, may_start):
                self._next_standby = now + STANDBY_PERIOD

    def expect(self, nodes: Iterable[NodeDescription]) -> None:
        """Note which nodes may be started next beside those that run; one without an executable here is left out."""
        commands = []
        for node in nodes:
            with contextlib.suppress(CommandLineError):  # whoever deploys it will be told
                commands.append(self._commands.command(node))
        self._processes.expect(commands)

    def _inspect(self, names: Iterable[str], now: float) -> None:
        for name in names:
            try:
                self._nodes.inspected(name, self._names.advertised(name), now)
            except CallError:
                return

    def _follow(self, ending: Ending) -> tuple[str, ...]:
        """Do what follows from the end of a node, except for the restart, which is not due yet.

        Returns:
            The nodes that were stopped.
        """
        self._log(ending.text)
        if ending.verdict is Verdict.GIVE_UP:
            self._processes.ask_to_end(ending.stopped)
            self._end(ending.stopped, forget=ending.stopped)
            self._processes.stand_by(self._nodes.needed, may_start=False)
        elif ending.stopped:
            self._end(ending.stopped, patience=False)
        self._report()
        return ending.stopped

    def _restart(self, name: str) -> tuple[str, ...]:
        try:
            node = self._nodes.description(name)
            command = self._commands.command(node)
            unload = unloading(node) if self._nodes.has_died(name) else None
            if unload:
                self._processes.run(self._commands.command(unload), UNLOAD_TIMEOUT)
            self._nodes.started(name, self._processes.begin_again(name, command))
        except (CommandLineError, StartError, OSError) as error:
            return self._follow(self._nodes.failed_to_restart(name, _one_line(error), self._clock()))
        self._report()
        return ()

    # -- steps ----------------------------------------------------------------------------------------------------

    def _look_up(self, nodes: Mapping[str, NodeDescription], start: Sequence[str]) -> dict[str, Any]:
        reason = self._nodes.refusal(nodes, start)
        if reason:
            raise LauncherError(f"the configuration {reason}")
        try:
            return {name: self._commands.command(nodes[name]) for name in start}
        except CommandLineError as error:
            raise LauncherError(str(error)) from error

    def _end(self, names: Collection[str], forget: Collection[str] = (), patience: bool = True) -> None:
        self._processes.end(names, forget, patience)
        for name in names:
            self._nodes.stopped(name)

    def _report(self) -> None:
        self._changed(self._nodes.reports())


def _told(error: Exception) -> str:
    """Return what is wrong, in one line, with the class of an error that nobody expects."""
    line = _one_line(error)
    return line if isinstance(error, (CallError, StartError, OSError)) else f"{type(error).__name__}: {line}"


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
