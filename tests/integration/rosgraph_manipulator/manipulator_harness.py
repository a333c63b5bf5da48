"""What the tests of manipulator and launcher share: the pair as processes, requests, and what they say."""

import contextlib
import os
import signal
import subprocess
import tempfile
import threading
import time
import unittest
import xmlrpc.client
from pathlib import Path

import actionlib
import psutil
import rosgraph
import rospy
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import Twist
from helpers.connections import hears, reaches
from helpers.programs import program
from helpers.waiting import DEADLINE_S, wait_for
from integration.action_clients import SureActionClient
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    FunctionGrounding,
    LaunchedFunction,
    LaunchedFunctions,
    MvpReconfigurationAction,
    MvpReconfigurationGoal,
    ReconfigurationResult,
)
from rosgraph_launcher.io.processes import MARK

HERE = Path(__file__).resolve().parent / "data"
SERVER = str(HERE / "server.launch")


def pid_of(node):
    """Process id of a node, or None when it does not answer."""
    try:
        uri = rosgraph.Master("/test").lookupNode(node)
        return xmlrpc.client.ServerProxy(uri).getPid("/test")[2]
    except (rosgraph.MasterException, OSError, xmlrpc.client.Error):
        return None


def is_alive(pid):
    """Whether a process runs; one that ended but was not waited for by its parent does not."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def words_of(pid):
    """The command of a process; that of one that has ended is like no other."""
    with contextlib.suppress(psutil.Error):
        return tuple(psutil.Process(pid).cmdline())
    return (str(pid),)


def configuration(**arguments):
    """A configuration of the server's launch file."""
    return {"function": "f_wait", "launch": SERVER, "args": [f"{key}:={value}" for key, value in arguments.items()]}


CONFIGURATIONS = {
    "slow": configuration(period="slow"),
    "fast": {**configuration(period="fast"), "topics": ["wait/status"]},
    "exits": configuration(args="--exit-at-once"),
    "hangs": configuration(args="--hang"),
    "stubborn": configuration(args="--stubborn"),
    "dies": configuration(args="--die-after 0.3"),
    "dies_at_once": configuration(args="--die-after 0"),
    "malformed": {"function": "f_wait", "launch": str(HERE / "malformed.launch")},
    "undefined": {"function": "f_wait", "launch": str(HERE / "undefined.launch")},
    "no_package": {"function": "f_wait", "command": "roslaunch no_such_package x.launch"},
    "no_node": {"function": "f_wait", "launch": str(HERE / "no_node.launch")},
    "once": {"function": "f_wait", "launch": str(HERE / "once.launch")},
    "tuned_1": {"function": "f_wait", "launch": str(HERE / "tuned.launch"), "args": ["rate:=1.0"]},
    "tuned_2": {"function": "f_wait", "launch": str(HERE / "tuned.launch"), "args": ["rate:=2.0"]},
    "tuned_wrong": {"function": "f_wait", "launch": str(HERE / "tuned.launch"), "args": ["rate:=1000.0"]},
    "tuned_other": {"function": "f_wait", "launch": str(HERE / "tuned.launch"), "args": ["rate:=1.0", "other:=2"]},
}


class Node:
    """A node as a process of the test's own, with what it says."""

    def __init__(self, package, name, *words, environment=None, output=None):
        self.output = output or tempfile.NamedTemporaryFile("w")  # noqa: SIM115, it lives as long as the node
        self._process = subprocess.Popen(
            [program(package, name), *words],
            stdout=self.output,
            stderr=subprocess.STDOUT,
            env={**os.environ, "PYTHONUNBUFFERED": "1", **(environment or {})},  # what it says is read at once
        )
        self.pid = self._process.pid

    def end(self, how=signal.SIGINT):
        with contextlib.suppress(ProcessLookupError):
            self._process.send_signal(how)
        return self._process.wait(DEADLINE_S)

    def wait(self):
        return self._process.wait(DEADLINE_S)

    def said(self):
        path = Path(self.output.name)  # opened anew: the node's place in the file stays where it is
        return path.read_text() if path.is_file() else ""


