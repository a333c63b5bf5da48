"""What becomes of requests that come while another one is carried out."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosgraph_manipulator.change.request_queue import Policy, RequestQueue


def busy(policy):
    requests = RequestQueue(policy)
    requests.arrive("first", "f")
    assert requests.next() == "first"
    return requests


def test_waiting_requests_come_in_order():
    requests = busy(Policy.WAIT)
    assert requests.arrive("second", "f").accepted
    assert requests.arrive("third", "f").accepted
    assert requests.next() is None
    requests.finish()
    assert requests.next() == "second"


def test_newer_request_replaces_all_others():
    requests = busy(Policy.REPLACE)
    assert requests.arrive("second", "f").interrupts
    assert requests.arrive("third", "f").dropped == ("second",)
    requests.finish()
    assert requests.next() == "third"


def test_request_is_refused_while_another_one_runs():
    requests = busy(Policy.REFUSE)
    assert not requests.arrive("second", "f").accepted
    requests.finish()
    assert requests.arrive("third", "f").accepted


def test_waiting_request_can_be_taken_back():
    requests = busy(Policy.WAIT)
    requests.arrive("second", "f")
    assert requests.take_back("second")
    assert not requests.take_back("second")
    assert not requests.take_back("first")
    requests.finish()
    assert requests.next() is None


@pytest.mark.parametrize("policy", [Policy.REPLACE, Policy.REFUSE])
def test_requests_of_different_functions_do_not_concern_each_other(policy):
    requests = busy(policy)
    arrival = requests.arrive("second", "g")
    assert (arrival.accepted, arrival.interrupts, arrival.dropped) == (True, False, ())
    if policy is Policy.REPLACE:
        assert requests.arrive("third", "f").dropped == ()
    requests.finish()
    assert requests.next() == "second"


MOVES = st.tuples(st.sampled_from(["arrive", "next", "finish", "take_back"]), st.sampled_from("fg"))


@given(st.sampled_from(Policy), st.lists(MOVES))
def test_every_accepted_request_runs_once_or_is_dropped_or_taken_back(policy, moves):
    requests, open_requests, count = RequestQueue(policy), set(), 0
    for move, function in moves:
        if move == "arrive":
            count += 1
            arrival = requests.arrive(str(count), function)
            open_requests -= set(arrival.dropped)
            open_requests |= {str(count)} if arrival.accepted else set()
        elif move == "next":
            request = requests.next()
            if request is not None:
                open_requests.remove(request)
        elif move == "finish":
            requests.finish()
        elif requests.take_back(str(count)):
            open_requests.remove(str(count))
    while open_requests:
        requests.finish()
        open_requests.remove(requests.next())
    requests.finish()
    assert requests.next() is None
