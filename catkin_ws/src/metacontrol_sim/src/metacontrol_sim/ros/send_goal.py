"""Node send_goal: sends move_base the goal of a YAML file, once its action server is up."""

from __future__ import annotations

import math
from pathlib import Path

import rospy
from actionlib_msgs.msg import GoalStatusArray
from geometry_msgs.msg import PoseStamped
from node_kit.io.input_files import InputFileError, read_yaml
from node_kit.one_line import OneLineError
from node_kit.ros.lifetime import Lifetime


class GoalFileError(OneLineError):
    """The goal file cannot be used; the message names the file, the place and the remedy."""


def read_goal(path: Path) -> PoseStamped:
    """Read `header.frame_id` and `pose` (position in m, orientation as a quaternion).

    Raises:
        GoalFileError: the file cannot be read, or lacks a finite number.
    """
    try:
        content = read_yaml(path)
    except InputFileError as error:
        raise GoalFileError(str(error)) from error
    goal = PoseStamped()
    try:
        goal.header.frame_id = str(content["header"]["frame_id"])
        for part, target in (("position", goal.pose.position), ("orientation", goal.pose.orientation)):
            for axis in target.__slots__:
                value = float(content["pose"][part][axis])
                if not math.isfinite(value):
                    raise GoalFileError(f"{path}: pose.{part}.{axis} is {value}; give a finite number")
                setattr(target, axis, value)
    except (KeyError, TypeError, ValueError) as error:
        raise GoalFileError(
            f"{path}: {error} is missing or no number; expected header.frame_id, pose.position "
            "{x, y, z} and pose.orientation {x, y, z, w}"
        ) from error
    return goal


def main() -> None:
    """Run the node; exit status 2 when the file cannot be used."""
    with Lifetime("send_goal", GoalFileError) as life:
        life.start()
        arguments = rospy.myargv()[1:]
        if len(arguments) != 1:
            raise GoalFileError("give one argument: the YAML file of the goal")
        goal = read_goal(Path(arguments[0]))
        publisher = rospy.Publisher("move_base_simple/goal", PoseStamped, queue_size=1, latch=True)
        rospy.wait_for_message("move_base/status", GoalStatusArray)
        goal.header.stamp = rospy.Time.now()
        publisher.publish(goal)
        rospy.spin()
