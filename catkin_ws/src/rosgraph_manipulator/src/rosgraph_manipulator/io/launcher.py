"""Owns the nodes of the configuration that runs: changes them, and starts again those that die.

The decisions are in `launching`. For one thread only: the main thread of the node rosgraph_launcher.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable

from node_kit.io.xml_rpc import CallError

from rosgraph_manipulator.io.launch_files import LaunchFile, LaunchFileError, read_launch_file
from rosgraph_manipulator.io.master import advertised, get_parameters, set_parameters
from rosgraph_manipulator.io.node_commands import NodeCommands
from rosgraph_manipulator.io.node_processes import NodeProcesses
from rosgraph_manipulator.io.processes import Command, Process, StartError
from rosgraph_manipulator.launching.managed_nodes import Ending, ManagedNodes, Verdict
from rosgraph_manipulator.launching.options import LauncherOptions
from rosgraph_manipulator.launching.parameters import OverwrittenParameters
from rosgraph_manipulator.launching.report import LauncherReport

COMMAND_TIMEOUT = 5.0  # s, wall, for a `rosparam` call of a launch file


class LauncherError(Exception):
    """A change can't be made; the message says why, in one line."""


class Launcher:
    """The nodes of one configuration, and the warm processes that wait for the next one."""

    def __init__(
        self, options: LauncherOptions, changed: Callable[[LauncherReport], None], log: Callable[[str], None]
    ) -> None:
        """Begin without nodes.

        Args:
            options: the launcher's parameters.
            changed: is called with each new report.
            log: takes a line for the operator.
        """
        self._options = options
        self._changed = changed
        self._log = log
        self._nodes = ManagedNodes(options.policy)
        self._parameters = OverwrittenParameters()
        self._commands = NodeCommands(options.mark, options.run_id, log)
        self._processes = NodeProcesses(options, log)
        self._report()

    @property
    def changes(self) -> int:
        """Number of the changes that were asked for."""
        return self._nodes.changes

    def pidfds(self) -> dict[int, str]:
        """Return the file descriptors that become readable when a node ends, with the node's name."""
        return self._processes.pidfds()

    def next_restart(self) -> float | None:
        """Return the time (time.monotonic()) of the next restart; None where no node waits for one."""
        return self._nodes.next_restart()

    # -- changes --------------------------------------------------------------------------------------------------

    def change(self, configuration: str, launch_file: str, args: list[str], start: list[str]) -> dict[str, float]:
        """Change to a configuration: end the nodes that it lacks, start those in `start`, keep all others.

        The launch file is read, and its executables are found, before anything is touched. The new processes do
        their imports while the old nodes end.

        Args:
            configuration: its name; empty: stop all nodes.
            launch_file: its launch file.
            args: arguments of the launch file, `NAME:=VALUE`.
            start: the nodes to start; those that run already are restarted.

        Returns:
            The durations of the phases, s.

        Raises:
            LauncherError: the change failed. Nodes may have been stopped; none of those in `start` runs.
        """
        began = time.monotonic()
        self._nodes.ask_for_change()
        if not configuration:
            self.stop_all()
            return {"stop": time.monotonic() - began}
        launch, commands = self._look_up(launch_file, args, start)
        leaving = self._nodes.begin_change(launch.system, start)
        self._report()
        self._processes.ask_to_end(leaving)
        prepared: dict[str, Process] = {}
        try:
            for name, command in commands.items():
                process = self._processes.prepare(command)
                if process:
                    prepared[name] = process
            prepared_at = time.monotonic()
            self._run_commands(launch)
            self._set_parameters(launch)
            self._end(leaving, forget=[name for name in leaving if name not in start])
            stopped_at = time.monotonic()
            self._nodes.adopt(configuration, launch.system, start)
            self._report()
            for name, command in commands.items():
                self._nodes.started(name, self._processes.begin(name, command, prepared.pop(name, None)))
        except (CallError, StartError, OSError, subprocess.SubprocessError) as error:
            self._end(start)
            self._nodes.end_change(time.monotonic(), failed_to_start=start)
            self._report()
            raise LauncherError(_one_line(error)) from error
        finally:
            for process in prepared.values():
                process.close()
        ended_at = time.monotonic()
        self._nodes.end_change(ended_at)
        self._report()
        return {"prepare": prepared_at - began, "stop": stopped_at - prepared_at, "start": ended_at - stopped_at}

    def stop_all(self, gently: bool = True) -> None:
        """Stop all nodes and all warm processes.

        Args:
            gently: ask the nodes first. Without a master they can't be asked; then begin with SIGINT.
        """
        self._nodes.begin_stop()
        names = self._nodes.names
        if gently:
            self._processes.ask_to_end(names)
        self._processes.end(names, forget=names if gently else (), patience=gently)
        self._processes.end_standby()
        self._nodes.end_stop(time.monotonic())
        self._report()

    def close(self, gently: bool = True) -> None:
        """Stop everything, because the launcher ends."""
        self.stop_all(gently)
        self._processes.close()

    # -- supervision ----------------------------------------------------------------------------------------------

    def look_after(self) -> None:
        """Deal with the nodes that have ended, and start again those that are due."""
        now = time.monotonic()
        self._inspect(now)
        for name, status in self._processes.take_ended().items():
            if self._follow(self._nodes.ended(name, status, now)) is Verdict.GIVE_UP:
                return
        for name in self._nodes.to_restart(now):
            if self._restart(name) is Verdict.GIVE_UP:
                return
        if self._nodes.recovered():
            self._report()

    def stand_by(self) -> None:
        """Keep a warm process for each kind of Python node that runs, where that is wanted and no change is recent."""
        if self._options.standby and self._nodes.may_stand_by(time.monotonic()):
            self._processes.stand_by(
                [self._commands.command(self._nodes.description(name)) for name in self._nodes.names]
            )

    def _inspect(self, now: float) -> None:
        for name in self._nodes.to_inspect(now):
            try:
                self._nodes.inspected(name, advertised([name]))
            except CallError:
                return

    def _follow(self, ending: Ending) -> Verdict:
        """Do what follows from the end of a node, except for the restart, which is not due yet."""
        self._log(ending.text)
        if ending.verdict is Verdict.GIVE_UP:
            names = self._nodes.names
            self._processes.ask_to_end(names)
            self._end(names, forget=names)
            self._nodes.given_up()
        self._report()
        return ending.verdict

    def _restart(self, name: str) -> Verdict:
        try:
            command = self._commands.command(self._nodes.description(name))
            self._nodes.started(name, self._processes.begin_again(name, command))
        except (LaunchFileError, StartError, OSError) as error:
            return self._follow(self._nodes.failed_to_restart(name, _one_line(error), time.monotonic()))
        self._report()
        return Verdict.RESTART

    # -- steps ----------------------------------------------------------------------------------------------------

    def _look_up(self, launch_file: str, args: list[str], start: list[str]) -> tuple[LaunchFile, dict[str, Command]]:
        try:
            launch = read_launch_file(launch_file, args)
            reason = self._nodes.refusal(launch.system, start)
            if reason:
                raise LauncherError(f"{launch_file} {reason}")
            return launch, {name: self._commands.command(launch.system.nodes[name]) for name in start}
        except LaunchFileError as error:
            raise LauncherError(str(error)) from error

    def _run_commands(self, launch: LaunchFile) -> None:
        for command in launch.commands:
            subprocess.run(["/usr/bin/env", *command], check=True, timeout=COMMAND_TIMEOUT, stdout=subprocess.DEVNULL)

    def _set_parameters(self, launch: LaunchFile) -> None:
        wanted = launch.system.all_parameters()
        asked = self._parameters.unknown(wanted)
        self._parameters.remember(asked, get_parameters(asked))
        values, gone = self._parameters.transition(wanted)
        set_parameters(values, delete=[*launch.clear, *gone])

    def _end(self, names: list[str] | tuple[str, ...], forget: list[str] | tuple[str, ...] = ()) -> None:
        self._processes.end(names, forget)
        for name in names:
            self._nodes.stopped(name)

    def _report(self) -> None:
        self._changed(self._nodes.report())


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
