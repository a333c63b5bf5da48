#!/usr/bin/env python3
"""It gets dark and light again: the camera is set for it, without a restart, and the work goes on."""

import rosnode
import rospy
import rostest
from building_harness import BuildingTest
from simulator_msgs.srv import SetLight
from std_msgs.msg import Float32


class LightTest(BuildingTest):
    def test_tags_are_found_again_in_the_dark_and_in_the_light(self):
        shares = []
        listener = rospy.Subscriber("tag_share", Float32, lambda message: shares.append(message.data))
        self.build()
        self.until(lambda: self.active.get("f_calibrate_position") == "fd2_1", "the cell is looked for")
        self.until(lambda: shares and shares[-1] == 1.0, "the tags are found")
        process = rosnode.get_api_uri(rospy.get_master(), "/tag_localizer")
        for light, design in ((0.05, "fd2_2"), (1.0, "fd2_1")):
            self.assertTrue(rospy.ServiceProxy("simulator/set_light", SetLight)(light).success)
            self.until(lambda design=design: self.active.get("f_calibrate_position") == design, f"{design} is deployed")
            self.until(lambda: shares[-1] == 1.0, f"the tags are found at light {light} by {design}")
        self.assertEqual(rosnode.get_api_uri(rospy.get_master(), "/tag_localizer"), process)
        self.assertEqual(self.active["f_pick_place"], "fd1_left")
        self.until(lambda: self.placed() > 0, "a block is placed")
        listener.unregister()


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "light", LightTest)
