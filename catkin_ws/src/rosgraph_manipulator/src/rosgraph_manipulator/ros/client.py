"""Client of manipulator and launcher: what the commands read from them, and the request that they send."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import actionlib
import rosgraph
import rospy
from actionlib import CommState
from actionlib_msgs.msg import GoalID, GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags import ownership
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    ChangeFunctionAction,
    ChangeFunctionGoal,
    LaunchedFunctions,
    MvpReconfigurationAction,
    MvpReconfigurationGoal,
)
from metacontrol_msgs.msg import DiagnosticWords as Words
from node_kit.io.background import in_background
from node_kit.io.xml_rpc import CallError, GoneError
from node_kit.ros import command
from node_kit.ros.action_server import wait_for_server
from rosgraph_launcher.io.master import NodeApi

from rosgraph_manipulator.change.journal import parse_journal
from rosgraph_manipulator.configuration.configurations import DEFAULT_FUNCTION, KEYS, ManipulatorOptions
from rosgraph_manipulator.io.master import publishers
from rosgraph_manipulator.ros.launcher_reports import TOPIC
from rosgraph_manipulator.ros.requests import CHANGE_FUNCTION

FIND_TIMEOUT = 5.0  # s, wall, to find the manipulator
_HEAR_PERIOD = 0.01  # s, wall, between two looks at what launchers have told
_LOOK_PERIOD = 0.1  # s, wall, after which a shutdown is seen
NODE = "rosgraph_manipulator"
_MONITOR = "rosgraph_monitor"
_MONITOR_TIMEOUT = 2.0  # s, wall, for a look of the monitor at the graph


class ClientError(Exception):
    """Manipulator or master can't be reached; the message says what to do."""


@dataclass(frozen=True)
class Answer:
    """How a request ended.

    Attributes:
        done: whether what was asked for is done.
        result: one of metacontrol_msgs/ReconfigurationResult; None: the action ended without one.
        text: why, in one line.
    """

    done: bool
    result: int | None
    text: str


def join(name: str) -> bool:
    """Become an anonymous node; return False where there is no master.

    Raises:
        ClientError: the master does not answer.
    """
    try:
        command.join(name)
    except GoneError:
        return False
    except CallError as error:
        raise ClientError(f"{error}: start roscore or set ROS_MASTER_URI") from error
    return True


def join_or_refuse(name: str) -> None:
    """Become an anonymous node.

    Raises:
        ClientError: there is no master, or it does not answer.
    """
    if not join(name):
        raise ClientError(f"no ROS master answers at {rosgraph.get_master_uri()}: start roscore or set ROS_MASTER_URI")


def manipulator_parameters() -> dict[str, Any]:
    """Return the running manipulator's parameters; None stands for those that are not set."""
    return {key: _parameter(key) for key in KEYS}


def _parameter(key: str) -> Any:
    """Return a parameter of the manipulator, which may be private or one of its namespace; None: it is not set."""
    return rospy.get_param(f"{NODE}/{key}", rospy.get_param(key, None))


def request(configuration: str, restart: Sequence[str] = ()) -> Answer:
    """Ask the manipulator for a configuration, and wait for the result; Ctrl-C takes the request back.

    Args:
        configuration: its name.
        restart: nodes of it to restart even if they do not differ.

    Raises:
        ClientError: no manipulator answers, or nobody knows the function of the configuration.
    """
    if not restart:
        action = _parameter("reconfiguration_action_name") or ManipulatorOptions.reconfiguration_action_name
        return _ask(str(action), MvpReconfigurationAction, MvpReconfigurationGoal(configuration))
    known = manipulator_parameters()["configurations"] or {}
    if configuration not in known:
        raise ClientError(f"unknown configuration '{configuration}'; known are: {', '.join(sorted(known))}")
    function = known[configuration].get("function", DEFAULT_FUNCTION)
    goal = ChangeFunctionGoal(function=function, configuration=configuration, restart=list(restart))
    return _ask(CHANGE_FUNCTION, ChangeFunctionAction, goal)


def release(function: str) -> Answer:
    """Ask the manipulator to release a function, and wait for the result; Ctrl-C takes the request back.

    Raises:
        ClientError: no manipulator answers.
    """
    return _ask(CHANGE_FUNCTION, ChangeFunctionAction, ChangeFunctionGoal(function=function))


