"""The node itself, without ROS."""

from types import SimpleNamespace

import rospy
from node_kit.io.xml_rpc import SilentError
from rosgraph_manipulator.change.journal import Journal
from rosgraph_manipulator.ros import manipulator as module
from rosgraph_manipulator.ros.manipulator import JournalParameter, Manipulator


def test_change_ends_well_where_no_thread_asks_nodes_for_their_parameters_afterwards(no_thread):
    no_thread()
    told = []
    manipulator = Manipulator.__new__(Manipulator)
    manipulator._executor = SimpleNamespace(system=SimpleNamespace(ask_for_adjustable=lambda: None))
    manipulator._standby = SimpleNamespace(changed=lambda: told.append("changed"))
    manipulator._on_change(runs=True)
    assert told == ["changed"]


def test_heartbeat_writes_the_end_that_a_silent_master_has_not_taken(monkeypatch, failing):
    written = []
    monkeypatch.setattr(rospy, "resolve_name", lambda name: name)
    monkeypatch.setattr(module, "set_parameters", written.append)
    failing(module, "set_parameters", SilentError("the master does not answer", "timed out"), times=1)
    journal = JournalParameter(Journal())
    journal.update(lambda journal, now: journal.noted({}, now, ended=True))
    assert written == []
    for _ in range(2):
        journal.update(lambda journal, now: journal)
    assert [parameter["~journal"]["ended"] for parameter in written] == [True]
