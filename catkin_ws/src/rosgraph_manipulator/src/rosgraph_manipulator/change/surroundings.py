"""What the manipulator sees of the running system and does to it; the shell and the simulation provide it.

A call that asks the master or a node raises CallError where there is no answer. Times are wall s of one clock that
never goes back.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Protocol

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.report import LauncherReport

from rosgraph_manipulator.change.tactics import Adjustable
from rosgraph_manipulator.configuration.configurations import Configuration

if TYPE_CHECKING:
    from rosgraph_manipulator.io.launch_files import LaunchFile


class Log(Protocol):
    """Takes lines for the operator."""

    def info(self, line: str) -> None:
        """Tell what happens."""

    def warn(self, line: str, once: bool = False) -> None:
        """Tell what may go wrong; the same line only once, where `once` is set."""

    def error(self, line: str) -> None:
        """Tell what has failed."""


class Surroundings(Protocol):
    """The clock, the master and the nodes."""

    @property
    def log(self) -> Log:
        """Takes lines for the operator."""

    @property
    def failures(self) -> tuple[type[Exception], ...]:
        """The other errors of calls, by which a change fails and the manipulator does not end."""

    @property
    def is_ending(self) -> bool:
        """Whether the manipulator was asked to end."""

    def now(self) -> float:
        """Return the time, s."""

    def pause(self, duration: float) -> None:
        """Let so many s pass."""

    def news(self) -> AbstractContextManager[Any]:
        """Return what encloses taking in a report; those that wait for news look again after it."""

    def wait_for_news(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until a condition on the reports is true, so many s at most; return whether it is."""

    def resolve(self, name: str) -> str:
        """Return the full name of a node, topic or parameter."""

    def publishers(self, topic: str) -> set[str]:
        """Return the nodes that publish a topic."""

    def drivers(self) -> set[str]:
        """Return the other nodes that command the base."""

    def halt(self) -> None:
        """Command the base to stand still."""

    def advertised(self, nodes: Collection[str]) -> set[str]:
        """Return the topics and services that nodes offer."""

    def parameters(self, names: Iterable[str]) -> dict[str, Any]:
        """Return the values of parameters, by full name; those that are not set are left out."""

    def set_parameters(self, values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
        """Delete parameters, then set others, by full name."""

    def run(self, command: Sequence[str]) -> None:
        """Run a `rosparam` command of a launch file; raise DeploymentError where it fails."""

    def silent(self, nodes: Collection[str]) -> set[str]:
        """Return the nodes that do not answer."""

    def shut_down(self, node: str, reason: str) -> bool:
        """Ask a node to end; return whether it has answered."""

    def is_answering(self, node: str) -> bool:
        """Tell whether a node answers."""

    def end_node(self, node: str) -> None:
        """End a node that somebody else has started; raise DeploymentError where it stays."""

    def launch_file(self, configuration: Configuration) -> LaunchFile:
        """Read the launch file of a configuration; raise DeploymentError where that can't be done."""

    def why_not_started(self, node: NodeDescription) -> str:
        """Return why a node of this host can't be started, such as an executable that is missing; empty: it can."""


class Adjusting(Protocol):
    """The dynamic_reconfigure servers of running nodes."""

    def adjustable(self, node: str) -> Mapping[str, Adjustable]:
        """Return what a node takes, by the parameter's name relative to the node's; nothing if it does not answer."""

    def set(self, server: str, values: Mapping[str, Any]) -> None:
        """Set values at a server; raise DeploymentError where it does not take them."""


class Change(Protocol):
    """A change that the launchers have made."""

    @property
    def number(self) -> int:
        """What the reports together have as their number once all have reported it."""

    @property
    def phases(self) -> Mapping[str, float]:
        """Durations of the phases, s."""


class Launchers(Protocol):
    """The launchers of all hosts."""

    on_reports: Callable[[], object]
    """Is called whenever something differs."""

    losses: int
    """How often a host was lost."""

    def reports(self) -> dict[str, LauncherReport]:
        """Return what all launchers tell together, by function."""

    def require(self, function: str, nodes: Iterable[NodeDescription]) -> None:
        """Wait until the launchers answer that a change to nodes asks; raise DeploymentError where one does not."""

    def change(
        self,
        function: str,
        configuration: str,
        nodes: Iterable[NodeDescription],
        stop: Iterable[str],
        start: Iterable[str],
        found: Callable[[], None],
    ) -> Change:
        """Have the nodes of a function changed; raise DeploymentError where that fails."""

    def adopt(self, function: str, nodes: Iterable[NodeDescription]) -> None:
        """Note which nodes should run for a function although no change has started them."""

    def expect_nothing(self, function: str) -> None:
        """Note that nothing should run for a function although its nodes may not have been stopped."""

    def clear(self, function: str) -> list[str]:
        """Stop what runs for a function where it should not; return the hosts on which something did."""

    def stop_rest(self, function: str) -> None:
        """Stop what is left of a function that has failed on one host."""

    def lost_hosts(self, function: str) -> list[str]:
        """Return the lost hosts that should have a part of what runs for a function."""

    def unconnected(self, function: str) -> str:
        """Return a launcher that should have a part of what runs for a function and has ended; empty: none has."""

    def main_has_ended(self, function: str) -> bool:
        """Tell whether this host's main launcher should have a part of what runs for a function and has ended."""

    def is_here(self, node: NodeDescription) -> bool:
        """Tell whether a node runs on this host, as far as is known."""


class Names(Protocol):
    """Tells whether the nodes of one configuration answer under their names, or somebody else does."""

    @property
    def contested(self) -> tuple[str, ...]:
        """The nodes whose names somebody else had when they were to be started."""

    def begin(self) -> None:
        """Begin a change: nobody is known to have had a name."""

    def see_takers(self, nodes: Collection[str]) -> None:
        """See who answers under the names of nodes that do not run."""

    def is_up(self, node: str) -> bool:
        """Tell whether a node is up, or has done its work."""

    def conflict(self, node: str) -> str:
        """Return who has taken a node's name, for the end of a line; empty where nobody has."""


MakeNames = Callable[[Callable[[str], NodeDescription | None], Callable[[str], bool]], Names]
"""Makes the names of a configuration from what describes its nodes and what tells that one has done its work."""


class KeptGoal(Protocol):
    """The pending goal of an action, which is kept over a change of its server."""

    @property
    def status_topic(self) -> str:
        """Full name of the server's status topic."""

    @property
    def is_between_servers(self) -> bool:
        """Whether a server was stopped, and no new one was announced since."""

    @property
    def server_is_new(self) -> bool:
        """Whether a server is there that is another one than before the stop."""

    def server_stops(self, leaving: Collection[str] = (), died: bool = False, is_back: bool = False) -> None:
        """Note that the server will be stopped now, or has died."""

    def server_started(self) -> None:
        """Note that a new server is there."""

    def deliver(self) -> bool:
        """Send the goal if it is time; return whether the server has it or no goal is pending."""

    def drop(self) -> None:
        """Forget the pending goal."""
