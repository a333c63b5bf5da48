#!/usr/bin/env python3
"""Nodes, launcher, manipulator and master die in the middle of everything; the mission comes back, nothing is left."""

import base64
import contextlib
import io
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

import rosgraph
import rospy
import rostest
from actionlib.msg import TestGoal
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import Twist
from helpers.cases import case
from helpers.ports import QUIET_HOST, reserved_port
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import Node, PairTest, is_alive, later, pid_of
from metacontrol_msgs.msg import MvpReconfigurationGoal
from metacontrol_msgs.srv import ChangeNodes


class SurvivalTest(PairTest):
    manipulator_parameters = {"probation": 0.0, "settle_time": 0.2}
    # No death is forgotten.
    launcher_parameters = {"restart_intensity": 1, "restart_period": 100.0}

    def setUp(self):
        self.wait_until_it_serves()
        self.assertEqual(self.request("slow"), 1, self.manipulator.said())
        self.forget_goals()

    def kill_server(self):
        pid = pid_of("/wait_server")
        os.kill(pid, signal.SIGKILL)
        return pid

    def kill_launcher(self):
        self.launcher.end(signal.SIGKILL)

    def restart_launcher(self):
        self.launcher.wait()
        self.start_launcher()

    def restart_manipulator(self):
        self.manipulator.wait()
        self.start_manipulator()

    def wait_until_kept(self, goal_id):
        """Wait until the manipulator has stored a goal for the next manipulator."""

        def is_stored():
            kept = rospy.get_param("rosgraph_manipulator/kept_goals/wait", [])
            return any(goal_id.encode() in base64.b64decode(one["data"]) for one in kept)

        wait_for(is_stored, f"goal {goal_id} is stored")

    def test_node_that_dies_is_started_again_and_works_at_the_goal(self):
        goal_id, _ = self.send_goal()
        server, told = self.server, len(self.states)
        before = self.kill_server()
        self.wait_for_goal(goal_id, server)
        self.assertNotEqual(pid_of("/wait_server"), before)
        wait_for(lambda: self.states[-1].tactic == "recovery", "the recovery is told")
        self.assertEqual([message.functions[0].state for message in self.states[told:]], ["RECOVERING", "STABLE"])

    def test_node_that_dies_too_often_fails_its_configuration_and_stops_the_robot(self):
        self.assertEqual(self.request("fast"), 1)  # another configuration starts without deaths
        self.commands.clear()
        first = self.kill_server()
        wait_for(lambda: (pid_of("/wait_server") or first) != first, "it is started again")
        self.wait_for_state("fast", "STABLE")
        self.kill_server()
        self.wait_for_state("fast", "FAILED")
        self.assertIn("too many", self.states[-1].message)
        wait_for(lambda: Twist() in self.commands, "the robot is commanded to stop")
        wait_for(self.has_ended, "nothing is left")
        self.assertEqual(self.request("fast"), 1)

    def test_killed_launcher_leaves_nothing_behind_and_brings_all_back(self):
        goal_id, _ = self.send_goal()
        server, launched = self.server, self.launched()
        self.assertTrue(launched)
        self.launcher.end(signal.SIGKILL)
        wait_for(lambda: not any(map(is_alive, launched)), "its nodes end with it")
        self.restart_launcher()
        self.wait_for_goal(goal_id, server)
        self.wait_for_state("slow")

    def test_killed_manipulator_comes_back_without_touching_what_runs(self):
        goal_id, _ = self.send_goal()
        self.wait_until_kept(goal_id)
        before, server = pid_of("/wait_server"), self.server
        self.manipulator.end(signal.SIGKILL)
        self.restart_manipulator()
        wait_for(lambda: "took over the running configuration" in self.manipulator.said(), "it takes over")
        self.assertTrue(self.client.wait_for_server(rospy.Duration(DEADLINE_S)))
        self.assertEqual(pid_of("/wait_server"), before)
        self.assertNotIn("nothing reads it", self.manipulator.said(), "it knows what the former one has left")
        self.wait_until_it_serves()
        self.assertEqual(self.request("fast"), 1)
        self.wait_for_goal(goal_id, server)

    def test_goal_that_a_server_has_taken_is_known_to_a_manipulator_that_comes_back(self):
        goal_id, _ = self.send_goal()
        self.wait_until_kept(goal_id)
        server = self.server
        self.manipulator.end(signal.SIGKILL)
        rospy.delete_param("wait/resume_goal")  # as the server does when it takes the goal
        self.restart_manipulator()
        self.wait_until_it_serves()
        self.assertEqual(self.request("fast"), 1)
        self.wait_for_goal(goal_id, server)

    def test_goal_that_comes_in_a_change_is_known_to_a_manipulator_that_comes_back(self):
        goal_id, _ = self.send_goal()
        self.wait_until_kept(goal_id)
        server, before = self.server, pid_of("/wait_server")
        self.client.send_goal(MvpReconfigurationGoal("fast"))
        wait_for(lambda: not is_alive(before), "its server has ended")
        newer = self.waiting.send_goal(TestGoal(0))
        newer_id = newer.comm_state_machine.action_goal.goal_id.id
        self.wait_until_kept(newer_id)
        self.manipulator.end(signal.SIGKILL)
        self.restart_manipulator()
        self.wait_for_state("fast")
        self.wait_for_goal(newer_id, server)

    def test_goal_that_ends_while_there_is_no_manipulator_is_not_resurrected(self):
        goal_id, _ = self.send_goal()
        self.manipulator.end(signal.SIGKILL)
        self.forget_goals()
        self.restart_manipulator()
        self.wait_until_it_serves()
        self.assertEqual(self.request("fast"), 1)
        self.send_goal()  # a former one would have come before it
        self.assertNotEqual(self.server_goals.get(goal_id), GoalStatus.ACTIVE)

    def test_manipulator_killed_in_the_middle_of_a_change_finishes_it(self):
        for delay in (0.05, 0.3):
            with case(delay):
                self.assertEqual(self.request("slow"), 1)
                goal_id, _ = self.send_goal()
                self.wait_until_kept(goal_id)
                server, before = self.server, pid_of("/wait_server")
                self.client.send_goal(MvpReconfigurationGoal("fast"))
                wait_for(lambda: self.is_in("fast", "RECONFIGURING"), "the change has begun")
                time.sleep(delay)
                self.manipulator.end(signal.SIGKILL)
                self.restart_manipulator()
                self.wait_for_state("fast")
                self.wait_for_goal(goal_id, server)
                self.assertFalse(is_alive(before))
                self.wait_until_it_serves()
                self.forget_goals()

    def test_change_in_which_the_manipulator_dies_again_and_again_is_given_up(self):
        self.client.send_goal(MvpReconfigurationGoal("hangs"))
        for _ in range(2):
            wait_for(lambda: self.is_in("hangs", "RECONFIGURING"), "the change is under way")
            self.manipulator.end(signal.SIGKILL)
            self.states.clear()
            self.restart_manipulator()
        refusal = "hangs is not deployed again: the manipulator has ended 2 times"
        wait_for(
            lambda: self.states and refusal in self.states[-1].message,
            lambda: f"the change is refused; told last: {self.states[-1:]}",
        )
        self.assertTrue(self.is_in("slow", "STABLE"), self.states[-1])
        self.wait_until_it_serves()
        self.assertEqual(self.request("fast"), 1)

    def test_killed_pair_brings_the_mission_back(self):
        goal_id, _ = self.send_goal()
        self.wait_until_kept(goal_id)
        server = self.server
        for node in (self.manipulator, self.launcher):
            node.end(signal.SIGKILL)
        self.start_launcher()
        self.start_manipulator()
        self.wait_for_goal(goal_id, server)
        self.wait_for_state("slow")
        self.wait_until_it_serves()

    def test_manipulator_that_is_told_to_end_and_started_again_brings_the_mission_back(self):
        """A signal or a node of its name may end it just when the launcher dies, too; roslaunch starts both again."""
        log = self.enterContext(tempfile.NamedTemporaryFile())
        self.manipulator.end()
        self.start_manipulator(f"__log:={log.name}")  # as roslaunch starts it
        self.wait_until_it_serves()
        self.assertEqual(self.request("fast"), 1, self.text)  # it does not begin with this one
        goal_id, _ = self.send_goal()
        self.wait_until_kept(goal_id)
        server = self.server
        self.manipulator.end()
        self.launcher.end(signal.SIGKILL)
        self.start_launcher()
        self.start_manipulator(f"__log:={log.name}")
        self.wait_for_goal(goal_id, server)
        self.wait_for_state("fast")
        self.wait_until_it_serves()

    def test_killed_launcher_in_the_middle_of_a_change_is_waited_for(self):
        goal_id, _ = self.send_goal()
        server = self.server
        self.client.send_goal(MvpReconfigurationGoal("fast"))
        wait_for(lambda: self.launcher_state.state == "CHANGING", "the change has begun")
        self.launcher.end(signal.SIGKILL)
        self.restart_launcher()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertIn(self.client.get_result().result, (0, 1))
        self.wait_for_goal(goal_id, server)
        wait_for(lambda: self.state.state == "STABLE", lambda: f"a configuration is stable: {self.state}")

    def test_launcher_that_dies_before_the_nodes_are_ready_is_noticed(self):
        self.client.send_goal(MvpReconfigurationGoal("hangs"))
        wait_for(
            lambda: (self.launcher_state.configuration, self.launcher_state.state) == ("hangs", "STABLE"),
            lambda: f"the launcher has made the change: {self.launcher_state}",
        )
        self.launcher.end(signal.SIGKILL)
        self.restart_launcher()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertEqual(self.client.get_result().result, 0, self.text)
        # "not up": it dies after it has told of the change, and before it has answered; then its successor is asked.
        self.assertRegex(self.text, "rosgraph_launcher has died|is not up within")
        self.wait_for_state("slow")

    def test_launcher_that_dies_just_when_it_is_asked_is_waited_for(self):
        """The kernel closes a dying launcher's sockets one by one: it may be found, and then refuse the request."""
        found = self.pretend_to_be_launcher(lambda server: accept_one(server, self.kill_launcher))
        self.client.send_goal(MvpReconfigurationGoal("fast"))
        found.join(DEADLINE_S)
        self.assertFalse(found.is_alive(), self.manipulator.said())
        self.restart_launcher()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertEqual(self.client.get_result().result, 1, self.text)

    def test_launcher_that_dies_before_it_answers_leaves_the_request_for_its_successor(self):
        asked = self.pretend_to_be_launcher(lambda server: break_off_one(server, self.kill_launcher))
        self.client.send_goal(MvpReconfigurationGoal("fast"))
        asked.join(DEADLINE_S)
        self.assertFalse(asked.is_alive(), self.manipulator.said())
        self.restart_launcher()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertEqual(self.client.get_result().result, 1, self.text)

    def test_launcher_that_breaks_a_request_off_and_lives_on_has_failed(self):
        service, master = rospy.resolve_name("rosgraph_launcher/change"), rosgraph.Master("/rosgraph_launcher")
        uri, api = master.lookupService(service), master.lookupNode("/rosgraph_launcher")

        def break_off_one_and_leave(server):
            break_off_one(server, then=accept_one)  # that comes next is asked to restore: the failure is noticed
            master.registerService(service, uri, api)

        self.pretend_to_be_launcher(break_off_one_and_leave)
        self.assertEqual(self.request("fast"), 0)
        self.assertRegex(self.text, "rosgraph_launcher has failed .*: check that it runs; slow was restored")

    def test_launcher_that_hangs_in_a_change_is_given_up(self):
        self.set_launcher_timeout(5.0)
        self.addCleanup(self.set_launcher_timeout, 40.0)
        self.assertEqual(self.request("stubborn"), 1, self.text)  # the launcher waits for its end
        self.client.send_goal(MvpReconfigurationGoal("slow"))
        wait_for(lambda: self.launcher_state.state == "CHANGING", "the change has begun")
        with self.launcher_stopped():
            self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
            self.assertEqual(self.client.get_result().result, -2, self.text)
            self.assertIn("/rosgraph_launcher takes requests and does not answer", self.text)
        self.assertEqual(self.request("fast"), 1, self.text)

    def test_launcher_that_hangs_leaves_what_runs_untouched(self):
        self.set_launcher_timeout(5.0)
        self.addCleanup(self.set_launcher_timeout, 40.0)
        told, before = len(self.launcher_states), pid_of("/wait_server")
        with self.launcher_stopped():
            self.assertEqual(self.request("stubborn"), 0)
            self.assertIn("/rosgraph_launcher does not answer, so nothing is changed", self.text)
            self.assertTrue(self.is_in("slow", "STABLE"), self.states[-1])
        self.assertEqual(pid_of("/wait_server"), before)
        self.assertEqual(self.request("fast"), 1, self.text)
        seen = {state.configuration for state in self.launcher_states[told:]}
        self.assertEqual(seen - {""}, {"slow", "fast"})

    def test_manipulator_that_begins_while_the_launcher_hangs_ends_no_node(self):
        """It does not know whose they are, and to start others is not possible."""
        rospy.set_param("rosgraph_manipulator/kill_nodes", ["wait_server"])
        self.addCleanup(rospy.delete_param, "rosgraph_manipulator/kill_nodes")
        self.set_launcher_timeout(5.0)
        self.addCleanup(self.set_launcher_timeout, 40.0)
        before = pid_of("/wait_server")
        with self.launcher_stopped():
            self.manipulator.end(signal.SIGKILL)
            self.restart_manipulator()
            self.wait_until_it_serves()
            self.assertEqual(self.request("fast"), -2)
            self.assertIn("/rosgraph_launcher does not answer, so nothing is changed", self.text)
            self.assertEqual(pid_of("/wait_server"), before)
            self.assertTrue(is_alive(before))
        self.assertEqual(self.request("fast"), 1, self.text)

    @contextlib.contextmanager
    def launcher_stopped(self):
        """Have the launcher hang within a block; the kernel goes on to take connections for it."""
        os.kill(self.launcher.pid, signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(self.launcher.pid, signal.SIGCONT)

    def set_launcher_timeout(self, timeout):
        """Have another manipulator take over, which has another time to look for a launcher, s."""
        rospy.set_param("rosgraph_manipulator/launcher_timeout", timeout)
        self.manipulator.end()
        self.start_manipulator()
        self.wait_until_it_serves()

    def pretend_to_be_launcher(self, serve):
        """Let a function serve the requests to the launcher, in a thread; return that."""
        server = socket.create_server((QUIET_HOST, 0))
        thread = threading.Thread(target=serve, args=(server,), daemon=True)
        thread.start()
        address = f"rosrpc://{QUIET_HOST}:{server.getsockname()[1]}"
        service = rospy.resolve_name("rosgraph_launcher/change")
        rosgraph.Master("/dying_launcher").registerService(service, address, "http://localhost:1")
        return thread

    def test_launcher_that_ends_leaves_the_request_for_its_successor(self):
        self.assertEqual(self.request("stubborn"), 1, self.text)  # the launcher waits for its end
        os.kill(self.launcher.pid, signal.SIGINT)
        self.client.send_goal(MvpReconfigurationGoal("fast"))
        self.restart_launcher()
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)))
        self.assertEqual(self.client.get_result().result, 1, self.text)

    def test_lost_master_ends_the_pair_in_one_line_each_and_leaves_nothing(self):
        port = self.enterContext(reserved_port())
        folder = self.enterContext(tempfile.TemporaryDirectory())
        environment = {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_LOG_DIR": folder}
        master = subprocess.Popen(
            [sys.executable, "-c", f"import rosmaster; rosmaster.rosmaster_main(['--core', '-p', '{port}'])"],
            env={**os.environ, **environment},
            stdout=subprocess.DEVNULL,
        )
        try:
            api = rosgraph.Master("/test", environment["ROS_MASTER_URI"])
            wait_for(lambda: answers(api), "the master answers")
            api.setParam("/rosgraph_manipulator", rospy.get_param("/rosgraph_manipulator"))
            launcher = Node("rosgraph_launcher", "rosgraph_launcher", environment=environment)
            manipulator = Node("rosgraph_manipulator", "rosgraph_manipulator", environment=environment)
            mark = environment["ROS_MASTER_URI"]
            wait_for(lambda: "is deployed" in manipulator.said(), "a configuration is deployed")
            launched = self.launched(mark)
            self.assertTrue(launched)
            later(0.2, master.kill)
            master.wait(DEADLINE_S)
            for node, name in ((launcher, "rosgraph_launcher"), (manipulator, "rosgraph_manipulator")):
                self.assertEqual(node.wait(), 0, node.said())
                lines = [line for line in node.said().splitlines() if "is gone" in line]
                self.assertEqual(len(lines), 1, node.said())
                self.assertTrue(lines[0].startswith(f"/{name}: "), lines)
                self.assertNotIn("Traceback", node.said())
            wait_for(lambda: not any(map(is_alive, launched)), "the nodes have ended")
        finally:
            master.kill()
            master.wait(DEADLINE_S)


def accept_one(server, then=lambda: None):
    """Accept a connection, then refuse all others."""
    connection, _ = server.accept()
    server.close()
    then()
    connection.close()


def break_off_one(server, meanwhile=lambda: None, then=socket.socket.close):
    """Accept connections until one has a request, read that, and break it off."""
    asked = False
    while not asked:
        connection, _ = server.accept()
        with connection:
            rest = io.BytesIO()
            header = rosgraph.network.read_ros_handshake_header(connection, rest, 4096)
            asked = "probe" not in header
            if asked:
                answer = {"md5sum": ChangeNodes._md5sum, "type": ChangeNodes._type, "callerid": "/dying_launcher"}
                rosgraph.network.write_ros_handshake_header(connection, answer)
                rest.getvalue() or connection.recv(4096)
                meanwhile()
    then(server)


def answers(api):
    try:
        return bool(api.getPid())
    except OSError:
        return False


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_survival", SurvivalTest)
