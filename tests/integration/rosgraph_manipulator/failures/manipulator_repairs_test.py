#!/usr/bin/env python3
"""Components that are repaired by services and launch files, in a namespace, while a function changes."""

import os
import signal

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import HERE, Node, PairTest, is_alive, pid_of
from metacontrol_msgs.msg import RepairAction, RepairGoal
from rosgraph_launcher.io.ownership import launcher_mark, look_up
from rosgraph_launcher.launching.ownership import Owner
from std_msgs.msg import String

SERVER, CABINET = "/plant/wait_server", "/plant/cabinet"
REPAIR_TIMEOUT = 40.0  # s, wall; a whole change of a function fits into it


FILE = "integration/rosgraph_manipulator/data/yard_scanner.launch"
SIDES = ("north", "east", "south", "west")


def scanner(side, **args):
    return {"launch": {"package": "metacontrol_tests", "file": FILE, "args": {"side": side, **args}}}


REPAIRS = {
    "gate": {"service": "cabinet/gate/reset"},
    "lamp": {"service": "/plant/cabinet/lamp/restart"},
    "valve": {"service": "cabinet/valve/reset"},
    "door": {"service": "cabinet/door/open"},
    "horn": {"service": "cabinet/horn/reset"},
    "fan": {"service": "cabinet/fan/reset"},
    **{side: scanner(side) for side in SIDES},
    "twin": scanner("east"),  # another component of the same driver
    "broken": scanner("upper", args="--broken"),
    "mute": scanner("lower", args="--mute"),
    "missing": {"launch": {"package": "metacontrol_tests", "file": "no_such.launch"}},
    "served": {"launch": {"file": str(HERE / "server.launch"), "args": {"period": "slow"}}},
}


