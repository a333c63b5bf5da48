"""Carries out the steps of a change on the running system: the launcher, the nodes, the pending goal and the robot."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import rospy
from geometry_msgs.msg import Twist
from node_kit.io.xml_rpc import CallError

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.progress import ChangeProgress
from rosgraph_manipulator.change.tactics import Plan
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions
from rosgraph_manipulator.configuration.description import SystemDescription
from rosgraph_manipulator.io.launch_files import LaunchFileError, command_line, read_launch_file
from rosgraph_manipulator.io.master import NodeApi, advertised, publishers
from rosgraph_manipulator.launching.report import LauncherReport
from rosgraph_manipulator.ros.goal import PendingGoal
from rosgraph_manipulator.ros.launcher_client import LauncherClient
from rosgraph_manipulator.ros.reconfigure_client import ReconfigureClient

POLL_PERIOD = 0.01  # s, wall
STATE_TIMEOUT = 2.0  # s, wall, for the launcher's state to follow its answer
DELIVERY_TIMEOUT = 5.0  # s, wall, for the new server to have the pending goal


def wait_until(condition: Callable[[], bool], timeout: float) -> bool:
    """Wait for a condition; return whether it became true within `timeout` (s, wall)."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline or rospy.is_shutdown():
            return False
        time.sleep(POLL_PERIOD)
    return True