class PairTest(unittest.TestCase):
    """Tests with a launcher and a manipulator, started anew for each class."""

    configurations = CONFIGURATIONS
    manipulator_parameters = {}
    launcher_parameters = {}
    environment = {}

    @classmethod
    def setUpClass(cls):
        rospy.init_node("manipulator_test", anonymous=True)
        cls.states, cls.launcher_states, cls.commands = [], [], []
        cls.server_status = None, {}  # a server, as the header of its connection, and the states of its goals
        rospy.set_param(
            "rosgraph_manipulator",
            {
                "configurations": cls.configurations,
                "save_action": "wait",
                "goal_msg_type": "actionlib.msg.TestAction",
                "initial_configuration": "slow",
                "ready_timeout": 30.0,
                "launcher_timeout": 40.0,
                **cls.manipulator_parameters,
            },
        )
        rospy.set_param("rosgraph_launcher", {"restart_intensity": 3, **cls.launcher_parameters})
        cls.subscribers = [
            rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, cls.states.append),
            rospy.Subscriber("rosgraph_launcher/functions", LaunchedFunctions, cls.on_launched),
            rospy.Subscriber("cmd_vel", Twist, cls.commands.append),
            rospy.Subscriber("wait/status", GoalStatusArray, cls.on_status),
        ]
        cls.heard_commands = cls.subscribers[2]
        cls.addClassCleanup(cls.end_pair)
        cls.launcher = cls.manipulator = None
        cls.start_launcher()
        cls.start_manipulator()
        cls.client = SureActionClient("rosgraph_manipulator_action_server", MvpReconfigurationAction)
        cls.waiting = actionlib.ActionClient("wait", TestAction)
        assert cls.client.wait_for_server(rospy.Duration(DEADLINE_S)), cls.manipulator.said()

    @classmethod
    def start_launcher(cls, output=None):
        cls.launcher = Node("rosgraph_launcher", "rosgraph_launcher", environment=cls.environment, output=output)

    @classmethod
    def start_manipulator(cls, *arguments, output=None):
        name = "rosgraph_manipulator"
        cls.manipulator = Node(name, name, *arguments, environment=cls.environment, output=output)

    @classmethod
    def end_pair(cls):
        for subscriber in cls.subscribers:
            subscriber.unregister()
        for node in (cls.manipulator, cls.launcher):
            if node:
                node.end()

    @classmethod
    def on_launched(cls, message):
        """Keep what the launcher tells of the tests' only function."""
        cls.launcher_states.extend(message.functions[:1])

    @classmethod
    def on_status(cls, message):
        goals = {entry.goal_id.id: entry.status for entry in message.status_list}
        cls.server_status = message._connection_header, goals

    @property
    def server(self):
        return self.server_status[0]

    @property
    def server_goals(self):
        return self.server_status[1]

    @property
    def launcher_state(self):
        """What the launcher has told last of the tests' only function."""
        return self.launcher_states[-1] if self.launcher_states else LaunchedFunction()

    @property
    def state(self):
        """What the manipulator has told last of its first function."""
        functions = self.states[-1].functions if self.states else []
        return functions[0] if functions else FunctionGrounding()

    def request(self, name):
        """Ask for a configuration; return the result, once the manipulator has told of its end on its topic, too."""
        before = len(self.states)
        self.client.send_goal(MvpReconfigurationGoal(name))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)), f"no result for {name}")
        result, text = self.client.get_result().result, self.text
        if result != ReconfigurationResult.UNKNOWN_CONFIGURATION:
            wait_for(lambda: text in [state.message for state in self.states[before:]], f"it is told: {text}")
        return result

    @property
    def text(self):
        return self.client.get_goal_status_text()

    def is_in(self, name, state):
        return (self.state.configuration, self.state.state) == (name, state)

    def wait_for_state(self, name, state="STABLE"):
        wait_for(lambda: self.is_in(name, state), lambda: f"{name} is {state}; told last: {self.states[-1:]}")

    def forget_goals(self):
        """Cancel what the server has at work, and wait until it has nothing."""
        now = rospy.Time.now()

        def is_idle():
            if not {GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING} & set(self.server_goals.values()):
                return True
            # Again and again, since it may not have found a new server yet; it does not concern later goals.
            self.waiting.cancel_goals_at_and_before_time(now)
            return False

        wait_for(is_idle, lambda: f"the server has nothing to do; it has {self.server_goals}")

    def wait_until_it_serves(self):
        """Wait until the (new) manipulator answers requests: an unknown one is refused at once."""
        wait_for(lambda: pid_of("/rosgraph_manipulator") == self.manipulator.pid, "the manipulator is there")

        def answers():
            self.client.send_goal(MvpReconfigurationGoal("no_such_configuration"))
            return self.client.wait_for_result(rospy.Duration(1)) and self.client.get_result().result == -1

        wait_for(answers, lambda: f"the manipulator answers: {self.manipulator.said()}")
        wait_for(lambda: hears(self.heard_commands, "/rosgraph_manipulator"), "its commands are heard")

    def has_ended(self):
        """Whether the launcher has ended all that it has started."""
        return not self.launched()

    def send_goal(self):
        """Send a goal that stays pending; return its id and handle."""
        self.assertTrue(self.waiting.wait_for_server(rospy.Duration(DEADLINE_S)))
        wait_for(
            lambda: reaches(self.waiting.pub_goal, rospy.resolve_name("rosgraph_manipulator")),
            "the manipulator hears it",
        )
        return wait_for(self.try_goal, "a goal is at work")

    def try_goal(self):
        """The goal's topic may not have found a new server yet, and holds nothing back for it."""
        handle = self.waiting.send_goal(TestGoal(0))
        goal_id = handle.comm_state_machine.action_goal.goal_id.id
        deadline = time.monotonic() + 3.0
        while time.monotonic() < deadline:
            if self.server_goals.get(goal_id) == GoalStatus.ACTIVE:
                return goal_id, handle
            time.sleep(0.02)
        handle.cancel()
        return None

    def wait_for_goal(self, goal_id, old_server):
        """Wait until another server works at the goal."""

        def is_at_work():
            server, goals = self.server_status
            return server is not old_server and goals.get(goal_id) == GoalStatus.ACTIVE

        wait_for(is_at_work, lambda: f"another server works at goal {goal_id}; goals: {self.server_goals}")

    @staticmethod
    def launched(master=None):
        """The processes that the launcher at a master has started; its reaper bears no mark."""
        found = []
        for process in psutil.process_iter():
            with contextlib.suppress(psutil.Error):
                mark = process.environ().get(MARK, "")
                if mark.startswith(master or rosgraph.get_master_uri()) and process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process.pid)
        return found


def later(seconds, action):
    """Do something in a while, in a thread."""
    timer = threading.Timer(seconds, action)
    timer.daemon = True
    timer.start()
    return timer
