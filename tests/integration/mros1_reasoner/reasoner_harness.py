"""What the tests of the node reasoner share: reasoners started as processes, and what they say."""

import os
import subprocess
import sys
import tempfile
import xmlrpc.client
from pathlib import Path

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from helpers.connections import hears
from helpers.waiting import DEADLINE_S, wait_for
from metacontrol_msgs.msg import Decision
from rosgraph_msgs.msg import Log

HERE = Path(__file__).resolve().parent
MODEL = HERE / "data" / "application.owl"
NODE = HERE.parents[2] / "catkin_ws" / "src" / "mros1_reasoner" / "nodes" / "reasoner"
PARAMETERS = {
    "model_file": MODEL,
    "nfr_safety": 0.6,
    "nfr_energy": 0.62,
    "qa_direction": "{performance: higher_is_better}",
    "components": "{laser: {node: front_laser}}",
    "violation_window": 0.5,
    "cool_down": 0.5,
    "backoff": 0.2,
    "start_grace": DEADLINE_S,  # what runs is told in time, however slow the machine is
    "reasoning_rate": 0.5,
}
NOTHING_RUNS = {"start_grace": 0.5}
"""For a reasoner that asks for a first configuration."""


def node_api(node):
    """Return a node's own API."""
    return xmlrpc.client.ServerProxy(rosgraph.Master("/test").lookupNode(node))


def node_pid(node):
    """Return the process id of a node."""
    return node_api(node).getPid("/test")[2]


def start_node(output, *arguments):
    """Start a reasoner whose standard output is appended to a file; return its process."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}  # what it says is read at once
    with open(output.name, "a") as file:
        return subprocess.Popen([sys.executable, str(NODE), *arguments], stdout=file, env=environment)


def wait_until_printed(output, text):
    """Wait until a node has printed a text to its output file."""
    wait_for(lambda: text in Path(output.name).read_text(), lambda: f"{text}: {Path(output.name).read_text()}")


class Listener:
    """Hears a reasoner's decisions and log lines, and the diagnostics about reconfigurations."""

    def __init__(self, namespace=""):
        self.node = f"{namespace}/reasoner"
        self.decisions, self.log, self.lines, self.troubles = [], [], [], []
        self._subscribers = [
            rospy.Subscriber(f"{namespace}/mros1_reasoner/decision", Decision, self.decisions.append, queue_size=50),
            rospy.Subscriber("/rosout", Log, self._on_log, queue_size=500),
        ]
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=500)

    @property
    def is_connected(self):
        """Whether it hears what the reasoner decides and logs from now on."""
        return all(hears(subscriber, self.node) for subscriber in self._subscribers)

    def _on_log(self, message):
        if message.name == self.node:
            self.log.append(message.msg)
            self.lines.append(message)

    def _on_diagnostics(self, array):
        trouble = f"{self.node.strip('/')}: reconfiguration"
        self.troubles += [s for s in array.status if s.name == trouble]

    def decided(self, state, count=1):
        """Wait until so many decisions of a state were heard; return the last."""
        found = wait_for(
            lambda: [d for d in self.decisions if d.state == state][count - 1 :],
            lambda: f"decision {count} of state {state}; heard {[(d.state, d.explanation) for d in self.decisions]}",
        )
        return found[0]

    def logged(self, text, start=0):
        """Wait until a line of the log holds a text; return the line."""
        return wait_for(
            lambda: [line for line in self.log[start:] if text in line],
            lambda: f"in the log: {text}; the last lines: {self.log[start:][-10:]}",
        )[0]


class Reasoner:
    """A reasoner as a process, in a namespace of its own; ends with the block."""

    def __init__(self, namespace, diagnostics, *remappings, **parameters):
        self.namespace = namespace
        self.node = f"{namespace}/reasoner"
        self._diagnostics = diagnostics
        self._parameters, self._remappings = {**PARAMETERS, **parameters}, remappings
        self.listener = Listener(namespace)
        self._process = None
        self._output = tempfile.NamedTemporaryFile("w")  # noqa: SIM115, it lives as long as the reasoner

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.kill()

    def start(self):
        """Start it and wait until it is ready."""
        self._diagnostics.robot = self.namespace
        arguments = [f"_{name}:={value}" for name, value in self._parameters.items()]
        self._output.truncate(0)
        self._process = start_node(self._output, f"__ns:={self.namespace}", *self._remappings, *arguments)
        self.printed("Reasoner Initialization Ok")
        wait_for(lambda: self.listener.is_connected, "the reasoner is heard")
        wait_for(lambda: self._diagnostics.reaches(self.node), "the reasoner hears diagnostics")

    def printed(self, text):
        """Wait until it has printed a text. What it logs before its log is connected is heard by nobody else."""
        wait_until_printed(self._output, text)

    def kill(self):
        """End it without a word, and wait until it is gone."""
        self._process.kill()
        self._process.wait()

    def service(self, name, kind, *arguments):
        """Call one of its services."""
        full = f"{self.node}/{name}"
        rospy.wait_for_service(full, DEADLINE_S)
        return rospy.ServiceProxy(full, kind)(*arguments)
