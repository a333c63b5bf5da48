"""Node rosgraph_manipulator: deploys configurations on request and keeps the pending action goal."""

from __future__ import annotations

import base64
import io
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import actionlib
import rosgraph
import roslib.message
import rospy
import yaml
from actionlib_msgs.msg import GoalID, GoalStatusArray
from geometry_msgs.msg import Twist
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    FunctionGrounding,
    MvpReconfigurationAction,
    MvpReconfigurationGoal,
    MvpReconfigurationResult,
)
from metacontrol_msgs.srv import LaunchConfiguration, StopConfiguration
from std_msgs.msg import String

from rosgraph_manipulator.configuration import Configuration, ConfigurationError, Settings, parse_settings
from rosgraph_manipulator.deployment import DeploymentError, Outcome, Result, deploy
from rosgraph_manipulator.goal_keeper import GoalKeeper
from rosgraph_manipulator.master import NodeApi

POLL_PERIOD = 0.02  # s, wall
KEYS = ("configurations", "kill_nodes", "save_action", "goal_msg_type", "reconfiguration_action_name")


def wait_until(condition: Callable[[], bool], timeout: float) -> bool:
    """Wait, in wall time, for a condition; return whether it came to hold within `timeout` seconds."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline or rospy.is_shutdown():
            return False
        time.sleep(POLL_PERIOD)
    return True


class PendingGoal:
    """Carries the pending goal of an action over to a new server."""

    def __init__(self, action: str, action_type: str) -> None:
        self._action = action
        self._goal_type = action_type + "Goal"
        self._keeper = GoalKeeper()
        self._lock = threading.Lock()
        self._status_count = 0
        self._server_goals: frozenset[str] = frozenset()
        goal_class = _message_class(self._goal_type)
        result_class = _message_class(action_type + "Result")
        self._goal_publisher = rospy.Publisher(f"{action}/goal", goal_class, queue_size=1)
        self._cancel_publisher = rospy.Publisher(f"{action}/cancel", GoalID, queue_size=1)
        rospy.Subscriber(f"{action}/goal", goal_class, self._locked(self._keeper.on_goal), queue_size=10)
        rospy.Subscriber(f"{action}/result", result_class, self._locked(self._keeper.on_result), queue_size=10)
        rospy.Subscriber(f"{action}/cancel", GoalID, self._locked(self._keeper.on_cancel), queue_size=10)
        rospy.Subscriber(f"{action}/status", GoalStatusArray, self._locked(self._on_status), queue_size=10)

    def before_stop(self) -> None:
        """Note that the server is about to be stopped."""
        with self._lock:
            self._keeper.server_changes(True)

    def hand_over(self) -> int:
        """Leave the goal where a new server finds it at its start; return the count of status messages so far."""
        with self._lock:
            goal = self._keeper.pending
            parameter = f"{self._action}/resume_goal"
            if goal is not None:
                buffer = io.BytesIO()
                goal.serialize(buffer)
                data = base64.b64encode(buffer.getvalue()).decode("ascii")
                rospy.set_param(parameter, {"type": self._goal_type, "data": data})
            elif rospy.has_param(parameter):
                rospy.delete_param(parameter)
            return self._status_count

    def server_is_up(self, status_count: int) -> bool:
        """Tell whether a new server has published its status since `hand_over`."""
        return self._status_count > status_count

    def after_start(self) -> None:
        """Send the goal again where the new server did not take it over, and tell it what was cancelled meanwhile."""
        with self._lock:
            self._keeper.server_changes(False)
            goal = self._keeper.pending
            strays = self._server_goals - {self._keeper.pending_id}
            if goal is not None and goal.goal_id.id not in self._server_goals:
                rospy.loginfo("sending the pending goal %s to the new server of %s", goal.goal_id.id, self._action)
                self._goal_publisher.publish(goal)
        for goal_id in strays:
            self._cancel_publisher.publish(GoalID(id=goal_id))

    def _on_status(self, status: GoalStatusArray) -> None:
        self._keeper.on_status(status)
        self._server_goals = frozenset(entry.goal_id.id for entry in status.status_list if entry.status <= 1)
        self._status_count += 1

    def _locked(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        def locked(message: Any) -> None:
            with self._lock:
                callback(message)

        return locked


class RosPlatform:
    """What a deployment needs of the running ROS system (the Platform of `deploy`)."""

    def __init__(self, settings: Settings) -> None:
        self._kill_nodes = settings.kill_nodes
        self._ready_timeout = float(rospy.get_param("~ready_timeout", 15.0))  # s, wall, from start to ready
        self._service_timeout = float(rospy.get_param("~launcher_timeout", 10.0))  # s, wall, to find the launcher
        self._goal = PendingGoal(settings.save_action, str(settings.action_type)) if settings.save_action else None
        self._launch = rospy.ServiceProxy("rosgraph_launcher/launch", LaunchConfiguration)
        self._stop = rospy.ServiceProxy("rosgraph_launcher/stop", StopConfiguration)

    def stop(self) -> None:
        """Stop the running configuration, and nodes of the same function that somebody else started."""
        if self._goal:
            self._goal.before_stop()
        answer = self._call(self._stop, name="")
        if not answer.ok:
            raise DeploymentError(f"stopping failed: {answer.message}")
        for node in self._kill_nodes:
            name = rospy.resolve_name(node)
            if NodeApi.is_answering(name):
                NodeApi.request_shutdown(name, "replaced by another configuration")
                if not wait_until(partial(_is_gone, name), self._ready_timeout):
                    raise DeploymentError(f"node {name} does not end")

    def start(self, configuration: Configuration) -> None:
        """Start the nodes; wait until each answers and the action server, if one is kept, is up with its goal."""
        status_count = self._goal.hand_over() if self._goal else 0
        answer = self._call(
            self._launch,
            name=configuration.name,
            launch_file=configuration.launch_file,
            args=list(configuration.args),
        )
        if not answer.ok:
            raise DeploymentError(answer.message)
        deadline = time.monotonic() + self._ready_timeout
        for node in answer.nodes:
            if not wait_until(partial(NodeApi.is_answering, node), deadline - time.monotonic()):
                raise DeploymentError(f"node {node} is not up within {self._ready_timeout:g} s; see its log")
        if self._goal:
            goal = self._goal
            if not wait_until(lambda: goal.server_is_up(status_count), deadline - time.monotonic()):
                raise DeploymentError(f"its action server is not up within {self._ready_timeout:g} s")
            goal.after_start()

    def _call(self, service: rospy.ServiceProxy, **request: Any) -> Any:
        try:
            service.wait_for_service(self._service_timeout)
            return service(**request)
        except (rospy.ServiceException, rospy.ROSException) as error:
            raise DeploymentError(f"rosgraph_launcher did not do its part ({error}); is it running?") from error


class Manipulator:
    """The action server, and what is known to run."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._platform = RosPlatform(settings)
        self._lock = threading.RLock()  # one deployment at a time
        self._running: Configuration | None = None
        self._launcher_runs: str | None = None  # None until the launcher has said so
        self._active = rospy.Publisher(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=5, latch=True
        )
        self._cmd_vel = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        rospy.Subscriber("rosgraph_launcher/running", String, self._on_launcher_state, queue_size=5)
        self._server = actionlib.SimpleActionServer(
            settings.reconfiguration_action_name, MvpReconfigurationAction, self._execute, auto_start=False
        )

    def start(self, initial: Configuration | None) -> None:
        """Take over what the launcher runs already, else deploy the initial configuration; then serve requests."""
        timeout = float(rospy.get_param("~launcher_timeout", 10.0))
        if not wait_until(lambda: self._launcher_runs is not None, timeout):
            rospy.logwarn("rosgraph_launcher is not there; start it beside this node: nothing can be deployed without")
        running = self._settings.configurations.get(self._launcher_runs or "")
        if running:
            self._running = running
            self._announce(running, FunctionGrounding.STABLE)
            rospy.loginfo("took over the running configuration %s", running.name)
        elif initial:
            self._deploy(initial)
        self._server.start()

    def _execute(self, goal: MvpReconfigurationGoal) -> None:
        name = goal.desired_configuration_name
        wanted = self._settings.configurations.get(name)
        if wanted is None:
            message = f"unknown configuration '{name}'; known are: {', '.join(sorted(self._settings.configurations))}"
            rospy.logerr("%s", message)
            self._server.set_aborted(MvpReconfigurationResult(Result.UNKNOWN), message)
            return
        outcome = self._deploy(wanted)
        result = MvpReconfigurationResult(int(outcome.result))
        if outcome.result is Result.OK:
            self._server.set_succeeded(result, outcome.message)
        else:
            self._server.set_aborted(result, outcome.message)

    def _deploy(self, wanted: Configuration) -> Outcome:
        with self._lock:
            if wanted == self._running:
                return Outcome(Result.OK, wanted, f"{wanted.name} runs already")
            began = time.monotonic()
            self._announce(wanted, FunctionGrounding.RECONFIGURING)
            try:
                outcome = deploy(self._platform, wanted, self._running)
            except (rospy.ROSException, rosgraph.MasterException, OSError) as error:
                outcome = Outcome(Result.GENERAL_ERROR, None, f"{wanted.name}: {error}")
            self._running = outcome.running
            if outcome.running:
                self._announce(outcome.running, FunctionGrounding.STABLE)
            else:
                self._cmd_vel.publish(Twist())
                self._announce(wanted, FunctionGrounding.FAILED)
            log = rospy.loginfo if outcome.result is Result.OK else rospy.logerr
            log("%s (%.2f s)", outcome.message, time.monotonic() - began)
            return outcome

    def _announce(self, configuration: Configuration, state: str) -> None:
        message = ActiveConfiguration(functions=[FunctionGrounding(configuration.function, configuration.name, state)])
        message.header.stamp = rospy.Time.now()
        self._active.publish(message)

    def _on_launcher_state(self, message: String) -> None:
        """Bring the configuration back when the launcher was restarted and runs nothing."""
        self._launcher_runs = message.data
        if message.data or not self._lock.acquire(blocking=False):
            return  # something runs, or a change is under way
        lost, self._running = self._running, None
        self._lock.release()
        if lost:
            rospy.logwarn("rosgraph_launcher came back without %s: deploying it again", lost.name)
            threading.Thread(target=self._deploy, args=(lost,), daemon=True).start()


