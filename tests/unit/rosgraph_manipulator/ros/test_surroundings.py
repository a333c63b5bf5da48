"""The clock, the master and the nodes, as the manipulator sees them on ROS."""

import pytest
from node_kit.io.background import NoThreadError
from rosgraph_manipulator.ros import surroundings
from rosgraph_manipulator.ros.surroundings import RosSurroundings
from rospy.exceptions import TransportTerminated


@pytest.fixture
def around(monkeypatch):
    monkeypatch.setattr(surroundings.rospy, "Publisher", lambda *_, **__: None)
    monkeypatch.setattr(surroundings.NodeApi, "is_answering", lambda node: node == "/nav")
    return RosSurroundings()


def test_nodes_that_do_not_answer_are_silent(around):
    assert around.silent(["/nav", "/arm"]) == {"/arm"}
    assert around.silent([]) == set()


def test_change_fails_where_no_thread_asks_the_nodes(around, no_thread):
    no_thread()
    with pytest.raises(NoThreadError) as caught:
        around.silent(["/nav"])
    assert isinstance(caught.value, around.failures)


def test_node_that_ends_during_a_call_fails_the_change_alone(around):
    assert issubclass(TransportTerminated, around.failures)
