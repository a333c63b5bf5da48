"""The node itself, without ROS."""

from types import SimpleNamespace

from rosgraph_manipulator.ros.manipulator import Manipulator


def test_change_ends_well_where_no_thread_asks_nodes_for_their_parameters_afterwards(no_thread):
    no_thread()
    told = []
    manipulator = Manipulator.__new__(Manipulator)
    manipulator._executor = SimpleNamespace(system=SimpleNamespace(ask_for_adjustable=lambda: None))
    manipulator._standby = SimpleNamespace(changed=lambda: told.append("changed"))
    manipulator._on_change(runs=True)
    assert told == ["changed"]
