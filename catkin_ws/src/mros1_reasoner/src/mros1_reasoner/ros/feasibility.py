"""Asks a running reasoner which functions can be fulfilled now."""

from __future__ import annotations

import rospy
from metacontrol_msgs.srv import Feasible
from node_kit.io.xml_rpc import CallError
from node_kit.ros import command

from mros1_reasoner.replay.recording import RecordingError


def feasible_now(node: str, function: str, wait: float) -> dict[str, list[str]]:
    """Return the designs by which each function can be fulfilled, the most useful first; none if it can't.

    Args:
        node: name of the reasoner.
        function: the only one to ask for; empty: all.
        wait: for the service, s.

    Raises:
        RecordingError: there is no master, no such node, or no such function.
    """
    try:
        command.join("feasible")
    except CallError as error:
        raise RecordingError(f"{error}: start roscore or set ROS_MASTER_URI") from error
    name = rospy.resolve_name(f"{node}/feasible")
    try:
        rospy.wait_for_service(name, wait)
        answer = rospy.ServiceProxy(name, Feasible)(function)
    except (OSError, rospy.ROSException, rospy.ServiceException) as error:
        raise RecordingError(f"{name} does not answer within {wait:g} s: no reasoner runs ({error})") from error
    if not answer.ok:
        raise RecordingError(answer.message)
    return {found.function: list(found.designs) for found in answer.functions}