def _ask(action: str, kind: Any, goal: Any) -> Answer:
    client = actionlib.ActionClient(action, kind)
    if not wait_for_server(client, FIND_TIMEOUT):
        raise ClientError(f"no manipulator answers at {rospy.resolve_name(action)}: start rosgraph_manipulator")
    done = threading.Event()
    # SimpleActionClient has no handle until the goal is sent, and drops what the server has answered by then.
    handle = client.send_goal(goal, lambda goal: done.set() if goal.get_comm_state() == CommState.DONE else None)
    try:
        _wait_for(done)
    except KeyboardInterrupt:
        client.pub_cancel.publish(GoalID(id=handle.comm_state_machine.action_goal.goal_id.id))
        _wait_for(done)
    result = handle.get_result()
    return Answer(
        done=handle.get_goal_status() == GoalStatus.SUCCEEDED,
        result=result.result if result is not None else None,
        text=handle.get_goal_status_text(),
    )


def _wait_for(done: threading.Event) -> None:
    while not done.wait(_LOOK_PERIOD) and not rospy.is_shutdown():
        pass


def active_configuration() -> ActiveConfiguration | None:
    """Return what the manipulator has deployed; None where it does not say."""
    return _latest(f"{NODE}/active_configuration", ActiveConfiguration)


def failures() -> dict[str, str]:
    """Return why nothing runs for a function, for each function that has failed, even if it was released since."""
    return dict(parse_journal(rospy.get_param(f"{NODE}/journal", None)).failures)


def launched_functions() -> dict[str, LaunchedFunctions]:
    """Return what each launcher runs, by the launcher's name, as far as they say.

    One that has died stays registered, so a launcher that does not answer is not waited for.

    Raises:
        ClientError: the master does not answer.
    """
    found: dict[str, LaunchedFunctions] = {}
    subscriber = rospy.Subscriber(
        TOPIC, LaunchedFunctions, lambda message: found.update({message._connection_header["callerid"]: message})
    )
    deadline = time.monotonic() + FIND_TIMEOUT
    try:
        awaited = publishers(subscriber.resolved_name)
    except CallError as error:
        raise ClientError(str(error)) from error
    answers = {name: in_background(partial(NodeApi.answer, name), f"ask {name}") for name in awaited}
    while time.monotonic() < deadline:
        silent = {name for name, answer in answers.items() if answer.done() and answer.result() is None}
        if found and awaited <= found.keys() | silent:
            break
        time.sleep(_HEAR_PERIOD)
    subscriber.unregister()
    return dict(sorted(found.items()))


class MonitorListener:
    """Hears from the monitor which components have failed."""

    def __init__(self) -> None:
        """Subscribe: the monitor tells at each of its looks at the graph."""
        self._failed: dict[str, str] | None = None
        self._subscriber = rospy.Subscriber(ownership.TOPIC, DiagnosticArray, self._receive, queue_size=100)

    def failed(self) -> dict[str, str]:
        """Return the components that have failed, and why as far as it is known; none where no monitor tells.

        Raises:
            ClientError: the master does not answer.
        """
        name = rospy.resolve_name(_MONITOR)
        try:
            runs = name in publishers(self._subscriber.resolved_name) and NodeApi.answer(name) is not None
        except CallError as error:
            raise ClientError(str(error)) from error
        deadline = time.monotonic() + _MONITOR_TIMEOUT
        while runs and self._failed is None and time.monotonic() < deadline:
            time.sleep(_HEAR_PERIOD)
        self._subscriber.unregister()
        return self._failed or {}

    def _receive(self, message: DiagnosticArray) -> None:
        publisher = message._connection_header["callerid"]
        told = [status for status in message.status if status.message == Words.COMPONENT_STATUS and status.values]
        if told and publisher == rospy.resolve_name(_MONITOR):
            values = {status.values[0].key: status.values for status in told}
            self._failed = {
                name: next((pair.value for pair in pairs[1:] if pair.key == Words.REASON), "")
                for name, pairs in values.items()
                if pairs[0].value == Words.COMPONENT_FALSE
            }


def _latest(topic: str, kind: Any) -> Any:
    try:
        return rospy.wait_for_message(topic, kind, FIND_TIMEOUT)
    except rospy.ROSException:
        return None
