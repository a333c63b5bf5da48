"""The processes of the launcher's nodes: begun, asked to end, killed; and the warm ones that stand by.

For one thread only: the main thread of the node rosgraph_launcher.
"""

from __future__ import annotations

import os
import signal
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from node_kit.io.supervisor import owner_id
from node_kit.io.xml_rpc import CallError, SilentError

from rosgraph_launcher.io import processes
from rosgraph_launcher.io.master import CALL_TIMEOUT, NodeApi, forget_node
from rosgraph_launcher.io.ownership import look_up
from rosgraph_launcher.io.processes import Command, Process, StartError
from rosgraph_launcher.launching.options import LauncherOptions

ASK_THREADS = 8  # nodes are asked to end side by side
REASON = "replaced by another configuration"
HANG_TIMEOUT = CALL_TIMEOUT + 0.5
"""s, wall, after which a node is killed that does not answer the request: 0.5 s after it got SIGINT. Nothing runs in it
that could end it in a good way, and the robot waits."""
FOREIGN = "another user runs it, as with 'sudo' in a launch-prefix, and it may go on: end it as that user"
MOST_LOST_WARM = 3  # after so many warm processes of one kind that ended by themselves, no further one is started


class NodeProcesses:
    """The processes of nodes, by the nodes' names."""

    def __init__(self, options: LauncherOptions, log: Callable[[str], None]) -> None:
        """Begin without processes, and kill those that an earlier launcher of the same mark left behind.

        Args:
            options: the launcher's parameters.
            log: takes a line for the operator.
        """
        self._options = options
        self._log = log
        self._id = owner_id(os.getpid())
        self._running: dict[str, Process] = {}
        self._commands: dict[str, Command] = {}  # by which each node was begun last
        self._hanging: set[str] = set()  # nodes that do not answer the request to end
        self._warm: dict[tuple[Any, ...], Process] = {}
        self._others: tuple[Command, ...] = ()  # of nodes that do not run now
        self._lost_warm: Counter[tuple[Any, ...]] = Counter()
        self._held: list[Process] = []  # killed or not to be killed, but not ended yet
        for pid, _ in processes.kill_marked(options.mark):
            log(f"killed process {pid}, which an earlier launcher had left behind")
        self._reaper = processes.start_reaper(options.mark)

    def pidfds(self) -> dict[int, str]:
        """Return the file descriptors that become readable when a node ends, with the node's name."""
        return {process.pidfd: name for name, process in self._running.items()}

    def take_ended(self) -> dict[str, int]:
        """Return the exit status of each node that has ended by itself, and forget its process."""
        self._held = [process for process in self._held if process.status is None]
        ended = {name: process.status for name, process in self._running.items()}
        statuses = {name: status for name, status in ended.items() if status is not None}
        self._close({name: self._running.pop(name) for name in statuses})
        return statuses

    def prepare(self, command: Command) -> Process | None:
        """Return a process that does imports of a Python node and then waits; None for any other node.

        Raises:
            StartError: the system refuses.
        """
        return self._take_warm(command) or processes.prepare(command)

    def begin(self, name: str, command: Command, prepared: Process | None) -> float:
        """Begin a node, in a prepared process where there is one; return the time of its start (time.monotonic()).

        Raises:
            StartError: the system refuses.
        """
        process = prepared
        if process is not None and process.is_stopped:
            self._log(f"node {name} starts without imports in advance: the process that stood by is stopped")
            self.discard(process)
            process = None
        if process is not None:
            try:
                process.begin()
            except StartError as error:
                self._log(f"node {name} starts without imports in advance: {error}")
                self.discard(process)
                process = None
        if process is None:
            process = processes.start(command)
        self._running[name] = process
        self._hanging.discard(name)
        self._commands[name] = command
        return process.started

    def discard(self, prepared: Process) -> None:
        """End a process that nothing is begun in."""
        self._close({prepared.executable: prepared})

    def begin_again(self, name: str, command: Command) -> float:
        """Begin a node that died, in a warm process where one stands by; return the time of its start.

        Raises:
            StartError: the system refuses.
        """
        return self.begin(name, command, self._take_warm(command))

    def run(self, command: Command, timeout: float) -> None:
        """Run a command to its end, or for `timeout` (s).

        Raises:
            StartError: the system refuses.
        """
        process = processes.start(command)
        processes.wait_for_ends([process], timeout)
        self.discard(process)

    def ask_to_end(self, names: Iterable[str]) -> None:
        """Ask nodes to end over their own API, side by side, so that one that hangs does not delay the others.

        Where the system has no thread for that, they get SIGINT.
        """
        asked = {name: self._running[name] for name in names if name in self._running}
        if not asked:
            return
        pool = ThreadPoolExecutor(ASK_THREADS, thread_name_prefix="ask to end")
        for name, process in asked.items():
            try:
                pool.submit(self._ask_to_end, name, process)
            except RuntimeError as error:
                self._log(f"node {name} is ended by SIGINT: {error}")
                if process.status is None:
                    process.signal(signal.SIGINT)
        pool.shutdown(wait=False)

    def end(self, names: Iterable[str], forget: Collection[str] = (), patience: bool = True) -> None:
        """Wait until nodes that were asked to end are gone. Send SIGINT, then SIGKILL, to those that stay.

        Nodes that hang have less time: those that are stopped none, those that do not answer HANG_TIMEOUT.

        Args:
            names: the nodes.
            forget: nodes that the master shall list no more.
            patience: whether to wait before SIGINT.
        """
        leaving = {name: self._running.pop(name) for name in list(names) if name in self._running}
        self._kill({name: process for name, process in leaving.items() if process.is_stopped}, "is stopped")
        alive = list(leaving.values())
        timeout = self._options.shutdown_timeout if patience else 0.0
        first = min(timeout, HANG_TIMEOUT)
        if not processes.wait_for_ends(alive, first):
            self._kill({name: process for name, process in leaving.items() if name in self._hanging}, "does not answer")
            if not processes.wait_for_ends(alive, timeout - first):
                for process in alive:
                    if process.status is None:
                        process.signal(signal.SIGINT)
                processes.wait_for_ends(alive, self._options.sigint_timeout)
        for name, process in leaving.items():
            if process.status is None:
                self._log(f"node {name} (process {process.pid}) does not end by itself: killing it")
        self._close(leaving)
        for name in forget:
            try:
                forget_node(name)
            except CallError as error:
                self._log(f"node {name} may still be listed: {error}")

    def _ask_to_end(self, name: str, process: Process) -> None:
        """Ask a node to end over its API; by a signal where it does not listen, or somebody else has taken its name."""
        uri = NodeApi.address(name)
        try:
            pid = NodeApi.ask_pid(uri) if uri else None
        except SilentError:
            pid = None
            self._hanging.add(name)
        except CallError:
            pid = None
        is_other = pid is None or (pid != process.pid and not self._is_of(process, name))
        if (is_other or not NodeApi.request_shutdown(name, REASON)) and process.status is None:
            process.signal(signal.SIGINT)

    def _is_of(self, process: Process, name: str) -> bool:
        """Tell whether who answers under the name of a node is, or may be, a child of its process.

        The environment of another user's process, such as after `sudo`, can't be read; its parents can.
        """
        answer = look_up(name)
        is_child = any(one.pid == process.pid for one in answer.lineage)
        return is_child or answer.may_be_of(self._options.mark, self._id)

    def _kill(self, hanging: Mapping[str, Process], why: str) -> None:
        """Kill nodes that hang, if they have not ended."""
        for name, process in hanging.items():
            if process.status is None:
                self._log(f"node {name} (process {process.pid}) {why}: killing it")
                process.signal(signal.SIGKILL)

    def _close(self, leaving: Mapping[str, Process]) -> None:
        """Kill processes, and forget them; those that can't be ended are looked at again until they have ended."""
        held = processes.close_all(list(leaving.values()))
        for name, process in leaving.items():
            if process in held:
                why = FOREIGN if process.is_foreign else "the kernel holds it"
                self._log(f"process {process.pid} ({name}) can't be ended: {why}")
        self._held += held

    # -- standby --------------------------------------------------------------------------------------------------

    def expect(self, commands: Iterable[Command]) -> None:
        """Note by which commands nodes may be begun that do not run now."""
        self._others = tuple(commands)

    def stand_by(self, names: Iterable[str], may_start: bool) -> bool:
        """End the warm processes that serve none of these nodes, and start one for a Python node that lacks it.

        Nodes that do not run, but may be begun, come after these, as many as the options allow. Where nothing runs,
        nothing stands by.

        Returns:
            Whether one was started.
        """
        for kind, process in list(self._warm.items()):
            if process.status is not None:
                self._lost_warm[kind] += 1
                self.discard(self._warm.pop(kind))
        running = list(names)
        commands = (self._commands[name] for name in running if name in self._commands)
        wanted = {_kind(command): command for command in commands if command.is_python}
        most = len(wanted) + self._options.standby_others
        for command in self._others if running else ():
            if command.is_python and len(wanted) < most:
                wanted.setdefault(_kind(command), command)
        for kind in set(self._warm) - set(wanted):
            self.discard(self._warm.pop(kind))
        lacking = [k for k in wanted if k not in self._warm and self._lost_warm[k] < MOST_LOST_WARM]
        return may_start and bool(lacking) and self._prepare_warm(lacking[0], wanted[lacking[0]])

    def end_standby(self) -> None:
        """End all warm processes."""
        for process in self._warm.values():
            self.discard(process)
        self._warm.clear()

    def close(self) -> None:
        """Kill what is left of all that was started; the launcher ends."""
        try:
            processes.kill_marked(self._options.mark, self._id)
        except OSError as error:
            self._log(f"processes of nodes may be left, which end with the launcher: {error}")
            return  # the reaper does it
        self._reaper.kill()
        self._reaper.wait()

    def _prepare_warm(self, kind: tuple[Any, ...], command: Command) -> bool:
        try:
            warm = processes.prepare(command)
        except StartError as error:
            self._lost_warm[kind] += 1
            self._log(f"no process stands by: {error}")
            return False
        if warm is not None:
            self._warm[kind] = warm
        return warm is not None

    def _take_warm(self, command: Command) -> Process | None:
        process = self._warm.pop(_kind(command), None)
        if process is not None and (process.status is not None or process.is_stopped):
            self.discard(process)  # one that is stopped would stand still as the node, too
            return None
        return process


def _kind(command: Command) -> tuple[Any, ...]:
    """Return the command as a key: a warm process has taken arguments, environment and folder from it already."""
    return (command.words, command.cwd, command.log, tuple(sorted(command.environment.items())))
