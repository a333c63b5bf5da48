"""Servers of actions that go on with the goal of an earlier one: see `node_kit.takeover`."""

from __future__ import annotations

import contextlib
from typing import Any

import genpy
import rospy

from node_kit.takeover import TakeoverError, decode_parameter


def take_resumed_goal(action: str, goal_class: Any) -> Any:
    """Return the goal to take over, from the parameter `ACTION/resume_goal`.

    `start_with` deletes the parameter, which is meant for one start only. Until then it stays: a server that is killed
    while it starts has taken over nothing, and the next one does.

    Args:
        action: name of the action.
        goal_class: of its action goals, such as MoveBaseActionGoal.

    Returns:
        The action goal; None where there is none, or one that can't be used, which the log tells.
    """
    name = rospy.resolve_name(f"{action}/resume_goal")
    try:
        value = rospy.get_param(name)
    except KeyError:
        return None
    try:
        goal = goal_class().deserialize(decode_parameter(value, goal_class._type))
    except (TakeoverError, genpy.DeserializationError) as error:
        rospy.logwarn("%s ignored: %s", name, error)
        _delete(name)
        return None
    rospy.loginfo("Taking over goal %s", goal.goal_id.id)
    return goal


def start_with(server: Any, goal: Any) -> None:
    """Start a server as its `start` does, but its first status already holds a goal that it has taken over.

    Args:
        server: an ActionServer of actionlib that was made with `auto_start=False`; of a SimpleActionServer, its
            `action_server`. This package does not need actionlib itself.
        goal: the action goal; None where there is none.
    """
    with server.lock:
        server.initialize()
        server.started = True
        if goal is not None:
            _delete(rospy.resolve_name(f"{server.ns}/resume_goal"))  # before it can do harm again
            server.internal_goal_callback(goal)
        server.publish_status()


def _delete(name: str) -> None:
    with contextlib.suppress(KeyError):
        rospy.delete_param(name)
