"""Time of a reconfiguration of D2 by restart: from the manipulator's goal to the navigation goal active again."""

from __future__ import annotations

import os
import statistics
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from metacontrol_experiments.processes import ProcessTree, free_port, wait_until
from metacontrol_msgs.msg import MvpReconfigurationAction, MvpReconfigurationGoal
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

_CHANGES = 20
_CONFIGURATIONS = ("f2_v1_r1", "f2_v1_r2")  # slow, so that the goal stays pending
_DEADLINE_S = 60.0
_PAPER_S = 4.3  # mean time of a reconfiguration in the paper


def run() -> list[dict[str, Any]]:
    """Return the entry `reconfigure_restart`: the median in s, wall, at real-time factor 1."""
    port = free_port()
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    with tempfile.TemporaryDirectory() as folder:
        logs = Path(folder)
        tree = ProcessTree({"ROS_MASTER_URI": os.environ["ROS_MASTER_URI"], "ROS_LOG_DIR": folder, "ROS_HOME": folder})
        try:
            command = ["roslaunch", "-p", str(port), "metacontrol_sim", "MVP_metacontrol_world.launch"]
            tree.start([*command, f"nav_profile:={_CONFIGURATIONS[0]}"], logs / "console.log")
            times = _measure()
        finally:
            rospy.signal_shutdown("measured")
            tree.close()
    return [
        {
            "name": "reconfigure_restart",
            "value": statistics.median(times),
            "unit": "s",
            "peer": "published system (paper, another machine)",
            "peer_value": _PAPER_S,
            "ratio": _PAPER_S / statistics.median(times),
            "samples": len(times),
        }
    ]


def _measure() -> list[float]:
    if not wait_until(_master_answers, _DEADLINE_S):
        raise RuntimeError("the master did not come up")
    rospy.init_node("bench_reconfigure", disable_signals=True, anonymous=True)
    active: dict[str, float] = {}  # goal id -> monotonic time of the last status that had it active
    changed = threading.Condition()

    def on_status(message: GoalStatusArray) -> None:
        with changed:
            for entry in message.status_list:
                if entry.status == GoalStatus.ACTIVE:
                    active[entry.goal_id.id] = time.monotonic()
            changed.notify_all()

    rospy.Subscriber("move_base/status", GoalStatusArray, on_status)
    manipulator = actionlib.SimpleActionClient("rosgraph_manipulator_action_server", MvpReconfigurationAction)
    navigation = actionlib.ActionClient("move_base", MoveBaseAction)
    if not (manipulator.wait_for_server(rospy.Duration(_DEADLINE_S)) and wait_until(_navigation_is_up, _DEADLINE_S)):
        raise RuntimeError("the system did not come up")
    navigation.wait_for_server(rospy.Duration(_DEADLINE_S))
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = 5.4, 6.0
    goal.target_pose.pose.orientation.w = 1.0
    handle = navigation.send_goal(goal)
    goal_id = handle.comm_state_machine.action_goal.goal_id.id
    if not wait_until(lambda: goal_id in active, _DEADLINE_S):
        raise RuntimeError("the navigation goal was not accepted")
    times = []
    for number in range(_CHANGES):
        began = time.monotonic()
        manipulator.send_goal(MvpReconfigurationGoal(_CONFIGURATIONS[(number + 1) % 2]))
        if not manipulator.wait_for_result(rospy.Duration(_DEADLINE_S)) or manipulator.get_result().result != 1:
            raise RuntimeError(f"a reconfiguration failed: {manipulator.get_goal_status_text()}")
        with changed:  # the manipulator has answered, so a status that comes now is the new server's
            if not changed.wait_for(lambda: active.get(goal_id, 0.0) > began, _DEADLINE_S):  # noqa: B023
                raise RuntimeError("the goal was lost")
        times.append(time.monotonic() - began)
    return times


def _master_answers() -> bool:
    try:
        return bool(rospy.get_master().getPid())
    except OSError:
        return False


def _navigation_is_up() -> bool:
    return any(topic == "/move_base/status" for topic, _ in rospy.get_published_topics())
