"""Decisions on the liveness of one node."""

import errno

from rosgraph_monitor.health.liveness import (
    Action,
    Life,
    Liveness,
    Timing,
    due,
    due_at,
    on_answer,
    on_broken,
    on_closed,
    on_connect_error,
    on_connected,
    on_no_socket,
    on_refused,
)

TIMING = Timing(probe_period=1.0, probe_deadline=3.0, connect_deadline=1.5, retry_period=0.5)


def alive(now=0.0):
    state, action = due(Liveness(), now, TIMING)
    assert action is Action.CONNECT
    state, action = due(on_connected(state, now), now, TIMING)
    assert action is Action.PROBE
    return on_answer(state, now, TIMING)


def test_node_that_answers_is_alive():
    assert alive().life is Life.ALIVE


def test_connection_alone_is_no_sign_of_life():
    assert on_connected(due(Liveness(), 0.0, TIMING)[0], 0.0).life is Life.UNKNOWN


def test_probe_comes_after_its_period():
    assert due(alive(), 0.9, TIMING)[1] is Action.NONE
    assert due(alive(), 1.0, TIMING)[1] is Action.PROBE


def test_closed_connection_and_refused_call_mean_death():
    state = on_closed(alive(), 0.5, TIMING)
    assert state.life is Life.ALIVE
    state, action = due(state, 0.5, TIMING)
    assert action is Action.CONNECT
    state = on_refused(state, 0.5, TIMING)
    assert state.life is Life.DEAD
    assert due(state, 0.9, TIMING)[1] is Action.NONE
    assert due(state, 1.0, TIMING)[1] is Action.CONNECT


def test_server_that_closes_after_each_answer_stays_alive():
    state = alive()
    for now in range(1, 10):
        state, action = due(on_closed(state, now, TIMING), now, TIMING)
        assert action is Action.CONNECT
        state, _ = due(on_connected(state, now), now, TIMING)
        state = on_answer(state, now, TIMING)
        assert state.life is Life.ALIVE


def test_server_that_closes_after_each_answer_is_connected_at_once_and_probed_when_that_is_due():
    state, action = due(on_closed(alive(), 0.01, TIMING), 0.01, TIMING)
    assert action is Action.CONNECT
    state = on_connected(state, 0.02)
    assert due(state, 0.9, TIMING) == (state, Action.NONE)
    assert due(state, 1.0, TIMING)[1] is Action.PROBE
    again, action = due(on_closed(state, 0.03, TIMING), 0.03, TIMING)
    assert action is Action.CONNECT
    assert due(on_connected(again, 0.04), 0.04, TIMING)[1] is Action.PROBE, "it has closed a connection unasked"


def test_server_that_only_closes_is_called_hung_and_not_called_in_a_spin():
    state = Liveness()
    for _ in range(4):
        state = on_closed(state, 1.0, TIMING)
    assert state.life is Life.HUNG
    assert due(state, 1.0, TIMING)[1] is Action.NONE


def test_probe_without_answer_means_hung_and_a_late_answer_revives():
    state, _ = due(alive(), 1.0, TIMING)
    assert due(state, 3.9, TIMING)[0].life is Life.ALIVE
    state, action = due(state, 4.0, TIMING)
    assert (state.life, action) == (Life.HUNG, Action.NONE)
    assert on_answer(state, 9.0, TIMING).life is Life.ALIVE


def test_connection_that_never_stands_means_unreachable():
    state, _ = due(Liveness(), 0.0, TIMING)
    assert due(state, 1.4, TIMING) == (state, Action.NONE)
    state, action = due(state, 1.5, TIMING)
    assert (state.life, action) == (Life.UNREACHABLE, Action.DROP)


def test_connection_reset_while_it_is_made_is_tried_again_and_not_taken_for_an_unreachable_host():
    state = on_connect_error(Liveness(life=Life.ALIVE, connecting_since=1.0), errno.ECONNRESET, 1.1, TIMING)
    assert (state.life, state.next_at, state.connecting_since) == (Life.ALIVE, 1.1, None)
    assert on_connect_error(state, errno.ECONNREFUSED, 1.2, TIMING).life is Life.DEAD
    assert on_connect_error(state, errno.EHOSTUNREACH, 1.2, TIMING).life is Life.UNREACHABLE


def test_lost_host_confirms_nothing_and_a_reset_connection_is_tried_again():
    asked = due(alive(), 1.0, TIMING)[0]
    assert on_broken(asked, errno.ETIMEDOUT, 2.8, TIMING).life is Life.UNREACHABLE
    assert on_broken(asked, errno.ECONNRESET, 2.8, TIMING).life is Life.ALIVE
    assert TIMING.confirmation_deadline < TIMING.probe_deadline


def test_lack_of_sockets_says_nothing_of_the_node():
    state = on_no_socket(due(Liveness(life=Life.ALIVE), 0.0, TIMING)[0], 0.0, TIMING)
    assert state.life is Life.ALIVE
    assert due(state, 0.4, TIMING)[1] is Action.NONE
    assert due(state, 0.5, TIMING)[1] is Action.CONNECT


def test_node_whose_answer_was_lost_with_its_socket_is_asked_anew():
    state = on_no_socket(due(alive(), 1.0, TIMING)[0], 1.1, TIMING)
    assert due_at(state, TIMING) == 1.6
    assert due(state, 1.6, TIMING)[1] is Action.CONNECT


def test_nothing_is_due_before_its_time():
    connecting, _ = due(Liveness(), 0.0, TIMING)
    waiting = alive(1.0)
    asked, _ = due(waiting, 2.0, TIMING)
    for state in (connecting, waiting, asked):
        at = due_at(state, TIMING)
        assert due(state, at - 0.01, TIMING) == (state, Action.NONE)
        assert due(state, at, TIMING) != (state, Action.NONE)
    hung, _ = due(asked, 9.0, TIMING)
    assert due(hung, 99.0, TIMING) == (hung, Action.NONE)
    assert due_at(hung, TIMING) > 99.0
