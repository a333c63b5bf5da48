#!/usr/bin/env python3
"""A killed pair, seen from the robot: it stops by itself, and the mission comes back."""

import signal
import unittest

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Twist
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import Node
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import Odometry


class RobotTest(unittest.TestCase):
    def setUp(self):
        rospy.init_node("manipulator_robot_test")
        self.commands, self.speed, self.goals = [], 0.0, {}
        rospy.Subscriber("cmd_vel", Twist, self.commands.append)
        rospy.Subscriber("odom", Odometry, self.on_odometry)
        rospy.Subscriber("move_base/status", GoalStatusArray, self.on_status)
        self.pair = []
        self.addCleanup(lambda: [node.end() for node in self.pair])

    def on_odometry(self, message):
        twist = message.twist.twist
        self.speed = max(abs(twist.linear.x), abs(twist.linear.y), abs(twist.angular.z))

    def on_status(self, message):
        self.goals = {entry.goal_id.id: entry.status for entry in message.status_list}

    def start_pair(self):
        self.pair = [Node(name, name) for name in ("rosgraph_launcher", "rosgraph_manipulator")]

    def test_robot_stops_by_its_time_out_and_the_next_pair_brings_the_mission_back(self):
        self.start_pair()
        client = actionlib.ActionClient("move_base", MoveBaseAction)
        self.assertTrue(client.wait_for_server(rospy.Duration(DEADLINE_S)), [node.said() for node in self.pair])
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = "map"
        goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = 5.4, 6.0
        goal.target_pose.pose.orientation.w = 1.0
        handle = client.send_goal(goal)
        goal_id = handle.comm_state_machine.action_goal.goal_id.id
        wait_for(lambda: self.speed > 0.1, "the robot drives")

        for node in self.pair:
            node.end(signal.SIGKILL)
        self.commands.clear()
        wait_for(lambda: self.speed < 0.01, "the robot stands")
        self.assertNotIn(Twist(), self.commands)  # nobody has told it to

        self.goals = {}
        self.start_pair()
        wait_for(lambda: self.goals.get(goal_id) == GoalStatus.ACTIVE, "the goal is at work again")
        wait_for(lambda: self.speed > 0.1, "the robot drives on")
        self.assertEqual(handle.get_comm_state(), actionlib.CommState.ACTIVE)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_robot", RobotTest)
