"""Who answers under the name of a node: the launcher's own process, or somebody else's.

Two nodes of one name can't run at once: the master tells the older one to end. Where somebody else starts a node again
and again under a name that the launcher has a node of, each start ends the other one's node.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from urllib.parse import urlsplit

SCRIPT_AGE = 2.0  # s, wall, after which a shell script that starts a ROS node has started it
LONGEST_COMMAND = 160  # characters of a command in a line for the operator


class Owner(enum.Enum):
    """Whose process answers under a node's name."""

    NOBODY = "nobody"  # nobody answers
    LAUNCHER = "launcher"
    FOREIGN = "foreign"  # it is not the launcher's
    UNKNOWN = "unknown"  # it runs on another host, or in a container: it can't be compared


@dataclass(frozen=True)
class ProcessFacts:
    """One process of this host.

    Attributes:
        pid: its id.
        command: its command line.
        mark: the launcher's mark in its environment; empty: it has none, or may not be read.
        launcher: names the process of the launcher that started it; empty in the same cases.
    """

    pid: int
    command: str = ""
    mark: str = ""
    launcher: str = ""


@dataclass(frozen=True)
class Answer:
    """What is known of who answers under a node's name.

    Attributes:
        answers: whether anybody does.
        is_comparable: whether it is a process of this host, with the id that it says.
        lineage: that process, its parent, and so on, at least up to the first one with a mark.
        address: of the node that answers, as the master knows it.
    """

    answers: bool = False
    is_comparable: bool = False
    lineage: tuple[ProcessFacts, ...] = ()
    address: str = ""

    def owner(self, mark: str) -> Owner:
        """Return whose process it is.

        Args:
            mark: of the launcher that should run the node. A child or grandchild of its process counts, because a
                launch-prefix or a shell script may be in between.
        """
        if not self.answers:
            return Owner.NOBODY
        if any(same_launcher(process.mark, mark) for process in self.lineage):
            return Owner.LAUNCHER
        return Owner.FOREIGN if self.is_comparable and self.lineage else Owner.UNKNOWN

    def is_up(self, mark: str) -> bool:
        """Tell whether a node answers that is not known to be somebody else's."""
        return self.owner(mark) in (Owner.LAUNCHER, Owner.UNKNOWN)

    def may_be_of(self, mark: str, launcher: str) -> bool:
        """Tell whether a node is up that may be of one process of the launcher, and not of its successor.

        Args:
            mark: of the launcher.
            launcher: names its process.
        """
        return self.is_up(mark) and all(process.launcher in ("", launcher) for process in self.lineage)

    def conflict(self, mark: str) -> str:
        """Return who has taken the node's name, with the remedy, in one line; empty where nobody has."""
        if self.owner(mark) is not Owner.FOREIGN:
            return ""
        process, starter = self.lineage[0], self.starter
        line = f"its name is taken by process {process.pid} ({_short(process.command)})"
        if starter:
            return (
                f"{line}, which process {starter.pid} ({_short(starter.command)}) starts, too: remove the node from "
                'that launch file, or its respawn="true"'
            )
        return f"{line}: end that process, and remove the node from what starts it"

    @property
    def starter(self) -> ProcessFacts | None:
        """The roslaunch that starts it, maybe again and again; None: there is none, as far as is known."""
        return next((parent for parent in self.lineage[1:] if "roslaunch" in parent.command), None)

    def successor(self, mark: str) -> str:
        """Return who has taken the name of a node whose own process has ended; empty where nobody has.

        Whoever answers under it is somebody else, also one that can't be compared.
        """
        if self.owner(mark) is Owner.UNKNOWN:
            return f"its name is taken by the node at {self.address}: end that node, or give it another name"
        return self.conflict(mark)

    def is_own(self, mark: str, conflict: str) -> bool:
        """Tell whether the launcher's node answers under its name again, although somebody else had taken it.

        Args:
            mark: of the launcher.
            conflict: who had taken it.
        """
        host = urlsplit(self.address).hostname or ""
        is_same_host = f"//{host}:" in conflict
        return self.owner(mark) is Owner.LAUNCHER or (self.owner(mark) is Owner.UNKNOWN and not is_same_host)


@dataclass(frozen=True)
class ScriptProcess:
    """The process of a node whose executable is a shell script.

    Attributes:
        is_shell: whether the shell still runs it; otherwise the script has made way for another program.
        age: time since its start, s, wall.
        has_sockets: whether it or a child of it has a socket, as each ROS node has.
    """

    is_shell: bool
    age: float
    has_sockets: bool

    def is_at_work(self) -> bool:
        """Tell whether the script counts as ready, though nobody answers under its name: it starts no ROS node."""
        return self.is_shell and not self.has_sockets and self.age >= SCRIPT_AGE


def same_launcher(one: str, other: str) -> bool:
    """Tell whether two marks are of one launcher: the master's host may be written in two ways, its port may not."""
    return bool(one) and _key(one) == _key(other)


def _key(mark: str) -> tuple[str, str]:
    parts = urlsplit(mark)
    return parts.netloc.rpartition(":")[2], parts.path.strip("/")


def _short(command: str) -> str:
    return command if len(command) <= LONGEST_COMMAND else f"{command[: LONGEST_COMMAND - 3]}..."
