"""The progress of the change under way, from the launcher's reports.

The shell asks the nodes and waits. What it waits for, and when a change has failed, is decided here. Times are
arguments, in seconds of one clock that never goes back.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_manipulator.configuration.description import NodeDescription, SystemDescription
from rosgraph_manipulator.launching.report import CHANGING, FAILED, RECOVERING, LauncherReport


@dataclass(frozen=True)
class Awaited:
    """What must be there before a configuration is ready.

    Attributes:
        nodes: nodes that must answer.
        topics: topics that the configuration's nodes must publish, as the configuration names them.
        server: whether a new server of the kept action must be there.
    """

    nodes: tuple[str, ...] = ()
    topics: frozenset[str] = frozenset()
    server: bool = False


class ChangeProgress:
    """The launcher's last report, and what is known of the change that is being made."""

    def __init__(self) -> None:
        self._report: LauncherReport | None = None
        self._wanted: Configuration | None = None
        self._begun = 0.0
        self._started: tuple[str, ...] = ()
        self._number: int | None = None  # of the launcher's change, once it has answered
        self._death: tuple[int, str] | None = None  # after which change a node died, and how
        self._stops_robot = False
        self._replaces_server = False
        self._uncertain: set[str] = set()  # nodes whose parameters may be between two configurations

    # -- the launcher ---------------------------------------------------------------------------------------------

    @property
    def report(self) -> LauncherReport | None:
        """The launcher's last report; None: it has made none yet."""
        return self._report

    @property
    def launched(self) -> tuple[str, ...]:
        """The nodes that the launcher should run."""
        return self._report.nodes if self._report else ()

    def take(self, report: LauncherReport) -> bool:
        """Take in a report; return whether the robot must be stopped now.

        That is when all nodes that drove the robot have ended, and before the first new one begins.
        """
        self._report = report
        if report.state in (RECOVERING, FAILED):
            self._death = (report.change, report.message)
        ended = report.state == CHANGING and self._wanted and report.configuration == self._wanted.name
        if not (ended and self._stops_robot):
            return False
        self._stops_robot = False
        return True

    def is_reported(self, change: int) -> bool:
        """Tell whether the launcher has reported the end of a change."""
        report = self._report
        return report is not None and report.change == change and report.state != CHANGING

    # -- one change -----------------------------------------------------------------------------------------------

    @property
    def wanted(self) -> Configuration | None:
        """The configuration that is being deployed, or was last."""
        return self._wanted

    def begin(self, wanted: Configuration, now: float) -> None:
        """Begin the change to a configuration."""
        self._wanted, self._begun = wanted, now
        self._started, self._number = (), None
        self._death = None  # the launcher may be a new one, which counts its changes from the start
        self._stops_robot = self._replaces_server = False

    def start(self, nodes: tuple[str, ...]) -> None:
        """Note which nodes the change starts."""
        self._started = nodes

    def leave(self, leaving: Collection[str], drivers: Collection[str], servers: Collection[str] | None) -> bool:
        """Note which nodes end or are started anew; return whether the kept action gets a new server.

        The robot must be stopped where all nodes that command it are among them. The action gets a new server where
        none of its present servers stays.

        Args:
            leaving: nodes that end or are started anew.
            drivers: nodes that command the robot.
            servers: nodes that serve the kept action; None: no action is kept.
        """
        self._stops_robot = bool(drivers) and set(drivers) <= set(leaving) & set(self.launched)
        self._replaces_server = servers is not None and not set(servers) - set(leaving)
        return self._replaces_server

    def restart_deadline(self, now: float) -> None:
        """Note that the launcher is asked now: the time for the nodes to be ready begins."""
        self._begun = now

    def answered(self, number: int) -> None:
        """Note that the launcher has made the change that has this number."""
        self._number = number
        self._uncertain.clear()

    def failure(self) -> str | None:
        """Return how a node has died since the launcher made the change; None if none has."""
        return self._death[1] if self._death and self._death[0] == self._number else None

    def awaited(self, between_servers: bool) -> Awaited:
        """Return what must be there before the configuration is ready.

        Args:
            between_servers: whether the kept action's server was stopped, and no new one has been seen since.
        """
        if self._wanted is None or not (self._started or between_servers):
            return Awaited()
        return Awaited(self._started, frozenset(self._wanted.topics), self._replaces_server or between_servers)

    def deadline(self, timeout: float) -> float:
        """Return the time until which the configuration must be ready."""
        return self._begun + timeout

    def has_finished(self, node: str) -> bool:
        """Tell whether a node has done its work and ended."""
        return self._report is not None and node not in self._report.nodes

    # -- recovery -------------------------------------------------------------------------------------------------

    def server_died(self, servers: Collection[str]) -> bool:
        """Note who served the kept action when nodes died; return whether one of them was a server."""
        self._replaces_server = bool(self._report and set(servers) & set(self._report.dead))
        return self._replaces_server

    def recover(self, configuration: Configuration | None, now: float) -> None:
        """Begin to wait for nodes that the launcher has started again."""
        if self._report is None:
            return
        self._wanted, self._begun, self._death = configuration, now, None
        self._started, self._number = self._report.nodes, self._report.change

    # -- what runs ------------------------------------------------------------------------------------------------

    def parameters_change(self, server: str) -> None:
        """Note that parameters are being set at a dynamic_reconfigure server: its node may soon have a mixture."""
        self._uncertain |= {name for name in self.launched if f"{server}/".startswith(f"{name}/")}

    @property
    def running(self) -> str:
        """Name of the configuration that runs; empty where none does."""
        return self._report.configuration if self._report and self._report.state != FAILED else ""

    def running_system(self, described: SystemDescription | None) -> SystemDescription:
        """Return what runs.

        Args:
            described: the description of the configuration that runs; None: nothing is known of its nodes but their
                names.
        """
        if self._report is None:
            return SystemDescription()
        if described is None:
            return SystemDescription({name: NodeDescription(name, "", "", "") for name in self._report.nodes})
        # Without parameters, a node whose values are uncertain differs from any description, so all are set anew.
        nodes = {
            name: replace(node, parameters={}) if name in self._uncertain else node
            for name, node in described.nodes.items()
            if name not in self._report.dead
        }
        return SystemDescription(nodes, described.parameters)