def _is_gone(node: str) -> bool:
    return not NodeApi.is_answering(node)


def _message_class(name: str) -> Any:
    message_class = roslib.message.get_message_class(name)
    if message_class is None:
        raise ConfigurationError(f"parameter 'goal_msg_type': message type {name} is not installed")
    return message_class


def _read_parameters(arguments: list[str]) -> dict[str, Any]:
    """Read the configuration from the file named by the first argument, else from parameters.

    As published, a file's keys become parameters of the node's namespace too.
    """
    if arguments:
        try:
            with open(arguments[0], encoding="utf-8") as file:
                content = yaml.safe_load(file)
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigurationError(f"{arguments[0]}: cannot be read: {error}") from error
        except yaml.YAMLError as error:
            raise ConfigurationError(f"{arguments[0]}: is not YAML: {' '.join(str(error).split())}") from error
        if not isinstance(content, dict):
            raise ConfigurationError(f"{arguments[0]}: expected keys such as 'configurations', found none")
        for key, value in content.items():
            rospy.set_param(key, value)
        return content
    return {key: rospy.get_param(f"~{key}", rospy.get_param(key, None)) for key in KEYS}


def main() -> None:
    """Run the node; exit status 2 when its configuration cannot be used."""
    try:
        rospy.init_node("rosgraph_manipulator")
        settings = parse_settings(_read_parameters(rospy.myargv()[1:]))
        initial = None
        name = rospy.get_param("~initial_configuration", "")
        if name:
            initial = settings.configurations.get(name)
            if initial is None:
                known = ", ".join(sorted(settings.configurations))
                raise ConfigurationError(f"parameter '~initial_configuration' is '{name}'; known are: {known}")
        manipulator = Manipulator(settings)
    except (ConfigurationError, rospy.ROSInitException) as error:
        sys.stderr.write(f"rosgraph_manipulator: {' '.join(str(error).split())}\n")
        sys.exit(2)
    manipulator.start(initial)
    rospy.spin()