class RepairsTest(PairTest):
    manipulator_parameters = {"repairs": REPAIRS, "repair_timeout": REPAIR_TIMEOUT, "probation": 0.0}

    @classmethod
    def setUpClass(cls):
        cls.cabinet = Node("metacontrol_tests", "yard_cabinet.py", "__name:=cabinet")
        cls.addClassCleanup(cls.cabinet.end, signal.SIGKILL)
        cls.scans = []
        super().setUpClass()
        cls.subscribers.append(rospy.Subscriber("yard/scan", String, lambda message: cls.scans.append(message.data)))
        cls.repairs = actionlib.ActionClient("rosgraph_manipulator/repair", RepairAction)
        assert cls.repairs.wait_for_server(rospy.Duration(DEADLINE_S)), cls.manipulator.said()
        wait_for(lambda: pid_of(CABINET), "the cabinet answers")

    def setUp(self):
        wait_for(lambda: self.is_in("slow", "STABLE") or self.request("slow") == 1, "slow runs")
        self.server_pid = wait_for(lambda: pid_of(SERVER), "the server of the function answers")

    # -- helpers

    def begin(self, component):
        return self.repairs.send_goal(RepairGoal(component))

    def end(self, goal, status=GoalStatus.SUCCEEDED):
        """Wait until a repair ends as expected; return its message."""
        wait_for(lambda: goal.get_comm_state() == actionlib.CommState.DONE, "the repair ends")
        result = goal.get_result()
        self.assertEqual((goal.get_goal_status(), result.ok), (status, status == GoalStatus.SUCCEEDED), result.message)
        self.assertNotIn("\n", result.message)
        return result.message

    def refused(self, component):
        return self.end(self.begin(component), GoalStatus.ABORTED)

    @staticmethod
    def pid(side):
        return pid_of(f"/plant/yard/{side}_scanner")

    def start_foreign(self, side):
        """Start a driver as a user would; return its process id."""
        environment = {"ROS_NAMESPACE": "/plant/yard"}
        node = Node("metacontrol_tests", "yard_driver.py", f"__name:={side}_scanner", environment=environment)
        self.addCleanup(node.end, signal.SIGKILL)
        return wait_for(lambda: self.pid(side), "the user's driver answers")

    def repair(self, side):
        """Repair a driver; return the id of its process, which the launcher has started."""
        self.end(self.begin(side))
        self.assertIs(
            look_up(f"/plant/yard/{side}_scanner").owner(launcher_mark("/plant/rosgraph_launcher")), Owner.LAUNCHER
        )
        return self.pid(side)

    def assert_function_undisturbed(self):
        self.assertEqual(pid_of(SERVER), self.server_pid)
        functions = {grounding.function for message in self.states for grounding in message.functions}
        self.assertEqual(functions, {"f_wait"}, "a repair is no function of the model")

    # -- services

    def test_trigger_tells_whether_it_repairs(self):
        self.assertEqual(self.refused("gate"), "/plant/cabinet/gate/reset has failed: the gate is jammed")
        self.assertEqual(self.end(self.begin("gate")), "")

    def test_empty_repairs(self):
        self.end(self.begin("lamp"))

    def test_what_cannot_repair_is_told(self):
        self.assertIn("is of type std_srvs/SetBool, not std_srvs/Trigger or std_srvs/Empty", self.refused("door"))
        self.assertIn("nobody offers the service /plant/cabinet/fan/reset", self.refused("fan"))
        self.assertIn("no such horn", self.refused("horn"))
        self.assertIn("no_such.launch", self.refused("missing"))
        message = self.end(self.begin("nose"), GoalStatus.REJECTED)
        self.assertIn("no repair is known for component 'nose'; known are: broken, door, east, fan, gate", message)

    def test_service_that_hangs_blocks_nothing_else(self):
        hangs = self.begin("valve")
        wait_for(lambda: hangs.get_goal_status() == GoalStatus.ACTIVE, "it is under way")
        self.assertEqual(self.request("fast"), 1, self.text)
        self.end(self.begin("lamp"))
        self.assertIn("valve is being repaired already", self.end(self.begin("valve"), GoalStatus.REJECTED))
        self.assertEqual(hangs.get_goal_status(), GoalStatus.ACTIVE)
        hangs.cancel()
        self.assertEqual(self.end(hangs, GoalStatus.PREEMPTED), "cancelled")
        line = f"/plant/cabinet/valve/reset has not answered within {REPAIR_TIMEOUT:g} s"
        self.assertIn(line, self.refused("valve"))

    # -- drivers

    def test_driver_is_repaired_whatever_happened_to_it(self):
        first = self.start_foreign("north")
        self.scans.clear()
        os.kill(first, signal.SIGKILL)
        second = self.repair("north")
        wait_for(lambda: "/dev/north" in self.scans, "it has its parameter")
        os.kill(second, signal.SIGSTOP)
        third = self.repair("north")
        fourth = self.repair("north")  # it works, but somebody asks
        self.assertEqual([is_alive(pid) for pid in (first, second, third, fourth)], [False, False, False, True])
        self.assert_function_undisturbed()

    def test_driver_of_somebody_else_ends_before_its_repair(self):
        works, hangs = self.start_foreign("south"), self.start_foreign("west")
        os.kill(hangs, signal.SIGSTOP)
        for side, foreign in (("south", works), ("west", hangs)):
            self.assertNotEqual(self.repair(side), foreign)
            self.assertFalse(is_alive(foreign), side)

    def test_repaired_driver_is_supervised_and_survives_changes_and_the_manipulator(self):
        first = self.repair("east")
        self.assertEqual(self.request("fast"), 1, self.text)
        self.assertEqual(self.pid("east"), first)
        os.kill(first, signal.SIGKILL)
        second = wait_for(lambda: self.pid("east") not in (None, first) and self.pid("east"), "it is started again")
        os.kill(pid_of("/plant/rosgraph_manipulator"), signal.SIGKILL)
        self.manipulator.wait()
        self.start_manipulator()
        self.wait_until_it_serves_repairs()
        self.assertEqual(self.request("slow"), 1, self.text)
        self.assertEqual(self.pid("east"), second)
        self.assertNotEqual(self.repair("east"), second)
        self.assertFalse(is_alive(second))

    def test_driver_of_two_components_is_restarted_for_each(self):
        first = self.repair("east")
        self.end(self.begin("twin"))
        self.assertFalse(is_alive(first))
        second = self.pid("east")
        self.assertNotEqual(self.repair("east"), second)
        self.assertFalse(is_alive(second))

    def test_repaired_driver_comes_back_with_the_launcher(self):
        first = self.repair("east")
        os.kill(pid_of("/plant/rosgraph_launcher"), signal.SIGKILL)
        self.launcher.wait()
        self.start_launcher()
        wait_for(lambda: self.pid("east") not in (None, first), "it is started again")
        self.wait_for_state("slow")

    def test_driver_that_does_not_come_up_is_told(self):
        first, second = self.begin("broken"), self.begin("broken")
        self.assertIn("broken is being repaired already", self.end(second, GoalStatus.REJECTED))
        line = "deaths in 30 s are too many: repair_of_broken is stopped"
        self.assertIn(line, self.end(first, GoalStatus.ABORTED))
        self.assertEqual(self.request("fast"), 1, self.text)

    def test_driver_that_never_answers_keeps_no_function_from_its_change(self):
        goal = self.begin("mute")
        wait_for(lambda: goal.get_goal_status() == GoalStatus.ACTIVE, "it is under way")
        self.assertEqual(self.request("fast"), 1, self.text)
        self.assertEqual(goal.get_goal_status(), GoalStatus.ACTIVE)
        goal.cancel()
        self.end(goal, GoalStatus.PREEMPTED)
        line = f"not up within {REPAIR_TIMEOUT:g} s: node /plant/yard/lower_scanner; see their logs"
        port = "/plant/yard/lower_scanner/port"
        rospy.delete_param(port)
        goal = self.begin("mute")
        wait_for(lambda: rospy.get_param(port, "") == "/dev/lower", "its parameter is set")
        rospy.set_param(port, "/dev/other")
        wait_for(lambda: rospy.get_param(port) == "/dev/lower", "its parameter is put back while it starts")
        self.assertEqual(self.end(goal, GoalStatus.ABORTED), line)

    def test_node_of_a_function_is_not_restarted_by_a_repair(self):
        self.assertIn("functions that run have its nodes, /plant/wait_server", self.refused("served"))
        self.assert_function_undisturbed()

    @classmethod
    def on_launched(cls, message):
        cls.launcher_states.extend(function for function in message.functions if function.function == "f_wait")

    def wait_until_it_serves_repairs(self):
        wait_for(lambda: pid_of("/plant/rosgraph_manipulator") == self.manipulator.pid, "the manipulator is there")

        def answers():
            goal = self.begin("nose")
            try:
                wait_for(lambda: goal.get_comm_state() == actionlib.CommState.DONE, "an answer", deadline=1.0)
            except AssertionError:
                return False
            return goal.get_goal_status() == GoalStatus.REJECTED

        wait_for(answers, "it answers")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_repairs", RepairsTest)
