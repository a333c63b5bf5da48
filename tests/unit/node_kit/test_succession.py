"""Messages of processes and connections that others have followed."""

from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
from node_kit.ros.connections import latest
from node_kit.succession import Succession


def test_former_connection_is_late_once_the_next_one_was_heard():
    succession = Succession()
    former, present = {"callerid": "/a"}, {"callerid": "/a"}  # equal, but two connections
    assert not succession.is_late("/a", former)
    assert not succession.is_late("/a", present)
    assert succession.is_late("/a", former)
    assert not succession.is_late("/a", present)


def test_publishers_do_not_follow_each_other():
    succession = Succession()
    one, other = object(), object()
    assert not any(succession.is_late(name, link) for name, link in [("/a", one), ("/b", other), ("/a", one)])


@given(st.lists(st.integers(0, 9)))
def test_connections_that_are_heard_never_go_back(heard):
    succession, links = Succession(), [object() for _ in range(10)]
    taken = [number for number in heard if not succession.is_late("/a", links[number])]
    order = list(dict.fromkeys(heard))
    assert taken == sorted(taken, key=order.index)
    assert list(dict.fromkeys(taken)) == order  # each is heard until the next one is


def test_callback_gets_what_is_not_late():
    taken = []
    take = latest(lambda message: taken.append(message.data))
    former, present, other = ({"callerid": name} for name in ("/a", "/a", "/b"))
    for data, header in enumerate((former, former, present, former, other, present)):
        take(SimpleNamespace(data=data, _connection_header=header))
    take(SimpleNamespace(data=6, _connection_header={}))  # some publishers do not tell their name
    assert taken == [0, 1, 2, 4, 5, 6]
