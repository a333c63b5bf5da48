#!/usr/bin/env python3
"""Managers in place of the reasoner: they get what the monitor says, and ask the manipulator."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client
from pathlib import Path

import psutil
import rosgraph
import rospy
import rostest
from helpers.connections import hears
from helpers.robot_side import Diagnostics, Manipulator, status
from helpers.waiting import wait_for, wait_for_equal
from metacontrol_bags import ownership
from metacontrol_msgs.msg import Decision

HERE = Path(__file__).resolve().parent
SOURCE = HERE.parents[2] / "catkin_ws" / "src"
NODE = SOURCE / "metacontrol_experiments" / "nodes" / "manager"
CART = HERE.parent / "mros1_reasoner" / "data" / "application.owl"
"""Designs scan_* need a laser, camera_* a camera."""
LIMITS = {"nfr_safety": 0.6, "nfr_energy": 0.62}

DRIVER = """
import os, sys, rospy
rospy.init_node("driver")
rospy.set_param("~told", [*sys.argv[1:3], os.environ["SONAR_PORT"], os.getcwd()])
rospy.spin()
"""
PACKAGE = """<package format="2"><name>own_manager</name><version>0.1.0</version><description>Own.</description>
<maintainer email="a@example.com">A</maintainer><license>Apache-2.0</license><export>
<metacontrol_experiments manager="stubborn" function="own_manager:stubborn"/>
</export></package>"""
MANAGER = """
from metacontrol_experiments.managers.manager import Manager

def stubborn(situation):
    raise ValueError("no mood")
"""


class Managed:
    """A manager as a process in a namespace of its own, beside a manipulator of the test's; ends with the block."""

    def __init__(self, namespace, manager, function="f_move", **parameters):
        self.namespace, self.node = namespace, f"{namespace}/mission_manager"
        self.decisions = []
        self.diagnostics = Diagnostics()
        self.diagnostics.robot = namespace
        self.manipulator = Manipulator(namespace, function=function)
        self._listener = rospy.Subscriber(
            f"{namespace}/mros1_reasoner/decision", Decision, self.decisions.append, queue_size=50
        )
        self._command = command(namespace, manager, **parameters)

    def __enter__(self):
        self._process = subprocess.Popen(self._command, stdout=subprocess.DEVNULL)
        wait_for(lambda: hears(self._listener, self.node), "the manager is heard")
        return self

    @property
    def pid(self):
        """Its process."""
        return self._process.pid

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()

    def runs(self, configuration):
        """Have a configuration run, as the manager knows."""
        wait_for(lambda: self.diagnostics.reaches(self.node), "the manager hears diagnostics")
        wait_for(lambda: self.manipulator.is_known, "the manager has found the manipulator")
        self.manipulator.announce(configuration)

    def violates(self, quality, level, requests):
        """Publish a level until there are so many requests."""

        def asked():
            self.diagnostics.tell(status("QA status", (quality, str(level))))
            time.sleep(0.1)  # the observer's period
            return len(self.manipulator.requests) >= requests

        wait_for(asked, lambda: f"{requests} requests because of {quality}, not {self.manipulator.requests}")

    def states(self):
        """The states of the decisions heard so far, with their triggers."""
        return [(decision.state, decision.trigger) for decision in self.decisions]


def command(namespace, manager, **parameters):
    given = {"manager": manager, **parameters}
    return [sys.executable, str(NODE), f"__ns:={namespace}", *(f"_{name}:={value}" for name, value in given.items())]


class ManagersTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("managers_test")

    def test_random_asks_for_another_design_that_can_run(self):
        with Managed(
            "/ward", "random", seed=3, model_file=CART, components="{laser: {node: front_laser}}", **LIMITS
        ) as cart:
            cart.runs("scan_slow")
            cart.violates("safety", 0.9, 1)
            (first,) = cart.manipulator.requests
            self.assertIn(first, {"scan_fast", "scan_slower", "camera_fast", "camera_slow", "camera_slower"})
            told = [("DECIDED", "qa:safety"), ("EXECUTED", "qa:safety")]
            wait_for_equal(cart.states, told, "decisions")
            self.assertEqual(
                (cart.decisions[0].from_configuration, cart.decisions[0].to_configuration), ("scan_slow", first)
            )
            # The laser of another robot is no reason; that of this one is, at once.
            cart.manipulator.announce("scan_slow")
            other = status("Missing node", name="front_laser", level=2)
            other.hardware_id = ownership.hardware_id_of("/lab")
            cart.diagnostics.tell(other)
            cart.manipulator.failures = [0]
            cart.diagnostics.tell(status("Missing node", name="front_laser", level=2))
            wait_for(lambda: len(cart.manipulator.requests) >= 3, "the failed request and the next one")
            self.assertEqual({name.partition("_")[0] for name in cart.manipulator.requests[1:]}, {"camera"})
            laser = "component:laser"
            told += [("DECIDED", laser), ("FAILED", laser), ("DECIDED", laser), ("EXECUTED", laser)]
            wait_for_equal(cart.states, told, "decisions")
            self.assertIn("it did not come up", cart.decisions[3].explanation)

    def test_rules_take_the_next_step_for_d2(self):
        model = SOURCE / "metacontrol_sim" / "models" / "d2.owl"
        with Managed("/hall", "rules", function="f_navigate", model_file=model, **LIMITS) as robot:
            robot.runs("f2_v3_r2")
            robot.violates("safety", 0.9, 1)
            self.assertEqual(robot.manipulator.requests, ["f2_v2_r2"])
            wait_for_equal(robot.states, [("DECIDED", "qa:safety"), ("EXECUTED", "qa:safety")], "decisions")

    def test_respawn_starts_a_dead_driver_as_it_was_started_and_leaves_one_that_hangs(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        script, master, node = Path(folder.name, "driver.py"), rosgraph.Master("/managers_test"), "/dive/sonar_17"
        script.write_text(DRIVER)
        options = ["depth", "__ns:=/dive", "__name:=sonar_17", "scan:=echo"]
        sonar = self.start_driver(folder.name, options)
        lamp = self.start_driver(folder.name, ["beam", "__ns:=/dive", "__name:=lamp"])
        told = ["depth", "__ns:=/dive", "tty 3", folder.name]
        wait_for(lambda: rospy.get_param(f"{node}/told", None) == told, "the driver runs")
        with Managed("/dive", "respawn", components="{sonar: {node: sonar_17}, lamp: {node: lamp}}") as boat:
            manager = psutil.Process(boat.pid)
            wait_for(lambda: watched(manager) >= {sonar.pid, lamp.pid}, "the drivers are watched")
            rospy.delete_param(f"{node}/told")
            lamp.send_signal(signal.SIGSTOP)
            sonar.kill()
            wait_for(manager.children, "the driver is started again")
            wait_for(lambda: rospy.get_param(f"{node}/told", None) == told, "the driver runs again")
            (second,) = manager.children()
            self.assertEqual(second.cmdline(), [sys.executable, str(script), *options])
            second.kill()
            third = wait_for(lambda: [p for p in manager.children() if p.pid != second.pid], "a third one")[0]
            wait_for(lambda: pid_of(master, node) == third.pid, "the third one is registered")
        wait_for(lambda: not third.is_running() or third.status() == psutil.STATUS_ZOMBIE, "it ends with the manager")
        self.assertEqual(boat.decisions, [])

    def start_driver(self, folder, options):
        """Start the driver in a folder as a process of the test's own, which is ended after the test."""
        process = subprocess.Popen(
            [sys.executable, str(Path(folder, "driver.py")), *options],
            cwd=folder,
            env={**os.environ, "SONAR_PORT": "tty 3"},
        )
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_manager_that_cannot_be_had_ends_the_node_with_one_line(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        Path(folder.name, "package.xml").write_text(PACKAGE)
        Path(folder.name, "own_manager.py").write_text(MANAGER)
        more = {name: f"{folder.name}:{os.environ[name]}" for name in ("ROS_PACKAGE_PATH", "PYTHONPATH")}
        cases = (
            ("magic", {}, "no manager 'magic'; there are as_published, mros, none, random"),
            ("random", {}, "manager random needs a model with an objective: set the reasoner's ~model_file"),
            ("random", {"model_file": "/no/where.owl"}, "/no/where.owl"),
            ("respawn", {"seed": -1}, "~seed is -1"),
            ("stubborn", {}, "own_manager:stubborn fails: ValueError: no mood"),
        )
        for number, (manager, parameters, said) in enumerate(cases):
            ended = subprocess.run(
                command(f"/case_{number}", manager, **parameters),
                capture_output=True,
                text=True,
                env={**os.environ, **more},
                check=False,
            )
            self.assertEqual(ended.returncode, 2, ended.stderr)
            self.assertIn(said, ended.stderr)
            self.assertEqual(ended.stderr.count("\n"), 1, ended.stderr)


def watched(process):
    """The processes of which a process holds descriptors."""
    found = set()
    for info in Path(f"/proc/{process.pid}/fdinfo").iterdir():
        with contextlib.suppress(OSError):  # closed meanwhile
            found |= {int(line.split()[1]) for line in info.read_text().splitlines() if line.startswith("Pid:")}
    return found


def pid_of(master, node):
    """The process of a node as its own API tells; None where it does not answer."""
    try:
        return xmlrpc.client.ServerProxy(master.lookupNode(node)).getPid("/managers_test")[2]
    except (OSError, rosgraph.MasterException, xmlrpc.client.Error):
        return None


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "managers_test", ManagersTest)