class RosExecutor:
    """The `ChangeExecutor` of a running ROS system. One thread calls it; the launcher's topic has another one."""

    def __init__(
        self,
        options: ManipulatorOptions,
        goal: PendingGoal | None,
        ready_timeout: float,
        settle_time: float,
        launcher_timeout: float,
        on_report: Callable[[], object],
    ) -> None:
        """Begin to follow the launcher.

        Args:
            options: the configurations, and the nodes to end before a start.
            goal: the pending goal that is kept over a change; None: no goal is kept.
            ready_timeout: how long a configuration may take to be ready, s, wall.
            settle_time: how long started nodes must live after that, s, wall.
            launcher_timeout: how long to look for the launcher, s, wall.
            on_report: is called with each report of the launcher, in a thread of its own.
        """
        self.nodes = ReconfigureClient()
        self.check: Callable[[], None] = lambda: None  # raises CancelledError where the change must be given up
        self.launcher_phases: dict[str, float] = {}  # durations of the launcher's last change, s
        self._options = options
        self._goal = goal
        self._ready_timeout, self._settle_time = ready_timeout, settle_time
        self._on_report = on_report
        self._progress = ChangeProgress()
        self._described: tuple[Configuration, SystemDescription] | None = None  # the last one read
        self._deployed: tuple[Configuration, SystemDescription] | None = None  # the one that the launcher deployed
        self._news = threading.Condition()
        self._cmd_vel = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._launcher = LauncherClient(launcher_timeout, self._follow)

    # -- what runs ------------------------------------------------------------------------------------------------

    @property
    def report(self) -> LauncherReport | None:
        """The launcher's last report; None: it has made none yet."""
        return self._progress.report

    def suppose(self, report: LauncherReport) -> None:
        """Take a report as the launcher's first one, where its topic has brought none yet."""
        with self._news:
            if self._progress.report is None:
                self._progress.take(report)

    def running(self) -> SystemDescription:
        """Return what runs, by the launcher's reports and the launch file as it was when it was deployed."""
        configuration = self._options.configurations.get(self._progress.running)
        if configuration is None:
            return SystemDescription()
        if self._deployed and self._deployed[0] == configuration:
            return self._progress.running_system(self._deployed[1])
        try:  # an earlier manipulator has deployed it
            return self._progress.running_system(self._read(configuration))
        except DeploymentError as error:
            rospy.logwarn("%s", error)
            return self._progress.running_system(None)

    def describe(self, configuration: Configuration) -> SystemDescription:
        """Return what a configuration's launch file starts.

        Raises:
            DeploymentError: it can't be read, or names an executable that does not exist.
        """
        system = self._read(configuration)
        try:
            for node in system.nodes.values():
                command_line(node)
        except LaunchFileError as error:
            raise DeploymentError(f"{configuration.launch_file}: {error}") from error
        self._described = (configuration, system)
        return system

    def ask_for_adjustable(self) -> None:
        """Ask the running nodes what they take by dynamic_reconfigure, so that the next plan need not wait for that."""
        for node in self._progress.launched:
            self.nodes.adjustable(node)

    # -- steps ----------------------------------------------------------------------------------------------------

    def begin(self, wanted: Configuration, plan: Plan) -> None:
        """Begin the change to a configuration by a plan; nothing is touched yet."""
        self.check()
        rospy.loginfo("%s: %s", wanted.name, " ".join(str(plan).split()))
        self._progress.begin(wanted, time.monotonic())

    def set_parameters(self, server: str, values: Mapping[str, Any]) -> None:
        """Set values at a dynamic_reconfigure server."""
        self._progress.parameters_change(server)
        self.nodes.set(server, values)

    def change_processes(self, stop: tuple[str, ...], start: tuple[str, ...]) -> None:
        """Set the wanted configuration's parameters, stop nodes, wait until they have ended, and start nodes."""
        leaving = {*stop, *start}
        self._progress.start(start)
        if leaving:
            self._end_foreign_nodes()
            self._see_who_leaves(leaving)
        self._call(self._progress.wanted, start)

    def wait_until_ready(self) -> None:
        """Wait until the configuration is ready, and hand the pending goal to a new server of its action."""
        # An earlier manipulator may have stopped the action's server.
        awaited = self._progress.awaited(self._goal is not None and self._goal.is_between_servers)
        for node in awaited.nodes:
            self._wait(lambda: self._is_up(node), f"node {node} is not up")  # noqa: B023
        topics = {rospy.resolve_name(topic) for topic in awaited.topics}
        if topics:
            what = f"not all of the topics {', '.join(sorted(topics))} are published"
            self._wait(lambda: topics <= advertised(self._progress.launched), what)
        goal = self._goal
        if goal is not None and awaited.server:
            self._wait(lambda: goal.server_is_new, "its action server is not up")
            goal.server_started()
            if not wait_until(goal.deliver, DELIVERY_TIMEOUT):
                rospy.logwarn("the new server does not take the pending goal")

    def wait_until_settled(self) -> None:
        """Wait until the nodes that were started have lived for the settling time."""
        end = time.monotonic() + self._settle_time
        while time.monotonic() < end:
            self._raise_if_broken()
            time.sleep(POLL_PERIOD)

    def restore(self, configuration: Configuration) -> None:
        """Stop all nodes that run, and start all of a configuration; this is not interrupted."""
        check, self.check = self.check, lambda: None
        try:
            self._progress.begin(configuration, time.monotonic())
            nodes = tuple(self.describe(configuration).nodes)
            self.change_processes(self._progress.launched, nodes)
            self.wait_until_ready()
        finally:
            self.check = check

    def stop_everything(self) -> None:
        """Stop what the launcher runs, and the robot."""
        try:
            self._call(None, ())
        finally:
            self.stop_robot()

    def stop_robot(self) -> None:
        """Command the base to stand still."""
        self._cmd_vel.publish(Twist())

    # -- recovery -------------------------------------------------------------------------------------------------

    def begin_recovery(self) -> None:
        """Note that nodes have died, and that the launcher will start them again."""
        if self._goal is None:
            return
        try:
            servers = publishers(self._goal.status_topic)
        except CallError as error:
            rospy.logwarn("%s", error)
            servers = set()
        if self._progress.server_died(servers):
            self._goal.server_stops()

    def end_recovery(self) -> None:
        """Wait until the nodes that the launcher has started again are ready.

        Raises:
            DeploymentError: they are not.
        """
        report = self._progress.report
        if report is not None:
            configuration = self._options.configurations.get(report.configuration)
            self._progress.recover(configuration, time.monotonic())
            self.wait_until_ready()

    # -- helpers --------------------------------------------------------------------------------------------------

    @staticmethod
    def _read(configuration: Configuration) -> SystemDescription:
        if configuration.problem:
            raise DeploymentError(configuration.problem)
        try:
            return read_launch_file(configuration.launch_file, configuration.args).system
        except LaunchFileError as error:
            raise DeploymentError(str(error)) from error

    def _call(self, wanted: Configuration | None, start: tuple[str, ...]) -> None:
        """Have the launcher change to a configuration, or, without one, stop everything."""
        # The nodes have all their time, however long the launcher could not be found.
        answer = self._launcher.change(wanted, start, found=lambda: self._progress.restart_deadline(time.monotonic()))
        self.launcher_phases = {phase.name: phase.duration for phase in answer.phases}
        self._deployed = self._described if self._described and self._described[0] == wanted else None
        self._progress.answered(answer.change)
        with self._news:
            self._news.wait_for(lambda: self._progress.is_reported(answer.change), STATE_TIMEOUT)

    def _end_foreign_nodes(self) -> None:
        """End nodes of the same function that somebody else started."""
        for node in self._options.kill_nodes:
            name = rospy.resolve_name(node)
            ours = name in self._progress.launched
            if not ours and NodeApi.request_shutdown(name, "replaced by another configuration"):
                gone = wait_until(lambda: not NodeApi.is_answering(name), self._ready_timeout)  # noqa: B023
                if not gone:
                    raise DeploymentError(f"node {name} does not end")

    def _see_who_leaves(self, leaving: set[str]) -> None:
        """See whether the pending goal's server and the robot's last driver end or are started anew."""
        try:
            drivers = publishers(rospy.resolve_name("cmd_vel")) - {rospy.get_name()}
            servers = publishers(self._goal.status_topic) if self._goal else None
        except CallError as error:
            raise DeploymentError(str(error)) from error
        if self._progress.leave(leaving, drivers, servers) and self._goal is not None:
            self._goal.server_stops()

    def _follow(self, report: LauncherReport) -> None:
        with self._news:
            if self._progress.take(report):
                self.stop_robot()
            self._news.notify_all()
        self._on_report()

    def _is_up(self, node: str) -> bool:
        return NodeApi.is_answering(node) or self._progress.has_finished(node)

    def _wait(self, condition: Callable[[], bool], what: str) -> None:
        deadline = self._progress.deadline(self._ready_timeout)
        while True:
            self._raise_if_broken()
            try:
                if condition():
                    return
            except CallError as error:
                raise DeploymentError(str(error)) from error
            if time.monotonic() > deadline:
                raise DeploymentError(f"{what} within {self._ready_timeout:g} s; see the nodes' logs")
            time.sleep(POLL_PERIOD)

    def _raise_if_broken(self) -> None:
        self.check()
        if rospy.is_shutdown():
            raise DeploymentError("the manipulator is shutting down")
        failure = self._progress.failure()
        if failure is not None:
            raise DeploymentError(failure)
