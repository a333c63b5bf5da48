"""A client that has the pyramid built, and watches who builds and what stands."""

import math
import unittest

import actionlib
import rospy
from geometry_msgs.msg import PoseArray
from helpers.waiting import wait_for
from metacontrol_manipulation.msg import BuildPyramidAction, BuildPyramidGoal
from metacontrol_manipulation.pick_place.pyramid import SLOTS
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding
from node_kit.ros.action_server import wait_for_server

DEADLINE = 180.0
IN_PLACE = 0.01
"""m from its slot within which a block is in place."""


class BuildingTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("building_test")
        cls.active, cls.blocks, cls.steps, cls.ended = {}, [], [], []
        cls.inputs = (
            rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, cls.take_active),
            rospy.Subscriber("ground_truth/blocks", PoseArray, cls.take_blocks),
        )
        cls.client = actionlib.ActionClient("build", BuildPyramidAction)

    @classmethod
    def take_active(cls, message):
        cls.active = {
            one.function: one.configuration for one in message.functions if one.state == FunctionGrounding.STABLE
        }

    @classmethod
    def take_blocks(cls, message):
        cls.blocks = [(p.position.x, p.position.y, p.position.z) for p in message.poses]

    def build(self):
        """Send the goal when somebody offers the action; its feedback is kept."""
        wait_for(lambda: "f_pick_place" in self.active, "a program is deployed", DEADLINE)
        self.assertTrue(wait_for_server(self.client, DEADLINE))
        self.goal = self.client.send_goal(
            BuildPyramidGoal(),
            transition_cb=lambda goal: (
                self.ended.append(goal) if goal.get_comm_state() == actionlib.CommState.DONE else 0
            ),
            feedback_cb=lambda _, feedback: self.steps.append(feedback.step),
        )

    def note_end(self, goal):
        if goal.get_comm_state() == actionlib.CommState.DONE:
            self.ended.append(goal)

    @classmethod
    def placed(cls):
        """How many slots truly have a block in place."""
        return sum(any(math.dist(slot.position, block) < IN_PLACE for block in cls.blocks) for slot in SLOTS)

    def until(self, condition, what):
        """Wait until a condition holds, and the goal is pursued meanwhile."""

        def holds():
            self.assertFalse(self.ended, f"the goal has ended; steps: {self.steps[-5:]}")
            return condition()

        wait_for(holds, lambda: f"{what}; active: {self.active}; last steps: {self.steps[-5:]}", DEADLINE)
