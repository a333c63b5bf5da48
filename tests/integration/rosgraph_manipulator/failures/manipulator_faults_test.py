#!/usr/bin/env python3
"""Configurations that can't be started: the running one is left alone or restored."""

import os
import shutil
import socket
import tempfile
from pathlib import Path

import rospy
import rostest
from geometry_msgs.msg import Twist
from helpers.cases import case
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import (
    CONFIGURATIONS,
    SERVER,
    PairTest,
    configuration,
    is_alive,
    pid_of,
    words_of,
)
from metacontrol_msgs.msg import LaunchedFunctions, MvpReconfigurationGoal, NodeDescription
from metacontrol_msgs.srv import ChangeNodes, ChangeNodesRequest, StandBy

FOLDER = tempfile.mkdtemp()
GATE = Path(FOLDER) / "gate"


def own_file(name):
    path = shutil.copy(SERVER, Path(FOLDER) / name)
    return {"function": "f_wait", "launch": str(path), "args": [f"period:={name.split('.')[0]}"]}


class FaultsTest(PairTest):
    manipulator_parameters = {"ready_timeout": 30.0, "settle_time": 2.0}

    @classmethod
    def setUpClass(cls):
        cls.occupied = socket.create_server(("127.0.0.1", 0))
        cls.addClassCleanup(shutil.rmtree, FOLDER)
        cls.addClassCleanup(cls.occupied.close)
        port = cls.occupied.getsockname()[1]
        cls.configurations = {
            **CONFIGURATIONS,
            "port": configuration(args=f"--port {port}"),
            "vanishes": own_file("vanishes.launch"),
            "breaks": own_file("breaks.launch"),
            "gated": configuration(period="gated", args=f"--waits-for {GATE}"),
        }
        # What nodes write there meets a full disk.
        logs = Path(FOLDER) / "log"
        logs.mkdir()
        for name in ("wait_server.log", "wait_server-stdout.log"):
            (logs / name).symlink_to("/dev/full")
        cls.configurations["full"] = configuration(output="log", period="full")
        cls.environment = {"ROS_LOG_DIR": str(logs)}
        super().setUpClass()

    def setUp(self):
        self.assertEqual(self.request("slow"), 1, self.manipulator.said())

    def test_what_cannot_be_started_leaves_the_running_nodes_untouched(self):
        Path(self.configurations["vanishes"]["launch"]).unlink()
        before = pid_of("/wait_server")
        for name, words in (
            ("malformed", "well-formed"),
            ("undefined", "'no_such_argument' is not defined"),
            ("no_node", "no_such_node"),
            ("no_package", "no_such_package"),
            ("vanishes", "vanishes"),
        ):
            with case(name):
                self.assertEqual(self.request(name), 0)
                self.assertIn(words, self.text)
                self.wait_for_state("slow")
        # Each was refused before anything was stopped, or the way back led to the same nodes.
        self.assertTrue(is_alive(before))
        self.assertEqual(pid_of("/wait_server"), before)

    def test_unknown_name_is_refused(self):
        self.assertEqual(self.request("no_such_configuration"), -1)
        self.assertIn("no_such_configuration", self.text)

    def test_nobody_else_has_the_launcher_start_programs(self):
        mark = Path(FOLDER) / "mark"
        own = {"namespace": "/", "package": "rosgraph_manipulator", "executable": "status"}
        node = NodeDescription(name="/stranger", launch_prefix=f"touch {mark}", **own)
        change = rospy.ServiceProxy("rosgraph_launcher/change", ChangeNodes)
        answer = change(ChangeNodesRequest("f_stranger", "any", [node], [], ["/stranger"], "0" * 64))
        self.assertFalse(answer.ok)
        self.assertIn("has another signature than this host's", answer.message)
        stand_by = rospy.ServiceProxy("rosgraph_launcher/stand_by", StandBy)
        with self.assertRaisesRegex(rospy.ServiceException, "is not signed"):
            stand_by([node], "")
        self.assertFalse(mark.exists())
        self.wait_for_state("slow")

    def test_report_of_a_stranger_changes_nothing(self):
        stranger = rospy.Publisher("rosgraph_launcher/functions", LaunchedFunctions, queue_size=1, latch=True)
        self.addCleanup(stranger.unregister)
        stranger.publish(LaunchedFunctions(functions=[self.launcher_state]))  # as the replay of a bag does
        wait_for(lambda: f"reports of {rospy.get_name()} are left out" in self.manipulator.said(), "it is heard")
        self.assertEqual(self.request("fast"), 1, self.text)
        self.wait_for_state("fast")

    def test_parameters_that_somebody_changes_while_their_node_starts_are_put_back(self):
        self.addCleanup(GATE.touch)
        self.client.send_goal(MvpReconfigurationGoal("gated"))
        wait_for(lambda: rospy.get_param("/wait_server/period", "") == "gated", "they are set")
        wait_for(lambda: self.waits_at_gate() and pid_of("/wait_server") is None, "the node has begun")
        rospy.set_param("/wait_server/period", "other")
        wait_for(lambda: rospy.get_param("/wait_server/period") == "gated", "they are put back")
        rospy.delete_param("/wait_server")
        wait_for(lambda: rospy.get_param("/wait_server/period", "") == "gated", "they are put back again")
        GATE.touch()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertEqual(self.client.get_result().result, 1, self.text)
        self.assertIn("f_wait: put back, because nodes start: /wait_server/period", self.manipulator.said())

    def waits_at_gate(self):
        """Whether a process of the gated node runs; those that stand by for others do not count."""
        return any(str(GATE) in words_of(pid) for pid in self.launched())

    def test_port_in_use_is_rolled_back(self):
        self.assertEqual(self.request("port"), 0)
        self.wait_for_state("slow")

    def test_full_disk_keeps_no_node_from_running(self):
        self.assertEqual(self.request("full"), 1)
        self.assertIsNotNone(pid_of("/wait_server"))

    def test_full_disk_ends_no_part_that_writes_to_its_log(self):
        with open("/dev/full", "w") as disk:
            self.start_again(disk)
        self.addCleanup(self.start_again)
        for name, result in (("full", 1), ("no_package", 0), ("no_such_configuration", -1), ("full", 1)):
            with case(name):
                self.assertEqual(self.request(name), result, self.text)
        self.assertTrue(is_alive(self.launcher.pid) and is_alive(self.manipulator.pid))

    def start_again(self, output=None):
        for node in (self.manipulator, self.launcher):
            node.end()
        self.start_launcher(output=output)
        self.start_manipulator(output=output)
        self.wait_until_it_serves()

    def test_robot_is_stopped_when_nothing_can_be_restored(self):
        self.assertEqual(self.request("breaks"), 1)
        Path(self.configurations["breaks"]["launch"]).write_text("<launch>")
        self.commands.clear()
        self.assertEqual(self.request("exits"), -2)
        self.wait_for_state("exits", "FAILED")
        wait_for(lambda: Twist() in self.commands, "the robot is commanded to stop")
        wait_for(self.has_ended, "nothing is left")


if __name__ == "__main__":
    os.chdir(Path(__file__).parent)
    rostest.rosrun("metacontrol_tests", "manipulator_faults", FaultsTest)
