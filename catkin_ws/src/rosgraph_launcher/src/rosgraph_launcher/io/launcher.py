"""The launcher of this host: `launching.supervision` with real processes, the master and the clock.

For one thread only, the main thread of the node rosgraph_launcher, where nothing else is said.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from rosgraph_launcher.io.master import advertised
from rosgraph_launcher.io.node_commands import NodeCommands
from rosgraph_launcher.io.node_processes import NodeProcesses
from rosgraph_launcher.io.ownership import look_up
from rosgraph_launcher.io.scripts import script_is_at_work
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_launcher.launching.supervision import Supervisor


class Launcher(Supervisor):
    """The nodes of all functions on this host."""

    def __init__(
        self,
        options: LauncherOptions,
        changed: Callable[[tuple[LauncherReport, ...]], None],
        log: Callable[[str], None],
    ) -> None:
        """Begin without nodes.

        Args:
            options: the launcher's parameters.
            changed: is called with the reports of all functions, whenever one differs.
            log: takes a line for the operator.
        """
        commands = NodeCommands(options.mark, options.run_id, log)
        self._real = NodeProcesses(options, log)
        super().__init__(options, changed, log, commands, self._real, _Names(options.mark), time.monotonic)

    def pidfds(self) -> dict[int, str]:
        """Return the file descriptors that become readable when a node ends, with the node's name."""
        return self._real.pidfds()

    def is_up(self, name: str) -> bool:
        """Tell, in any thread, whether a node of the launcher is up."""
        node = self.find(name)
        mark = self._options.mark
        return node is not None and (look_up(name).is_up(mark) or script_is_at_work(node, mark))

    def conflict(self, name: str) -> str:
        """Return, in any thread, who has taken the name of a node; empty where nobody has."""
        return look_up(name).conflict(self._options.mark)


class _Names:
    """What answers under the names of nodes, by the master and the processes of this host."""

    def __init__(self, mark: str) -> None:
        self._mark = mark

    def successor(self, name: str) -> str:
        """Return who has taken the name of a node whose own process has ended; empty where nobody has."""
        return look_up(name).successor(self._mark)

    def is_own(self, name: str, conflict: str) -> bool:
        """Tell whether the launcher's own node answers under a name again that somebody else had taken."""
        return look_up(name).is_own(self._mark, conflict)

    def advertised(self, name: str) -> set[str]:
        """Return the topics and services of a node."""
        return advertised([name])
