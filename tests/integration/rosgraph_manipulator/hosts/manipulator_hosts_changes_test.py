#!/usr/bin/env python3
"""Functions over two hosts: they are released, share a node of the other host, and move nodes between the hosts."""

import os
import signal
import tempfile
from pathlib import Path

import psutil
import rospy
import rostest
from helpers.waiting import DEADLINE_S, wait_for
from integration.action_clients import SureActionClient
from integration.rosgraph_manipulator.manipulator_harness import PairTest, is_alive, pid_of
from manipulator_hosts_harness import ADDRESS, FAR_LAUNCHER, Respawned
from metacontrol_msgs.msg import ChangeFunctionAction, ChangeFunctionGoal

DATA = Path(__file__).resolve().parent / "data"
CAMERA, VIEWER, GRIPPER, ONE, TWO = "/camera", "/viewer", "/gripper", "/one", "/two"
LIVES = Path(tempfile.mkdtemp())
HERE_ADDRESS = "localhost"


def configuration(function, name, *args):
    return {"function": function, "launch": str(DATA / f"hosts_{name}.launch"), "args": list(args)}


def moving(one, two):
    return configuration("f_move", "move", f"folder:={LIVES}", f"one:={one}", f"two:={two}")


def network_of(pid):
    return os.readlink(f"/proc/{pid}/ns/net")


class HostsChangesTest(PairTest):
    configurations = {
        "look": configuration("f_look", "look", f"address:={ADDRESS}"),
        "pick": configuration("f_pick", "pick", f"address:={ADDRESS}"),
        "both_here": moving(HERE_ADDRESS, HERE_ADDRESS),
        "one_there": moving(ADDRESS, HERE_ADDRESS),
        "two_there": moving(HERE_ADDRESS, ADDRESS),
    }
    manipulator_parameters = {
        "save_action": "",
        "goal_msg_type": "",
        "initial_configuration": "",
        "host_timeout": 10.0,
        "probation": 0.0,
    }

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.far = Respawned()
        cls.addClassCleanup(cls.far.end)
        wait_for(lambda: pid_of(f"/{FAR_LAUNCHER}"), "the launcher of the other host is there")
        cls.changes = SureActionClient("rosgraph_manipulator/change_function", ChangeFunctionAction)
        assert cls.changes.wait_for_server(rospy.Duration(DEADLINE_S))

    def tearDown(self):
        for function in ("f_look", "f_pick", "f_move"):
            self.release(function)

    def release(self, function):
        self.changes.send_goal(ChangeFunctionGoal(function, "", []))
        self.assertTrue(self.changes.wait_for_result(rospy.Duration(DEADLINE_S)), f"no result for {function}")
        self.assertEqual(self.changes.get_result().result, 1, self.changes.get_result().message)

    def deploy(self, name):
        self.assertEqual(self.request(name), 1, self.text)

    def wait_for_functions(self, **configurations):
        def deployed():
            return {f.function: (f.configuration, f.state) for f in self.states[-1].functions}

        expected = {function: (name, "STABLE") for function, name in configurations.items()}
        wait_for(lambda: deployed() == expected, f"exactly {configurations} are stable")

    def test_release_ends_the_nodes_on_the_other_host(self):
        self.deploy("pick")
        pids = [pid_of(CAMERA), pid_of(GRIPPER)]
        self.assertEqual({network_of(pid) for pid in pids}, {network_of(self.far_pid())})
        self.release("f_pick")
        self.assertEqual([pid for pid in pids if psutil.pid_exists(pid) and is_alive(pid)], [])
        self.assertFalse(rospy.has_param(f"{GRIPPER}/force"))
        self.wait_for_functions()

    def far_pid(self):
        return pid_of(f"/{FAR_LAUNCHER}")

    def test_shared_node_on_the_other_host_ends_with_the_last_function_that_needs_it(self):
        self.deploy("look")
        camera = pid_of(CAMERA)
        self.deploy("pick")
        self.assertEqual(pid_of(CAMERA), camera)
        self.release("f_look")
        self.wait_for_functions(f_pick="pick")
        self.assertEqual((pid_of(CAMERA), pid_of(VIEWER)), (camera, None))
        os.kill(camera, signal.SIGKILL)
        wait_for(lambda: pid_of(CAMERA) not in (None, camera), "it is started again for the function that is left")
        self.wait_for_functions(f_pick="pick")
        self.release("f_pick")
        self.assertEqual((pid_of(CAMERA), pid_of(GRIPPER)), (None, None))

    def test_shared_node_on_the_other_host_stays_also_with_the_first_function(self):
        self.deploy("look")
        self.deploy("pick")
        camera, viewer = pid_of(CAMERA), pid_of(VIEWER)
        self.release("f_pick")
        self.wait_for_functions(f_look="look")
        self.assertEqual((pid_of(CAMERA), pid_of(VIEWER), pid_of(GRIPPER)), (camera, viewer, None))

    def test_node_that_moves_to_another_host_ends_before_it_begins_there(self):
        there, here = network_of(self.far_pid()), network_of(os.getpid())
        for name, networks in (
            ("both_here", (here, here)),
            ("one_there", (there, here)),
            ("two_there", (here, there)),  # each host loses a node and starts one
            ("one_there", (there, here)),
            ("both_here", (here, here)),
        ):
            self.deploy(name)
            self.assertEqual((network_of(pid_of(ONE)), network_of(pid_of(TWO))), networks)
        self.release("f_move")
        for node, lives in (("one", 5), ("two", 3)):
            self.assertEqual((LIVES / node).read_text().split(), ["begins", "ends"] * lives, node)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_hosts_changes", HostsChangesTest)
