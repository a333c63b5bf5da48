"""Asks a running reasoner which functions can be fulfilled now."""

from __future__ import annotations

import rospy
from metacontrol_msgs.srv import Feasible
from node_kit.io.xml_rpc import CallError
from node_kit.ros import command
from node_kit.ros.services import SERVICE_FAILURES, call_within

from mros1_reasoner.replay.recording import RecordingError


def feasible_now(node: str, function: str, wait: float) -> dict[str, list[str]]:
    """Return the designs by which each function can be fulfilled, the most useful first; none if it can't.

    Args:
        node: name of the reasoner.
        function: the only one to ask for; empty: all.
        wait: for the service, s.

    Raises:
        RecordingError: there is no master, no such node, it does not answer in time, or there is no such function.
    """
    try:
        command.join("feasible")
    except CallError as error:
        raise RecordingError(f"{error}: start roscore or set ROS_MASTER_URI") from error
    name = rospy.resolve_name(f"{node}/feasible")
    try:
        answer = call_within(wait, name, Feasible, function)
    except SERVICE_FAILURES as error:
        raise RecordingError(f"{name} does not answer: no reasoner runs, or it is busy ({error})") from error
    if not answer.ok:
        raise RecordingError(answer.message)
    return {found.function: list(found.designs) for found in answer.functions}
