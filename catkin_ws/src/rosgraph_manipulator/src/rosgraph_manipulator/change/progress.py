"""The progress of the change of a function that is under way, from the launcher's reports.

The shell asks the nodes and waits. What it waits for, and when a change has failed, is decided here. Times are
arguments, in seconds of one clock that never goes back.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from rosgraph_launcher.description import NodeDescription, SystemDescription, owner_of
from rosgraph_launcher.launching.report import CHANGING, FAILED, RECOVERING, STABLE, LauncherReport

from rosgraph_manipulator.configuration.configurations import Configuration


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
    """The launcher's last reports, and what is known of the change that is being made."""

    def __init__(self) -> None:
        self._reports: dict[str, LauncherReport] | None = None
        self._unseen: dict[str, LauncherReport] = {}  # by function: of nodes that have died since `take_deaths`
        self._function = ""
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
    def has_reports(self) -> bool:
        """Whether the launcher has reported."""
        return self._reports is not None

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions of which the launcher has nodes, or had."""
        return tuple(self._reports or ())

    def report(self, function: str) -> LauncherReport | None:
        """Return the launcher's last report of a function; None: the launcher has made no report at all yet."""
        return None if self._reports is None else self._reports.get(function, LauncherReport(function))

    @property
    def launched(self) -> tuple[str, ...]:
        """The nodes that the launcher should run for all functions."""
        return tuple(dict.fromkeys(node for report in (self._reports or {}).values() for node in report.nodes))

    @property
    def at_work(self) -> frozenset[str]:
        """The nodes that the launcher runs."""
        return frozenset(
            node
            for report in (self._reports or {}).values()
            if report.state != FAILED
            for node in report.nodes
            if node not in report.dead
        )

    def launched_for(self, function: str) -> tuple[str, ...]:
        """Return the nodes that the launcher should run for a function."""
        report = self.report(function)
        return report.nodes if report else ()

    def shared(self, function: str, yielding: Collection[str] = ()) -> frozenset[str]:
        """Return the nodes that run for other functions than one and those that yield to it."""
        return frozenset(
            node
            for other, report in (self._reports or {}).items()
            if other != function and other not in yielding and report.state != FAILED
            for node in report.nodes
            if node not in report.dead
        )

    def given_up(self, function: str, wanted: Collection[str]) -> tuple[str, ...]:
        """Return the nodes that a function has no more and that no plan stops: others share them, or they are dead.

        The launcher must know: else they would run on for it when the others need them no longer, or start again.

        Args:
            function: its name.
            wanted: the nodes that it is to have.
        """
        report = self.report(function) or LauncherReport(function)
        kept = {*self.shared(function), *report.dead}
        return tuple(node for node in report.nodes if node in kept and node not in wanted)

    def take(self, reports: Iterable[LauncherReport]) -> bool:
        """Take in the reports of all functions; return whether the robot must be stopped now.

        That is when all nodes that drove the robot have ended, and before the first new one begins.
        """
        self._reports = {report.function: report for report in reports}
        for function, report in self._reports.items():
            if report.state == RECOVERING:
                before = self._unseen.get(function, LauncherReport()).dead
                self._unseen[function] = replace(report, dead=tuple(dict.fromkeys((*before, *report.dead))))
        report = self._reports.get(self._function, LauncherReport(self._function))
        if report.state in (RECOVERING, FAILED):
            self._death = (report.change, report.message)
        ended = report.state == CHANGING and self._wanted and report.configuration == self._wanted.name
        if not (ended and self._stops_robot):
            return False
        self._stops_robot = False
        return True

    def take_deaths(self, function: str) -> LauncherReport | None:
        """Return a report of nodes that have died since the last call, if some of them run again; else None.

        A node may be dead for a shorter time than the last reaction took.
        """
        unseen, report = self._unseen.pop(function, None), self.report(function)
        if unseen is None or report is None or report.change != unseen.change:
            return None
        runs_again = report.state == RECOVERING and not set(report.dead).issuperset(unseen.dead)
        return unseen if runs_again or report.state == STABLE else None

    def is_reported(self, change: int) -> bool:
        """Tell whether the launcher has reported the end of a change of the function that changes."""
        report = (self._reports or {}).get(self._function)
        return report is not None and report.change == change and report.state != CHANGING

    # -- one change -----------------------------------------------------------------------------------------------

    @property
    def wanted(self) -> Configuration | None:
        """The configuration that is being deployed, or was last."""
        return self._wanted

    @property
    def function(self) -> str:
        """The function that changes, or was changed last."""
        return self._function

    def begin(self, function: str, wanted: Configuration | None, now: float) -> None:
        """Begin the change of a function to a configuration; None: to release it."""
        self._function, self._wanted, self._begun = function, wanted, now
        self._started, self._number = (), None
        self._death = None  # the launcher may be a new one, which counts its changes from the start
        self._stops_robot = self._replaces_server = False

    def start(self, nodes: tuple[str, ...]) -> None:
        """Note which nodes a step of the change starts."""
        self._started = tuple(dict.fromkeys((*self._started, *nodes)))

    @property
    def started(self) -> tuple[str, ...]:
        """The nodes that the change has started."""
        return self._started

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
        replaces = servers is not None and not set(servers) - set(leaving)
        self._replaces_server = self._replaces_server or replaces  # an earlier step may have done so
        return replaces

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
        return self._reports is not None and node not in self.launched_for(self._function)

    # -- recovery -------------------------------------------------------------------------------------------------

    def recover(self, function: str, configuration: Configuration | None, now: float, new_server: bool) -> None:
        """Begin to wait for nodes of a function that the launcher has started again.

        Args:
            function: its name.
            configuration: the one that runs for it.
            now: the time.
            new_server: whether a server of the kept action had died.
        """
        report = self.report(function)
        if report is None:
            return
        self._function, self._wanted, self._begun, self._death = function, configuration, now, None
        self._started, self._number = report.nodes, report.change
        self._stops_robot, self._replaces_server = False, new_server

    # -- what runs ------------------------------------------------------------------------------------------------

    def parameters_change(self, server: str) -> None:
        """Note that parameters are being set at a dynamic_reconfigure server: its node may soon have a mixture."""
        self._uncertain |= {owner_of(f"{server}/", self.launched)} - {""}

    def running(self, function: str) -> str:
        """Return the name of the configuration that runs for a function; empty where none does."""
        report = self.report(function)
        return report.configuration if report and report.state != FAILED else ""

    def running_system(
        self, function: str, described: SystemDescription | None, values: Mapping[str, object] | None = None
    ) -> SystemDescription:
        """Return what runs for a function.

        Args:
            function: its name.
            described: the description of the configuration that runs; None: nothing is known of its nodes but their
                names.
            values: private parameters that were set to other values since, by full name.
        """
        report = self.report(function)
        if report is None:
            return SystemDescription()
        if described is None:
            return SystemDescription({name: NodeDescription(name, "", "", "") for name in report.nodes})
        # Without parameters, a node whose values are uncertain differs from any description, so all are set anew.
        nodes = {
            name: replace(node, parameters={} if name in self._uncertain else _with_values(node, values or {}))
            for name, node in described.nodes.items()
            if name not in report.dead
        }
        left = {name: NodeDescription(name, "", "", "") for name in report.nodes if name not in described.nodes}
        return SystemDescription({**nodes, **left}, described.parameters)


def _with_values(node: NodeDescription, values: Mapping[str, object]) -> dict[str, object]:
    return {key: values.get(f"{node.name}/{key}", value) for key, value in node.parameters.items()}
