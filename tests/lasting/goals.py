"""The node that sends goal after goal: `python -m lasting.goals SEED` writes how each ended, a line each."""

from __future__ import annotations

import math
import os
import sys
import time
from pathlib import Path
from random import Random

import actionlib
import rospkg
import rospy
from actionlib_msgs.msg import GoalStatus
from metacontrol_experiments.mission.routes import parse_route, parse_route_names
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from node_kit.io.input_files import read_yaml
from robot_formulas.geometry import Pose, quaternion_of

from lasting.figures import REACHED

NEAREST = 5.0
"""m from one goal to the next, at least."""
LATEST = 300.0
"""ROS s after which a goal is given up."""
_OUTCOMES = {
    GoalStatus.SUCCEEDED: REACHED,
    GoalStatus.ABORTED: "aborted",
    GoalStatus.PREEMPTED: "preempted",
    GoalStatus.RECALLED: "recalled",
    GoalStatus.REJECTED: "rejected",
    GoalStatus.LOST: "lost",
}


def main() -> None:
    """Send goals until the master or the driver is gone."""
    draw = Random(sys.argv[1])
    rospy.init_node("lasting_goals", disable_signals=True)
    path = Path(rospkg.RosPack().get_path("metacontrol_sim"), "worlds/routes.yaml")
    content = read_yaml(path)
    routes = [parse_route(content, name, str(path)) for name in parse_route_names(content)]
    poses = [pose for route in routes for pose in (route.start, route.goal)]
    client = actionlib.ActionClient("move_base", MoveBaseAction)
    here = poses[0]
    while not rospy.is_shutdown() and os.getppid() != 1:
        here = draw.choice([pose for pose in poses if math.dist((pose.x, pose.y), (here.x, here.y)) >= NEAREST])
        began = time.monotonic()
        outcome = send(client, here)
        print(f"goal {outcome} {time.monotonic() - began:.1f}", flush=True)  # noqa: T201


def send(client: actionlib.ActionClient, pose: Pose) -> str:
    """Send a goal and wait for its end; return how it ended."""
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = pose.x, pose.y
    goal.target_pose.pose.orientation.z, goal.target_pose.pose.orientation.w = quaternion_of(pose.yaw)
    while not rospy.is_shutdown() and not client.wait_for_server(rospy.Duration(5.0)):
        pass
    handle = client.send_goal(goal)
    began = rospy.get_time()
    while not rospy.is_shutdown() and rospy.get_time() - began < LATEST:
        if handle.get_comm_state() == actionlib.CommState.DONE:
            status = handle.get_goal_status()
            return _OUTCOMES.get(status, f"status-{status}")
        time.sleep(0.1)
    handle.cancel()
    return "late"


if __name__ == "__main__":
    main()
