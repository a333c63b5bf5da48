"""What becomes of requests that come while another one is carried out."""

from hypothesis import given
from hypothesis import strategies as st
from rosgraph_manipulator.change.request_queue import Policy, RequestQueue


def busy(policy):
    requests = RequestQueue(policy)
    requests.arrive("first")
    assert requests.next() == "first"
    return requests


def test_waiting_requests_come_in_order():
    requests = busy(Policy.WAIT)
    assert requests.arrive("second").accepted
    assert requests.arrive("third").accepted
    assert requests.next() is None
    requests.finish()
    assert requests.next() == "second"


def test_newer_request_replaces_all_others():
    requests = busy(Policy.REPLACE)
    assert requests.arrive("second").interrupts
    assert requests.arrive("third").dropped == ("second",)
    requests.finish()
    assert requests.next() == "third"


def test_request_is_refused_while_another_one_runs():
    requests = busy(Policy.REFUSE)
    assert not requests.arrive("second").accepted
    requests.finish()
    assert requests.arrive("third").accepted


def test_waiting_request_can_be_taken_back():
    requests = busy(Policy.WAIT)
    requests.arrive("second")
    assert requests.take_back("second")
    assert not requests.take_back("second")
    assert not requests.take_back("first")
    requests.finish()
    assert requests.next() is None


@given(st.sampled_from(Policy), st.lists(st.sampled_from(["arrive", "next", "finish", "take_back"])))
def test_every_accepted_request_runs_once_or_is_dropped_or_taken_back(policy, moves):
    requests, open_requests, count = RequestQueue(policy), set(), 0
    for move in moves:
        if move == "arrive":
            count += 1
            arrival = requests.arrive(str(count))
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
