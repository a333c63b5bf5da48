"""Messages of processes and connections that others have followed."""

from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
from node_kit.ros.connections import ConnectionHeader, latest
from node_kit.succession import Succession
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import TCPROSSub
from std_msgs.msg import String


def test_former_connection_is_late_once_the_next_one_was_heard():
    succession = Succession()
    assert not succession.is_late("/a", 3)
    assert not succession.is_late("/a", 7)
    assert succession.is_late("/a", 3)
    assert not succession.is_late("/a", 7)


def test_former_connection_that_is_first_heard_after_the_next_one_is_late_too():
    succession = Succession()
    assert not succession.is_late("/a", 7)
    assert succession.is_late("/a", 3)
    assert not succession.is_late("/a", 7), "else nothing of the present one would be taken any more"


def test_publishers_do_not_follow_each_other():
    succession = Succession()
    assert not any(succession.is_late(*message) for message in [("/a", 1), ("/b", 2), ("/a", 1), ("", 3), ("", 0)])


@given(st.lists(st.integers(0, 9)))
def test_connections_that_are_heard_never_go_back(heard):
    succession = Succession()
    taken = [number for number in heard if not succession.is_late("/a", number)]
    assert taken == sorted(taken)
    assert set(taken) == {number for at, number in enumerate(heard) if number >= max(heard[: at + 1])}


def test_callback_gets_what_is_not_late():
    taken = []
    take = latest(lambda message: taken.append(message.data))
    former, present, other = (ConnectionHeader({"callerid": name}) for name in ("/a", "/a", "/b"))
    for data, header in enumerate((former, former, present, former, other, present)):
        take(SimpleNamespace(data=data, _connection_header=header))
    take(SimpleNamespace(data=6, _connection_header={}))  # some publishers do not tell their name
    assert taken == [0, 1, 2, 4, 5, 6]


def test_connections_of_rospy_are_numbered_as_they_are_made():
    latest(print)
    said = {"callerid": "/a", "type": String._type, "md5sum": String._md5sum, "latching": "1"}
    made = [TCPROSTransport(TCPROSSub("chatter", String, "/b"), "chatter") for _ in range(3)]
    for transport in made:
        transport._validate_header(said)
    assert [transport.header == said for transport in made] == [True] * 3
    numbers = [transport.header.number for transport in made]
    assert numbers == sorted(set(numbers))
    assert made[0].is_latched, "rospy has taken it in"
