"""What a node thinks of its master, from answers, refusals and silences with time stamps."""

import pytest
from node_kit.master import (
    LONG_TIMEOUT,
    PATIENCE,
    PERIOD,
    SECOND_LOOK,
    TIMEOUT,
    Answer,
    Refusal,
    Silence,
    Standing,
    View,
)

SILENCE = Silence("timed out")
URI = "http://localhost:11311"


def view_after(*events, patience=PATIENCE):
    """Return the view after (what came, when it was asked, when it came), ..."""
    view = View()
    for came, asked, now in events:
        assert not view.lost, "nobody asks a master that is lost"
        view = view.after(came, asked, now, patience)
    return view


def live(node):
    """Return the standings, with their times, that a node sees which asks as it should; `node` answers a time."""
    view, now, seen = View(), 0.0, []
    while not view.lost and now < 60.0:
        came, took = node(now, view.timeout(now))
        view = view.after(came, now, now + took)
        now += took
        seen.append((view.standing, now))
        now += view.pause
    return seen


def test_master_that_answers_is_there():
    assert view_after((Answer(7), 0.0, 0.0), (Answer(7), 0.3, 0.3)).standing is Standing.THERE


def test_one_refusal_is_not_yet_the_end():
    assert view_after((Answer(7), 0.0, 0.0), (Refusal(), 0.3, 0.3)).standing is Standing.REFUSED
    assert view_after((Refusal(), 0.0, 0.0), (Answer(7), 0.2, 0.2)).standing is Standing.THERE


def test_refusals_must_be_apart_to_count():
    soon = 0.05
    assert view_after((Refusal(), 0.0, 0.0), (Refusal(), soon, soon)).standing is Standing.REFUSED
    assert view_after((Refusal(), 0.0, 0.0), (Refusal(), SECOND_LOOK, SECOND_LOOK)).standing is Standing.GONE


def test_refusals_with_an_answer_or_a_silence_between_do_not_add_up():
    for between in (Answer(7), SILENCE):
        view = view_after((Refusal(), 0.0, 0.0), (between, 1.0, 1.0), (Refusal(), 2.0, 2.0))
        assert view.standing is Standing.REFUSED


def test_other_master_at_the_address_is_lost_at_once():
    assert view_after((Answer(7), 0.0, 0.0), (Answer(8), 0.3, 0.3)).standing is Standing.ANOTHER


def test_silence_is_borne_for_the_patience():
    assert view_after((SILENCE, 0.0, 1.2), (SILENCE, 1.5, 9.9)).standing is Standing.SILENT
    assert view_after((SILENCE, 0.0, 1.2), (SILENCE, 1.5, 10.0)).standing is Standing.MUTE
    assert view_after((SILENCE, 0.0, 1.2), patience=1.0).standing is Standing.MUTE


def test_answer_ends_a_silence():
    view = view_after((SILENCE, 0.0, 1.2), (Answer(7), 9.0, 9.5), (SILENCE, 9.8, 11.0))
    assert view.standing is Standing.SILENT
    assert view.silent_since == 9.8


def test_silence_goes_on_through_a_refusal():
    assert view_after((SILENCE, 0.0, 1.2), (Refusal(), 5.0, 5.0), (SILENCE, 6.0, 10.0)).standing is Standing.MUTE


@pytest.mark.parametrize("dies_at", [0.01, 0.29, 0.31, 3.0])
def test_death_is_known_well_within_two_seconds(dies_at):
    seen = live(lambda now, _: (Answer(7) if now < dies_at else Refusal(), 0.0))
    standing, at = seen[-1]
    assert standing is Standing.GONE
    assert at - dies_at <= PERIOD + SECOND_LOOK + 1e-9


@pytest.mark.parametrize("hangs_at", [0.01, 0.29, 0.31, 3.0])
def test_silence_is_told_within_two_seconds_and_ends_the_node_after_the_patience(hangs_at):
    seen = live(lambda now, timeout: (Answer(7), 0.0) if now < hangs_at else (SILENCE, timeout))
    told = next(at for standing, at in seen if standing is Standing.SILENT)
    assert told - hangs_at < 2.0
    standing, at = seen[-1]
    assert standing is Standing.MUTE
    assert PATIENCE <= at - hangs_at < PATIENCE + 1.0


def test_slow_answers_of_an_overloaded_master_do_not_end_the_node():
    slow = (TIMEOUT + LONG_TIMEOUT) / 2
    seen = live(lambda _, timeout: (SILENCE, timeout) if timeout < slow else (Answer(7), slow))
    assert {standing for standing, _ in seen} == {Standing.SILENT, Standing.THERE}


def test_each_loss_has_its_own_line():
    gone = (Refusal(), 1.0, 1.0), (Refusal(), 2.0, 2.0)
    known = (Answer(7), 0.0, 0.0)
    assert view_after(*gone).text(URI, "so").startswith(f"no ROS master answers at {URI}: start roscore")
    assert view_after(known, *gone).text(URI, "so") == f"ROS master {URI} is gone: so"
    assert f"{URI} is another one" in view_after(known, (Answer(8), 1.0, 1.0)).text(URI, "so")
    silent = view_after(known, (SILENCE, 1.0, 2.2))
    assert silent.text(URI, "so") == f"ROS master {URI} does not answer (timed out): it ends if that lasts for 10 s"
