"""Servers of actions that go on with the goal of an earlier one: see `node_kit.takeover`."""

from __future__ import annotations

import contextlib
import threading
from typing import Any

import genpy
import rospy

from node_kit.takeover import TakeoverError, decode_parameter


def take_resumed_goal(action: str, goal_class: Any) -> Any:
    """Return the goal to take over, from the parameter `ACTION/resume_goal`.

    The parameter stays until the goal ends: where the server is killed before, the next one goes on with the goal.

    Args:
        action: name of the action.
        goal_class: of its action goals, such as MoveBaseActionGoal.

    Returns:
        The action goal; None where there is none, or one that can't be used, which the log tells.
    """
    name = _parameter(action)
    try:
        value = rospy.get_param(name)
    except KeyError:
        return None
    try:
        goal = goal_class().deserialize(decode_parameter(value, goal_class._type))
    except (TakeoverError, genpy.DeserializationError) as error:
        rospy.logwarn("%s ignored: %s", name, error)
        with contextlib.suppress(KeyError):
            rospy.delete_param(name)
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
            _delete_at_its_end(server, goal)
            server.internal_goal_callback(goal)
        server.publish_status()


def _delete_at_its_end(server: Any, goal: Any) -> None:
    """Have the parameter deleted when a server publishes the goal's result."""
    publish = server.publish_result

    def publish_result(status: Any, result: Any) -> None:
        publish(status, result)
        if status.goal_id.id == goal.goal_id.id:
            with contextlib.suppress(RuntimeError):  # there is no thread to be had
                threading.Thread(target=_delete_goal, args=(_parameter(server.ns), goal), daemon=True).start()

    server.publish_result = publish_result


def _delete_goal(name: str, goal: Any) -> None:
    """Delete the parameter if it has this goal, and no later one."""
    with contextlib.suppress(KeyError, TakeoverError, genpy.DeserializationError, rospy.ROSException, OSError):
        kept = type(goal)().deserialize(decode_parameter(rospy.get_param(name), goal._type))
        if kept.goal_id.id == goal.goal_id.id:
            rospy.delete_param(name)


def _parameter(action: str) -> str:
    return str(rospy.resolve_name(f"{action}/resume_goal"))
