"""What a deployment needs of the running ROS system: the ROS shell around `deployment`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from metacontrol_msgs.msg import LauncherState
from metacontrol_msgs.srv import ChangeConfiguration, ChangeConfigurationRequest, ChangeConfigurationResponse
from rospy.exceptions import TransportException, TransportInitError

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.tactics import Plan
from rosgraph_manipulator.configuration.configuration_file import Configuration, Settings
from rosgraph_manipulator.configuration.description import NodeDescription, SystemDescription
from rosgraph_manipulator.io.launch_files import LaunchFileError, command_line, read_launch_file
from rosgraph_manipulator.io.master import MasterError, NodeApi, advertised, publishers
from rosgraph_manipulator.ros.goal import PendingGoal
from rosgraph_manipulator.ros.reconfigure_client import ReconfigureClient

POLL_PERIOD = 0.01  # s, wall
STATE_TIMEOUT = 2.0  # s, wall, for the launcher's state to follow its answer
DELIVERY_TIMEOUT = 5.0  # s, wall, for the new server to have the pending goal
BROKEN = (LauncherState.RECOVERING, LauncherState.FAILED)

_NOT_REACHED = (TransportInitError, rosgraph.MasterError)
"""What rospy has caught when it raises a ServiceException and has sent no request: no registration, no connection."""


def wait_until(condition: Callable[[], bool], timeout: float) -> bool:
    """Wait, in wall time, for a condition; return whether it came to hold within `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline or rospy.is_shutdown():
            return False
        time.sleep(POLL_PERIOD)
    return True


class RosExecutor:
    """The launcher, the nodes, the pending goal and the robot."""

    def __init__(
        self,
        settings: Settings,
        goal: PendingGoal | None,
        ready_timeout: float,
        settle_time: float,
        launcher_timeout: float,
        on_state: Callable[[LauncherState], None],
    ) -> None:
        """Begin to follow the launcher.

        Args:
            settings: configurations, nodes to end.
            goal: of the action that is kept over a change.
            ready_timeout: for a configuration to be ready, s, wall.
            settle_time: nodes that were started have to live this long after all was ready, s, wall.
            launcher_timeout: to find the launcher, s, wall.
            on_state: called with every state of the launcher, in a thread of its own.
        """
        self.nodes = ReconfigureClient()
        self.launcher: LauncherState | None = None  # what it said last
        self.check: Callable[[], None] = lambda: None  # raises CancelledError where the change is to be given up
        self.launcher_phases: dict[str, float] = {}
        self._settings = settings
        self._goal = goal
        self._ready_timeout, self._settle_time = ready_timeout, settle_time
        self._launcher_timeout = launcher_timeout
        self._on_state = on_state
        self._wanted: Configuration | None = None
        self._doubtful: set[str] = set()  # nodes whose parameters may be between two configurations
        self._death: tuple[int, str] | None = None  # of a node: after which change, and how
        self._change_number: int | None = None  # of the change that is being waited for
        self._stop_robot = False
        self._new_server = False
        self._started: tuple[str, ...] = ()
        self._begun = 0.0
        self._news = threading.Condition()
        self._news_at = 0.0
        self._cmd_vel = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self._change = rospy.ServiceProxy("rosgraph_launcher/change", ChangeConfiguration)
        self._subscriber = rospy.Subscriber("rosgraph_launcher/state", LauncherState, self._follow, queue_size=20)

    # -- what runs ------------------------------------------------------------------------------------------------

    def running(self) -> SystemDescription:
        """Return what runs, as the launcher says."""
        state = self.launcher
        configuration = self._settings.configurations.get(state.configuration) if state else None
        if state is None or configuration is None or state.state == LauncherState.FAILED:
            return SystemDescription()
        try:
            whole = self._read(configuration)
        except DeploymentError as error:  # its file was changed since: nothing is known of its nodes but their names
            rospy.logwarn("%s", error)
            return SystemDescription({name: NodeDescription(name, "", "", "") for name in state.nodes})
        # What changed behind a node's back has to be set anew: nothing is known of its parameters.
        return SystemDescription(
            {
                name: node if name not in self._doubtful else replace(node, parameters={})
                for name, node in whole.nodes.items()
                if name not in state.dead
            },
            whole.parameters,
        )

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
        return system

    def get_to_know(self) -> None:
        """Ask what runs for what it takes by dynamic_reconfigure, so that the next plan need not wait for that."""
        for node in self.launcher.nodes if self.launcher else ():
            self.nodes.adjustable(node)

    # -- steps ----------------------------------------------------------------------------------------------------

    def begin(self, wanted: Configuration, plan: Plan) -> None:
        """Prepare the way to a configuration by a plan; nothing is touched."""
        self.check()
        rospy.loginfo("%s: %s", wanted.name, " ".join(str(plan).split()))
        self._prepare(wanted)

    def set_parameters(self, server: str, values: Mapping[str, Any]) -> None:
        """Have a dynamic_reconfigure server take values."""
        if self.launcher:
            self._doubtful |= {name for name in self.launcher.nodes if f"{server}/".startswith(f"{name}/")}
        self.nodes.set(server, values)

    def change_processes(self, stop: tuple[str, ...], start: tuple[str, ...]) -> None:
        """Set the wanted configuration's parameters, stop nodes, wait until they are gone, start nodes."""
        assert self._wanted is not None  # noqa: S101
        leaving = {*stop, *start}
        self._started = start
        if leaving:
            self._end_foreign_nodes()
            self._see_who_leaves(leaving)
        self._call(self._wanted, start)
        self._doubtful.clear()

    def wait_until_ready(self) -> None:
        """Wait until the started nodes answer, the topics are there, and the action's server, if it is a new one."""
        between_servers = self._goal is not None and self._goal.is_between_servers  # so an earlier manipulator left it
        if not self._started and not between_servers:
            return
        deadline = self._begun + self._ready_timeout
        for node in self._started:
            self._wait(lambda: self._is_up(node), deadline, f"node {node} is not up")  # noqa: B023
        assert self._wanted is not None  # noqa: S101
        topics = {rospy.resolve_name(topic) for topic in self._wanted.topics}
        if topics:
            what = f"not all of the topics {', '.join(sorted(topics))} are published"
            self._wait(lambda: topics <= self._published(), deadline, what)
        if self._goal is not None and (self._new_server or between_servers):
            goal = self._goal
            self._wait(lambda: goal.server_is_new, deadline, "its action server is not up")
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
        """Stop what runs, and start all of a configuration."""
        check, self.check = self.check, lambda: None  # the way back is gone to its end
        try:
            self._prepare(configuration)
            nodes = tuple(self.describe(configuration).nodes)
            running = tuple(self.launcher.nodes) if self.launcher else ()
            self.change_processes(running, nodes)
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

    def recovered(self) -> None:
        """Take in that the launcher has started dead nodes again: wait for them, and for the goal's server."""
        state = self.launcher
        if state is None:
            return
        self._begun, self._death, self._change_number = time.monotonic(), None, state.change
        self._wanted = self._settings.configurations.get(state.configuration)
        self._started = tuple(state.nodes)
        self.wait_until_ready()

    def node_died(self) -> None:
        """Take in that the launcher is about to start dead nodes again."""
        state = self.launcher
        self._new_server = False
        if self._goal is not None and state is not None:
            try:
                self._new_server = bool(publishers(self._goal.status_topic) & {*state.dead})
            except MasterError as error:
                rospy.logwarn("%s", error)
            if self._new_server:
                self._goal.server_stops()

    # -- helpers --------------------------------------------------------------------------------------------------

    @staticmethod
    def _read(configuration: Configuration) -> SystemDescription:
        try:
            return read_launch_file(configuration.launch_file, configuration.args).system
        except LaunchFileError as error:
            raise DeploymentError(str(error)) from error

    def _prepare(self, wanted: Configuration) -> None:
        self._wanted, self._change_number, self._started = wanted, None, ()
        self._death = None  # a new launcher counts its changes from the start
        self._begun = time.monotonic()
        self._new_server = self._stop_robot = False

    def _call(self, wanted: Configuration | None, start: tuple[str, ...]) -> None:
        request = ChangeConfigurationRequest(
            configuration=wanted.name if wanted else "",
            launch_file=wanted.launch_file if wanted else "",
            args=list(wanted.args) if wanted else [],
            start=list(start),
        )
        try:
            answer = self._ask(request)
        except (rospy.ServiceException, rospy.ROSException, TransportException) as error:
            raise DeploymentError(f"rosgraph_launcher did not do its part ({error}); is it running?") from error
        if not answer.ok:
            raise DeploymentError(answer.message)
        self.launcher_phases = {phase.name: phase.duration for phase in answer.phases}
        self._change_number = answer.change
        with self._news:
            self._news.wait_for(lambda: self._has_done(answer.change), STATE_TIMEOUT)

    def _ask(self, request: ChangeConfigurationRequest) -> ChangeConfigurationResponse:
        """Return the launcher's answer to a request, which is made as soon as a launcher is there.

        A launcher that is being killed may accept the connection by which `wait_for_service` finds it and refuse the
        next one, because the kernel closes its sockets one after the other. A request that reached no launcher is
        repeated. One that did is not, because a part of it may be done.
        """
        deadline = time.monotonic() + self._launcher_timeout
        while True:
            self._change.wait_for_service(max(deadline - time.monotonic(), POLL_PERIOD))
            self._begun = time.monotonic()  # the nodes have all their time, however long this took
            try:
                return self._change(request)
            except rospy.ServiceException as error:
                if not isinstance(error.__context__, _NOT_REACHED) or time.monotonic() > deadline:
                    raise
                time.sleep(POLL_PERIOD)

    def _has_done(self, change: int) -> bool:
        """Whether the launcher's topic has come as far as its answer."""
        state = self.launcher
        return state is not None and state.change == change and state.state != LauncherState.CHANGING

    def _end_foreign_nodes(self) -> None:
        """End nodes of the same function that somebody else started."""
        own = set(self.launcher.nodes) if self.launcher else set()
        for node in self._settings.kill_nodes:
            name = rospy.resolve_name(node)
            if name not in own and NodeApi.request_shutdown(name, "replaced by another configuration"):
                gone = wait_until(lambda: not NodeApi.is_answering(name), self._ready_timeout)  # noqa: B023
                if not gone:
                    raise DeploymentError(f"node {name} does not end")

    def _see_who_leaves(self, leaving: set[str]) -> None:
        """See whether the pending goal's server and the robot's last driver are among the nodes that end or start."""
        known = set(self.launcher.nodes) if self.launcher else set()
        try:
            drivers = publishers(rospy.resolve_name("cmd_vel")) - {rospy.get_name()}
            servers = publishers(self._goal.status_topic) if self._goal else set()
        except MasterError as error:
            raise DeploymentError(str(error)) from error
        self._stop_robot = bool(drivers) and drivers <= leaving & known
        if self._goal is not None:
            self._new_server = not (servers - leaving)
            if self._new_server:
                self._goal.server_stops()

    def _follow(self, state: LauncherState) -> None:
        with self._news:
            self.launcher = state
            if state.state in BROKEN:
                self._death = (state.change, state.message)
            gone = state.state == LauncherState.CHANGING and self._wanted and state.configuration == self._wanted.name
            if self._stop_robot and gone:
                self._stop_robot = False
                self.stop_robot()  # before a new driver begins
            self._news.notify_all()
        self._on_state(state)

    def _published(self) -> set[str]:
        return advertised(self.launcher.nodes if self.launcher else ())

    def _is_up(self, node: str) -> bool:
        state = self.launcher
        return NodeApi.is_answering(node) or (state is not None and node not in state.nodes)  # it has done its work

    def _wait(self, condition: Callable[[], bool], deadline: float, what: str) -> None:
        while True:
            self._raise_if_broken()
            try:
                if condition():
                    return
            except MasterError as error:
                raise DeploymentError(str(error)) from error
            if time.monotonic() > deadline:
                raise DeploymentError(f"{what} within {self._ready_timeout:g} s; see the nodes' logs")
            time.sleep(POLL_PERIOD)

    def _raise_if_broken(self) -> None:
        self.check()
        if rospy.is_shutdown():
            raise DeploymentError("the manipulator is shutting down")
        if self._death and self._death[0] == self._change_number:
            raise DeploymentError(self._death[1])
