#!/usr/bin/env python3
"""An arm meets an obstacle: the other one goes on, functions are grounded for it, and released in the end."""

import rospy
import rostest
from building_harness import BuildingTest
from simulator_msgs.srv import DeleteObstacle, SpawnObstacle, SpawnObstacleRequest
from std_srvs.srv import Trigger

WALL = SpawnObstacleRequest(name="wall", x=-0.25, y=0.16, length=0.3, width=0.02, height=0.6)


class ArmStoppedTest(BuildingTest):
    def test_the_other_arm_goes_on_and_both_when_the_first_one_is_free_again(self):
        self.build()
        self.assertEqual(self.active, {"f_pick_place": "fd2"})
        self.until(
            lambda: any(step.startswith("Place(arm='left'") for step in self.steps), "the left arm places a block"
        )
        answer = rospy.ServiceProxy("simulator/spawn_obstacle", SpawnObstacle)(WALL)
        self.assertTrue(answer.success, answer.message)

        wanted = {"f_pick_place": "fd1_right", "f_move_position": "fd1_1", "f_calibrate_position": "fd2_1"}
        self.until(lambda: self.active == wanted, "the right arm takes over")
        rospy.ServiceProxy("simulator/delete_obstacle", DeleteObstacle)("wall")
        begun, stood = len(self.steps), self.placed()
        self.until(lambda: self.placed() > stood, "the right arm places a block")
        self.assertFalse(
            [step for step in self.steps[begun:] if step.startswith(("Pick(arm='left'", "Place(arm='left'"))]
        )

        freed = rospy.ServiceProxy("left_arm/release", Trigger)()
        self.assertTrue(freed.success, freed.message)
        self.until(lambda: self.active == {"f_pick_place": "fd2"}, "both arms take over again")
        stood = self.placed()
        self.until(lambda: self.placed() > stood, "both arms place a block")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "arm_stopped", ArmStoppedTest)
