#!/usr/bin/env python3
"""A mission in lockstep, as a bag: played to the real monitor and reasoner, it leads to the same decisions."""

import os
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import genpy
import rosbag
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from helpers.waiting import wait_for
from metacontrol_bags import ownership
from metacontrol_bags.decision import ADVISED, DECIDED
from metacontrol_experiments.contingency.contingency import Contingency, Kind, Moment
from metacontrol_experiments.io.input_files import read_components, read_route, simulation_package
from metacontrol_experiments.io.lockstep_setup import set_up
from metacontrol_experiments.mission.settings import Settings
from metacontrol_msgs.msg import ActiveConfiguration, Decision, DiagnosticWords, FunctionGrounding
from robot_formulas.power import MAX_LOAD, MIN_LOAD
from std_msgs.msg import Float32

ROUTE = "short: {start: [-8, -8, 0.78], goal: [-3, -4.2, 0]}\n"
POWER_AND_FAILURE = (
    Contingency(Kind.POWER, Moment(time=2.0), value=1.6),  # not while it starts to move
    Contingency(Kind.KILL, Moment(share=0.8), target="front_laser"),
)
START = "f3_v1_r1"
"""Slow: the load is known to last before the mission ends, and of the slow variants this one alone passes the limit."""

HEARD_BEFORE = 0.4
"""s, of the observer's period of 1 s, by which it hears a load before it reports it."""


def mission(folder):
    """Run a mission in lockstep; return its record."""
    routes = Path(folder) / "routes.yaml"
    routes.write_text(ROUTE)
    components = read_components(simulation_package() / "models" / "metacontrol.yaml")
    settings = Settings(
        route=read_route(routes, "short"),
        output=Path(folder),
        initial_configuration=START,
        contingencies=POWER_AND_FAILURE,
        components=components,
    )
    return set_up(settings).run().record


def write(record, path):
    """Write what a recorder would have heard of monitor, manipulator and robot."""
    messages = []
    for report in record.observed:
        stale = report.level is None
        word = DiagnosticWords.QA_STALE if stale else DiagnosticWords.QA_STATUS
        messages.append((report.stamp, *diagnostic(word, report.name, "" if stale else repr(report.level))))
        if report.name == "energy" and not stale:
            load = MIN_LOAD + (MAX_LOAD - MIN_LOAD) * report.level
            messages.append((report.stamp - HEARD_BEFORE, "/power_load", Float32(load)))
    word = DiagnosticWords.COMPONENT_STATUS
    messages += [(report.stamp, *diagnostic(word, report.component, report.status)) for report in record.components]
    for report in record.configurations:
        function = FunctionGrounding(report.function, report.configuration, report.state)
        active = ActiveConfiguration(functions=[function])
        messages.append((report.stamp, "/rosgraph_manipulator/active_configuration", active))
    with rosbag.Bag(str(path), "w") as bag:
        for stamp, topic, message in sorted(messages, key=lambda entry: entry[0]):
            time = genpy.Time.from_sec(max(stamp, 0.01))
            if hasattr(message, "header"):
                message.header.stamp = time
            bag.write(topic, message, time, connection_header=header(topic, message))


def diagnostic(word, key, value):
    status = DiagnosticStatus(message=word, hardware_id=ownership.hardware_id_of("/"), values=[KeyValue(key, value)])
    return "/diagnostics", DiagnosticArray(status=[status])


def header(topic, message):
    told = {"topic": topic, "type": message._type, "md5sum": message._md5sum, "message_definition": message._full_text}
    return told | {"latching": "1" if topic.endswith("active_configuration") else "0"}


def outcome(decision):
    return decision.trigger, decision.objective, decision.from_configuration, decision.to_configuration


class ReplayTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def start(self, *arguments):
        """Start the replay; return the file of what roslaunch prints."""
        command = ["roslaunch", "metacontrol_experiments", "replay.launch", *arguments]
        output = Path(self.folder.name) / "output"
        with output.open("wb") as file:
            process = subprocess.Popen(command, stdout=file, env={**os.environ, "PYTHONUNBUFFERED": "1"})
        self.addCleanup(process.wait)
        self.addCleanup(process.send_signal, signal.SIGINT)
        return output

    def test_replay_makes_the_decisions_that_were_made(self):
        bag = Path(self.folder.name) / "mission.bag"
        record = mission(self.folder.name)
        write(record, bag)
        made = [outcome(decision) for decision in record.decisions if decision.state == DECIDED]
        self.assertEqual({trigger for trigger, *_ in made}, {"qa:energy", "component:front_laser"})
        heard = []
        rospy.init_node("replay_test", disable_signals=True)
        rospy.Subscriber("/mros1_reasoner/decision", Decision, heard.append)
        output = self.start(f"bag:={bag}")
        wait_for(
            lambda: "[play-1] process has finished cleanly" in output.read_text(), lambda: output.read_text()[-500:]
        )
        wait_for(lambda: len(heard) >= len(made), lambda: f"each decision: {heard}")
        self.assertEqual([outcome(decision) for decision in heard], made)
        self.assertEqual({decision.state for decision in heard}, {ADVISED})


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "replay_test", ReplayTest)
