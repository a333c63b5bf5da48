"""Carries out the steps of a change on the running system: the launcher, the nodes, the pending goals and the robot.

It waits through its surroundings only, so that the same code runs on ROS and on a simulated clock.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from node_kit.io.xml_rpc import CallError
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.contested import HOLD
from rosgraph_launcher.launching.report import CHANGING, STABLE, LauncherReport

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.held_parameters import HeldParameters, changed
from rosgraph_manipulator.change.parameters import OverwrittenParameters
from rosgraph_manipulator.change.progress import ChangeProgress
from rosgraph_manipulator.change.running_system import RunningSystem
from rosgraph_manipulator.change.surroundings import Adjusting, KeptGoal, Launchers, MakeNames, Names, Surroundings
from rosgraph_manipulator.change.tactics import Plan
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions

if TYPE_CHECKING:
    from rosgraph_manipulator.io.launch_files import LaunchFile

POLL_PERIOD = 0.01  # s, wall
LOOK_PERIOD = 0.03  # s, wall, where a look calls the master and nodes: new nodes need the processor, and the master
STATE_TIMEOUT = 2.0  # s, wall, for the launcher's state to follow its answer
DELIVERY_TIMEOUT = 5.0  # s, wall, for the new server to have the pending goal


@dataclass(frozen=True)
class DriverStart:
    """A driver whose processes have begun.

    Attributes:
        nodes: those that were started.
        number: of the launcher's change.
        names: tells whether they answer under their names.
        held: their parameters, until they are up.
    """

    nodes: tuple[str, ...]
    number: int
    names: Names
    held: HeldParameters


class Execution:
    """The `ChangeExecutor` of a running system. One thread calls it; the launcher's reports may come in another one."""

    def __init__(
        self,
        options: ManipulatorOptions,
        goals: Mapping[str, KeptGoal],
        overwritten: OverwrittenParameters,
        ready_timeout: float,
        settle_time: float,
        launchers: Launchers,
        on_report: Callable[[], object],
        around: Surroundings,
        adjusting: Adjusting,
        make_names: MakeNames,
    ) -> None:
        """Begin to follow the launchers.

        Args:
            options: the configurations, and the nodes to end before a start.
            goals: the pending goal that is kept over a change of a function, by the function's name.
            overwritten: what an earlier manipulator has left of the parameters' former values.
            ready_timeout: how long a configuration may take to be ready, s, wall.
            settle_time: how long started nodes must live after that, s, wall.
            launchers: those of all hosts.
            on_report: is called after each report of a launcher, maybe in a thread of its own.
            around: the clock, the master and the nodes.
            adjusting: the dynamic_reconfigure servers of nodes.
            make_names: makes what looks up who answers under the names of nodes.
        """
        self.check: Callable[[], None] = lambda: None  # raises CancelledError where the change must be given up
        self.launcher_phases: dict[str, float] = {}  # durations of the launcher's last change, s
        self._options = options
        self._around = around
        self._make_names = make_names
        self._goals = goals
        self._overwritten = overwritten
        self._ready_timeout, self._settle_time = ready_timeout, settle_time
        self._on_report = on_report
        self._progress = ChangeProgress()
        self._launchers = launchers
        self.system = RunningSystem(options, self._progress, launchers.is_here, around, adjusting)
        self._names = make_names(self._description, self._progress.has_finished)
        self._servers_died: dict[str, bool] = {}  # by function: whether the kept action's server died
        self._follows = False  # whether the reports of the launcher that made the last change arrive
        self._recovers = False  # whether it waits for nodes that the launcher has started again
        self._owes_restore = False  # whether former values could not be restored, or those left not be handed over
        self._owes_values: dict[str, frozenset[str]] = {}  # by function: died nodes whose parameters are not put back
        launchers.on_reports = self._follow
        if launchers.reports():
            self._follow()

    def report(self, function: str) -> LauncherReport | None:
        """Return the launcher's last report of a function; None: it has made none at all yet."""
        return self._progress.report(function)

    def has_nodes(self, function: str) -> bool:
        """Tell whether the launcher has nodes of a function, as far as it has reported."""
        return bool(self._progress.launched_for(function))

    def adopt(self, configuration: Configuration) -> None:
        """Note that a configuration runs, or should, although the last change was not to it."""
        with contextlib.suppress(DeploymentError):  # what the launchers tell is all that is known of it
            launch = self.system.launch_file(configuration)
            self.system.deployed(configuration, launch)
            self._launchers.adopt(configuration.function, launch.system.nodes.values())

    def expect_nothing(self, function: str) -> None:
        """Note that nothing should run for a function, so that `clear` stops what could not be stopped."""
        self._launchers.expect_nothing(function)

    def stop_rest(self, function: str) -> None:
        """Stop the nodes of a function that has failed on one host on all others, too."""
        self._launchers.stop_rest(function)

    def clear(self, function: str) -> None:
        """Stop what runs for a function on hosts where it should not: they were lost, or hung, when it changed."""
        for host in self._launchers.clear(function):
            self._around.log.warn(f"{function}: stopped what was left of it on host {host}")

    def lost_hosts(self, function: str) -> list[str]:
        """Return the lost hosts that have a part of what should run for a function."""
        return self._launchers.lost_hosts(function)

    def is_unconnected(self, function: str) -> bool:
        """Tell whether a launcher that should have a part of what runs for a function has ended."""
        return bool(self._launchers.unconnected(function))

    def launcher_has_ended(self, function: str) -> bool:
        """Tell whether this host's main launcher should have a part of what runs for a function and has ended."""
        return self._launchers.main_has_ended(function)

    @property
    def losses(self) -> int:
        """How often a host was lost."""
        return self._launchers.losses

    def require_launchers(self, configuration: Configuration) -> None:
        """Wait until the launchers answer that the change to a configuration asks.

        Raises:
            DeploymentError: one does not, so nothing can be changed.
        """
        self._launchers.require(configuration.function, self.system.launch_file(configuration).system.nodes.values())

    # -- steps ----------------------------------------------------------------------------------------------------

    def begin(self, wanted: Configuration, plan: Plan) -> None:
        """Begin the change to a configuration by a plan; nothing is touched yet."""
        self.check()
        self._follows = False
        self._names.begin()
        self._around.log.info(f"{wanted.name}: {' '.join(str(plan).split())}")
        self._progress.begin(wanted.function, wanted, self._around.now())

    def set_parameters(self, server: str, values: Mapping[str, Any]) -> None:
        """Set values at a dynamic_reconfigure server."""
        self._progress.parameters_change(server)
        self.system.nodes.set(server, values)

    def change_processes(self, stop: tuple[str, ...], start: tuple[str, ...]) -> None:
        """Set the wanted configuration's parameters, stop nodes, wait until they have ended, and start nodes."""
        wanted = self._progress.wanted
        if wanted is None:
            raise DeploymentError("no configuration is being deployed")
        launch = self.system.launch_file(wanted)
        leaving = {*stop, *start} - (self._progress.shared(wanted.function) - set(start))
        self._progress.start(start)
        self._names.see_takers(set(start) - self._progress.at_work)
        if leaving:
            self._end_foreign_nodes(wanted)
            self._see_who_leaves(wanted.function, leaving)
        self._store_parameters(wanted.function, launch)
        given_up = self._progress.given_up(wanted.function, launch.system.nodes)
        stops = tuple(dict.fromkeys((*stop, *given_up)))
        self._call(wanted.function, wanted.name, launch, stops, start)
        report = self.report(wanted.function)
        expected = {*launch.system.nodes, *stops}
        if report and (come := tuple(node for node in report.nodes if node not in expected)):
            # In between, the launcher has ended a change for a manipulator before this one, which has died since.
            self._call(wanted.function, wanted.name, launch, come, ())
        self.system.deployed(wanted, launch)

    def wait_until_ready(self) -> None:
        """Wait until the configuration is ready, and hand the pending goal to a new server of its action."""
        function = self._progress.function
        goal = self._goals.get(function)
        # An earlier manipulator may have stopped the action's server.
        awaited = self._progress.awaited(goal is not None and goal.is_between_servers)
        wanted = self.system.parameters_of(function, awaited.nodes)
        held = HeldParameters(function, wanted, awaited.nodes, self._names.is_up, self._around)
        for number, node in enumerate(awaited.nodes):

            def is_up() -> bool:
                if self._names.is_up(node):  # noqa: B023
                    return True
                held.look(awaited.nodes[number:])  # noqa: B023
                return False

            self._wait(is_up, f"node {node} is not up", lambda: self._names.conflict(node), LOOK_PERIOD)  # noqa: B023
        topics = {self._around.resolve(topic) for topic in awaited.topics}
        if topics:
            missing = set(topics)

            def all_are_published() -> bool:
                missing.clear()
                missing.update(topics - self._around.advertised(self._progress.launched_for(function)))
                return not missing

            what = "not all of its topics are published"
            self._wait(all_are_published, what, lambda: f", {', '.join(sorted(missing))} is missing", LOOK_PERIOD)
        if goal is not None and awaited.server:
            self._wait(lambda: goal.server_is_new, "its action server is not up")
            goal.server_started()
            if not self._wait_until(goal.deliver, DELIVERY_TIMEOUT):
                self._around.log.warn("the new server does not take the pending goal")

    def wait_until_settled(self) -> None:
        """Wait until the nodes that were started have lived for the settling time."""
        end = self._around.now() + self._settle_time
        while self._around.now() < end:
            self._raise_if_broken()
            self._around.pause(POLL_PERIOD)
        self._see_names_held(self._progress.started)

    def restore(self, configuration: Configuration) -> None:
        """Stop what runs for a function alone, and start all nodes of a configuration; this is not interrupted."""
        check, self.check = self.check, lambda: None
        try:
            function = configuration.function
            self._names.begin()
            begun = self._progress.started  # a new launcher may have started them, and its report be on the way
            self._progress.begin(function, configuration, self._around.now())
            system = self.system.describe(configuration)
            # Where the launcher has died, nothing runs for the other functions either.
            shared = frozenset() if self._launchers.unconnected(function) else self._progress.shared(function)
            known = dict.fromkeys((*self._progress.launched_for(function), *begun))
            stop = tuple(node for node in known if node not in shared)
            self.change_processes(stop, tuple(node for node in system.nodes if node not in shared))
            self.wait_until_ready()
            self._see_names_held(())
        finally:
            self.check = check

    def release(self, function: str) -> frozenset[str]:
        """Stop all nodes that only this function needs, and the robot if none of the others drives it.

        Returns:
            The nodes that stay, because other functions need them.
        """
        self._progress.begin(function, None, self._around.now())
        staying = self._progress.shared(function).intersection(self._progress.launched_for(function))
        leaving = set(self._progress.launched_for(function)) - staying
        try:
            if leaving:
                try:
                    self._see_who_leaves(function, leaving)
                except DeploymentError as error:  # the nodes must end nevertheless
                    self._around.log.warn(f"{function}: it is not known who drives the robot: {error}")
            self._call(function, "", None, tuple(leaving), ())
            self.system.released(function)
            try:
                self._store_parameters(function, None)
            except DeploymentError as error:  # the nodes have ended nevertheless
                self._owes_restore = True
                self._around.log.warn(f"{function}: former values of parameters are not restored yet: {error}")
        finally:
            self.stop_robot(function)
        return staying

    def catch_up(self) -> None:
        """Set the parameters that could not be set yet, because the master did not answer; call it now and then."""
        if self._owes_restore:
            with contextlib.suppress(DeploymentError):
                self._store_parameters("", None)
        for function, nodes in list(self._owes_values.items()):
            with contextlib.suppress(CallError):
                self._put_back(function, nodes)

    def forget_goal(self, function: str) -> None:
        """Drop the pending goal of a function that is needed no longer."""
        if function in self._goals:
            self._goals[function].drop()

    def stop_robot(self, function: str) -> None:
        """Command the base to stand still, unless nodes of another function drive it."""
        try:
            drivers = self._around.drivers()
        except CallError:
            drivers = set()
        if not drivers & self._progress.shared(function):
            self._around.halt()

    # -- recovery -------------------------------------------------------------------------------------------------

    def take_deaths(self, function: str) -> LauncherReport | None:
        """Return a report of nodes that have died and run again since the last call; None: there are none."""
        return self._progress.take_deaths(function)

    def begin_recovery(self, report: LauncherReport, goes_on: bool = False) -> None:
        """Note that nodes of a function have died, and that the launcher will start them again, or has done so.

        Their parameters are put back first, because somebody may have set others, such as the launch file of a robot
        that was started again.

        Args:
            report: tells which nodes.
            goes_on: whether a recovery has begun already, and these nodes have died since.
        """
        function = report.function
        try:
            self._put_back(function, self._owes_values.get(function, frozenset()).union(report.dead))
        except CallError as error:
            self._around.log.warn(f"{function}: parameters are not put back yet: {error}")
        goal = self._goals.get(function)
        if goal is None:
            return
        try:
            servers = self._around.publishers(goal.status_topic)
        except CallError as error:
            self._around.log.warn(str(error))
            servers = set()
        died = bool(servers & set(report.dead))
        self._servers_died[function] = died or (goes_on and self._servers_died.get(function, False))
        if died:
            now = self._progress.report(function)
            goal.server_stops(died=True, is_back=now is not None and not servers & set(now.dead))

    def end_recovery(self, function: str) -> None:
        """Wait until the nodes of a function that the launcher has started again are ready.

        Raises:
            DeploymentError: they are not.
        """
        report = self._progress.report(function)
        if report is not None:
            configuration = self._options.configurations.get(report.configuration)
            new_server = self._servers_died.get(function, False)
            self._progress.recover(function, configuration, self._around.now(), new_server)
            self._recovers = True
            try:
                self.wait_until_ready()
            finally:
                self._recovers = False
            self._servers_died.pop(function, None)

    def hears_more(self, function: str) -> bool:
        """Tell whether the launcher has more to tell of nodes that do not get ready, such as another death."""
        report = self._progress.report(function)
        is_at_rest = report is not None and report.state == STABLE and self._progress.failure() is None
        return not is_at_rest or bool(self._launchers.unconnected(function))

    # -- repairs --------------------------------------------------------------------------------------------------

    def start_driver(self, driver: Configuration) -> DriverStart:
        """Start the nodes of a driver, also where they run; functions keep theirs. Do not wait until they are up.

        Two components may have a node in common, which each of their repairs restarts. Nodes of the same names that
        somebody else has started end first.

        Raises:
            DeploymentError: nothing can be started.
        """
        function = driver.function
        system = self.system.describe_beside_others(driver)
        launch = self.system.launch_file(driver)
        shared = self._progress.shared(function, yielding=self._options.drivers)
        start = tuple(node for node in system.nodes if node not in shared)
        if not start:
            raise DeploymentError(
                f"functions that run have its nodes, {', '.join(system.nodes)}: request their configurations again, "
                "which restarts nodes that hang"
            )
        names = self._make_names(system.nodes.get, lambda node: node not in self._progress.launched_for(function))
        self.require_launchers(driver)
        for node in set(start) - self._progress.at_work:
            self._around.end_node(node)
        names.see_takers(set(start) - self._progress.at_work)
        self._store_parameters(function, launch)
        stop = tuple(node for node in self._progress.launched_for(function) if node not in shared)
        nodes = launch.system.nodes.values()
        number = self._launchers.change(function, driver.name, nodes, stop, start, found=lambda: None).number
        self.system.deployed(driver, launch)

        def is_reported() -> bool:
            report = self._progress.report(function)
            return report is not None and report.change == number and report.state != CHANGING

        self._around.wait_for_news(is_reported, STATE_TIMEOUT)
        held = HeldParameters(function, system.all_parameters(), system.nodes, names.is_up, self._around)
        return DriverStart(start, number, names, held)

    # -- helpers --------------------------------------------------------------------------------------------------

    def _store_parameters(self, function: str, launch: LaunchFile | None) -> None:
        """Set the parameters of a configuration; None: only restore what the former one has overwritten.

        Raises:
            DeploymentError: the master refuses, or a command of the launch file fails.
        """
        wanted = launch.system.all_parameters() if launch else {}
        others = [name for system in self.system.others(function).values() for name in system.all_parameters()]
        try:
            for command in launch.commands if launch else ():
                self._around.run(command)
            asked = self._overwritten.unknown(wanted)
            self._overwritten.remember(asked, self._around.parameters(asked))
            values, gone = self._overwritten.transition(wanted, others)
            # Each time, because the call that handed it over before may have failed.
            clear = launch.clear if launch else ()
            self._around.set_parameters({**self._handover(), **values}, delete=[*clear, *gone])
            self._owes_restore = False
        except (CallError, OSError) as error:
            raise DeploymentError(" ".join(str(error).split())) from error
        if self._overwritten.restored(wanted, others):
            try:
                self._around.set_parameters(self._handover())
            except (CallError, OSError):
                self._owes_restore = True  # `catch_up` hands it over

    def _handover(self) -> dict[str, Any]:
        """Return the parameter that tells the next manipulator which former values are to be restored."""
        return {self._around.resolve("~overwritten"): self._overwritten.as_parameter()}

    def _put_back(self, function: str, nodes: frozenset[str]) -> None:
        """Set those parameters of nodes that somebody has changed.

        Raises:
            CallError: the master does not answer; `catch_up` tries again.
        """
        self._owes_values[function] = nodes
        lost = changed(self.system.parameters_of(function, nodes), self._around)
        if lost:
            self._around.set_parameters(lost)
            self._around.log.warn(f"{function}: put back, because nodes start again: {', '.join(sorted(lost))}")
        del self._owes_values[function]

    def _call(
        self,
        function: str,
        configuration: str,
        launch: LaunchFile | None,
        stop: tuple[str, ...],
        start: tuple[str, ...],
    ) -> None:
        """Have the launcher change the nodes of a function."""
        made = self._launchers.change(
            function,
            configuration,
            launch.system.nodes.values() if launch else (),
            stop,
            start,
            # The nodes have all their time, however long the launcher could not be found.
            found=lambda: self._progress.restart_deadline(self._around.now()),
        )
        self.launcher_phases = dict(made.phases)
        self._progress.answered(made.number)
        self._follows = self._around.wait_for_news(lambda: self._progress.is_reported(made.number), STATE_TIMEOUT)

    def _description(self, node: str) -> NodeDescription | None:
        wanted = self._progress.wanted
        if wanted is None:
            return None
        launch = self._recovers and self.system.deployed_file(wanted)
        return (launch or self.system.launch_file(wanted)).system.nodes.get(node)

    def _end_foreign_nodes(self, wanted: Configuration) -> None:
        """End nodes of the same function that somebody else started."""
        names = {self._around.resolve(node) for node in self._options.of(wanted.function).kill_nodes}
        foreign = sorted(names - self._progress.at_work)
        if foreign:
            self.require_launchers(wanted)
        for name in foreign:
            if self._around.shut_down(name, "replaced by another configuration"):
                gone = self._wait_until(lambda: not self._around.is_answering(name), self._ready_timeout)  # noqa: B023
                if not gone:
                    raise DeploymentError(f"node {name} does not end")

    def _see_who_leaves(self, function: str, leaving: set[str]) -> None:
        """See whether the pending goal's server and the robot's last driver end or are started anew."""
        goal = self._goals.get(function)
        try:
            drivers = self._around.drivers()
            servers = self._around.publishers(goal.status_topic) if goal else None
        except CallError as error:
            raise DeploymentError(str(error)) from error
        if self._progress.leave(leaving, drivers, servers) and goal is not None:
            goal.server_stops(leaving)

    def _follow(self) -> None:
        with self._around.news():
            if self._progress.take(self._launchers.reports().values()):
                self._around.halt()
        self._on_report()

    def _wait_until(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait for a condition; return whether it became true within `timeout` (s, wall)."""
        deadline = self._around.now() + timeout
        while not condition():
            if self._around.now() > deadline or self._around.is_ending:
                return False
            self._around.pause(POLL_PERIOD)
        return True

    def _wait(
        self, condition: Callable[[], bool], what: str, why: Callable[[], str] = str, period: float = POLL_PERIOD
    ) -> None:
        deadline = self._progress.deadline(self._ready_timeout)
        while True:
            self._raise_if_broken()
            try:
                if condition():
                    return
            except CallError as error:
                raise DeploymentError(str(error)) from error
            if self._around.now() > deadline:
                raise DeploymentError(f"{what} within {self._ready_timeout:g} s{why()}; see the nodes' logs")
            self._around.pause(period)

    def _see_names_held(self, nodes: Collection[str]) -> None:
        """See that nobody has taken the names of nodes, nor takes back those that somebody else had, for a while.

        Raises:
            DeploymentError: somebody has.
        """
        until = self._around.now() + (HOLD if self._names.contested else 0.0)
        while True:
            self._raise_if_broken()
            for node in {*nodes, *self._names.contested}:
                if conflict := self._names.conflict(node):
                    raise DeploymentError(f"node {node} has lost its name{conflict}")
            if self._around.now() >= until:
                return
            self._around.pause(LOOK_PERIOD)

    def _raise_if_broken(self) -> None:
        self.check()
        if self._around.is_ending:
            raise DeploymentError("the manipulator is shutting down")
        failure = self._progress.failure()
        gone = self._launchers.unconnected(self._progress.function) if failure is None and self._follows else ""
        if gone:
            failure = f"{gone.rpartition('/')[2]} has died, and its nodes with it: see its log"
        if failure is not None:
            raise DeploymentError(failure)
