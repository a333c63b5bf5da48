#!/usr/bin/env python3
"""The monitor of a robot in a namespace: anonymous nodes, another robot beside it, deep parameters, actions."""

import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers.waiting import wait_for
from monitor_common import GraphTest, end, run, value_of

ACTION = "move_base_msgs/MoveBaseAction"
RVIZ = "/robot/rviz_1700000000"
NODES = {
    RVIZ: (),
    "/robot/arm/nav": (f"act=move:{ACTION}",),
    "/robot/task": (f"ask=arm/move:{ACTION}",),
    "/other_robot/camera": (),
}
PARAMETERS = {
    "/robot/site": "hall",
    "/robot/arm/nav": {
        "layers": ["static", "laser"],
        "radii": [0.5, 1],
        "limits": {"linear": {"max": 0.5 + 1e-9, "min": 0.1, "jerk": 3.0}, "lazy": True},
    },
}


class MonitorNamesTest(GraphTest):
    NODES = NODES

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name, value in PARAMETERS.items():
            rospy.set_param(name, value)
        cls.start_all()

    def expect_wrong(self, parameter, value, name, key, shown):
        """Set a parameter, expect it to be found wrong under that name and key, and set it back."""
        before = rospy.get_param(parameter)
        rospy.set_param(parameter, value)
        try:
            _, status = self.seen.wait_status(name, "Wrong param configuration")
            self.assertEqual((status.values[0].key, status.values[0].value), (key, shown))
            self.assertEqual(len(status.values), 2)
        finally:
            rospy.set_param(parameter, before)

    def test_anonymous_node_stands_for_the_one_of_the_model_and_so_does_the_next(self):
        end(self.nodes.pop(RVIZ))
        _, status = self.seen.wait_status("rviz", "Missing node")
        self.assertEqual(value_of(status, "actual"), "dead")
        self.seen.wait_status("rviz", "Component status", "FALSE")
        self.seen.forget()
        self.start("/robot/rviz_1700000001")
        self.seen.wait_status("rviz", "Component status", "RECOVERED")

    def test_live_table_shows_the_robot_of_its_namespace_alone(self):
        done = run("watch", "--once", "4", environment={"COLUMNS": "160", "ROS_NAMESPACE": "/robot"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("arm/nav", done.stdout)
        self.assertNotIn("camera", done.stdout)

    def test_only_nodes_of_the_namespace_that_are_not_anonymous_are_additional(self):
        tool = "/robot/tool_1700000000"
        self.start(tool)
        master = rosgraph.Master("/monitor_test")
        wait_for(lambda: any(tool in nodes for part in master.getSystemState() for _, nodes in part), "the tool")
        self.start("/robot/arm/stray")
        _, status = self.seen.wait_status("arm/stray", "Additional node")
        self.assertEqual(status.level, DiagnosticStatus.WARN)
        for name in ("/robot/arm/stray", tool):
            end(self.nodes.pop(name))
        found = {s.name for s in self.seen.all() if s.message == "Additional node"}
        self.assertEqual(found, {"arm/stray"})

    def test_list_that_differs_in_an_element_or_in_length_is_wrong(self):
        layers = "/robot/arm/nav/layers"
        self.expect_wrong(layers, ["static", "camera"], "arm/nav", "layers", "['static', 'camera']")
        self.expect_order()
        self.expect_wrong(layers, ["static"], "arm/nav", "layers", "['static']")
        self.expect_order()
        self.expect_wrong("/robot/arm/nav/radii", [0.5, 1.1], "arm/nav", "radii", "[0.5, 1.1]")

    def test_struct_that_differs_deep_inside_is_wrong(self):
        shown = str({"linear": {"max": 0.9, "min": 0.1, "jerk": 3.0}, "lazy": True})
        self.expect_wrong("/robot/arm/nav/limits/linear/max", 0.9, "arm/nav", "limits", shown)

    def test_parameter_of_the_system_is_compared_in_its_namespace(self):
        self.expect_wrong("/robot/site", "yard", "ROS Graph", "site", "yard")

    def test_action_that_nobody_serves_is_a_missing_port_and_connection(self):
        nav = "/robot/arm/nav"
        self.start(nav, "sub=move/goal:move_base_msgs/MoveBaseActionGoal")  # it listens, but serves nothing

        def lacks_server(status):  # the node's start and end have other states, which a busy monitor may see
            missing = [entry.value for entry in status.values] == ["move", "action server", "none"]
            return missing and (status.name, status.message) == ("arm/nav", "Missing port")

        self.seen.wait("missing action server", lacks_server)
        self.seen.wait_status("arm/move", "Missing connection")
        self.restore(nav)

    def test_client_of_an_action_that_is_made_for_each_goal_is_not_missed(self):
        task = "/robot/task"
        self.start(task, "pub=odd:std_msgs/String")  # it has no goal now, and differs in something else
        self.seen.wait_status("task", "Additional port", "odd")
        found = {(status.name, status.message) for status in self.seen.all()}
        self.assertTrue(found.isdisjoint({("task", "Missing port"), ("arm/move", "Missing connection")}), found)
        self.restore(task)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_names", MonitorNamesTest)
