"""Parts that watch over each other: who is lost, and who tells it."""

import math

import pytest
from node_kit.parts import FORGOTTEN_AFTER, HANGS_AFTER, SILENCE, STARTS_WITHIN, Answer, Parts, Sign

MONITOR = Sign("/greenhouse/rosgraph_monitor", "monitor", "http://a:1", 300.0)
REASONER = Sign("/greenhouse/reasoner", "reasoner", "http://a:2", 100.0)
OWN = "/greenhouse/rosgraph_manipulator"


@pytest.fixture
def parts():
    """Return what the manipulator knows, which has heard of two others."""
    parts = Parts(OWN, 200.0)
    for sign in (MONITOR, REASONER, Sign(OWN, "manipulator", "http://a:3", 200.0)):
        parts.hear(sign, 0.0)
    return parts


def test_who_gives_signs_is_not_asked(parts):
    assert parts.doubtful(SILENCE) == []
    parts.hear(MONITOR, 1.0)
    assert parts.doubtful(SILENCE + 0.1) == [REASONER]


def test_who_answers_without_signs_is_not_lost(parts):
    parts.note(REASONER.node, Answer.LIVES, 2.0)
    assert parts.lost() == {}
    assert parts.doubtful(1.9 + SILENCE) == [MONITOR]


def test_who_is_gone_is_lost_at_once(parts):
    parts.note(MONITOR.node, Answer.GONE, 2.0)
    assert parts.lost() == {MONITOR.node: "its process has ended"}
    parts.hear(Sign(MONITOR.node, "monitor", "http://a:9", 900.0), 5.0)
    assert parts.lost() == {}


def test_an_answer_from_the_address_of_before_brings_nobody_back(parts):
    """A port may be somebody else's by then."""
    parts.note(MONITOR.node, Answer.GONE, 2.0)
    parts.note(MONITOR.node, Answer.LIVES, 3.0)
    assert parts.lost()


def test_who_hangs_is_lost_after_a_while(parts):
    parts.note(MONITOR.node, Answer.SILENT, HANGS_AFTER - 0.1)
    assert parts.lost() == {}
    parts.note(MONITOR.node, Answer.SILENT, HANGS_AFTER)
    assert parts.lost() == {MONITOR.node: "it does not answer"}


def test_who_was_asked_to_end_is_not_lost(parts):
    """Whoever ends in order takes its leave of the master."""
    parts.note(MONITOR.node, Answer.ENDED, 2.0)
    assert MONITOR.node not in parts.known
    parts.note(MONITOR.node, Answer.GONE, 2.0)  # it had been asked meanwhile
    assert parts.lost() == {}


def test_last_sign_says_that_a_part_ends(parts):
    parts.hear(Sign(MONITOR.node, "monitor", "http://a:1", 300.0, ends=True), 1.0)
    assert MONITOR.node not in parts.known


def test_who_was_started_again_has_some_time_until_it_gives_signs(parts):
    parts.note(MONITOR.node, Answer.STARTS, STARTS_WITHIN - 0.1)
    assert parts.lost() == {}
    parts.note(MONITOR.node, Answer.STARTS, STARTS_WITHIN)
    assert parts.lost() == {MONITOR.node: "it was started again, but gives no sign of life"}


def test_who_hung_and_is_ended_then_is_not_there_again(parts):
    parts.note(REASONER.node, Answer.SILENT, HANGS_AFTER)
    assert REASONER.node in parts.to_tell()
    parts.note(REASONER.node, Answer.ENDED, 9.0)
    assert parts.to_tell() == {}


def test_the_one_that_has_run_for_longest_tells(parts):
    parts.note(MONITOR.node, Answer.GONE, 2.0)
    assert parts.to_tell() == {}, "the reasoner has run for longer"
    parts.note(REASONER.node, Answer.GONE, 2.0)
    assert list(parts.to_tell()) == [REASONER.node, MONITOR.node]
    assert list(parts.to_tell()) == [REASONER.node, MONITOR.node], "it is told again and again"


def test_of_two_that_were_started_at_once_the_first_by_name_tells():
    parts = Parts(OWN, 100.0)
    parts.hear(REASONER, 0.0)
    parts.hear(MONITOR, 0.0)
    parts.note(MONITOR.node, Answer.GONE, 2.0)
    assert parts.to_tell() == {}


def test_head_start_is_that_of_the_oldest_other_part(parts):
    assert parts.head_start() == 100.0
    parts.note(REASONER.node, Answer.GONE, 2.0)
    assert parts.head_start() == 0.0, "the monitor was started later, and the reasoner is no more"


@pytest.mark.parametrize(
    ("uri", "started"),
    [("", 50.0), ("a:4", 50.0), *(("http://a:4", started) for started in (0.0, -1.0, math.inf, -math.inf, math.nan))],
)
def test_sign_that_is_none_of_a_part_changes_nothing(parts, uri, started):
    """Who gives one once would be lost for ever, or be the one that has run for longest and is to tell."""
    parts.hear(Sign("/stranger", "", uri, started), 0.0)
    parts.note(MONITOR.node, Answer.GONE, 2.0)
    parts.note(REASONER.node, Answer.GONE, 2.0)
    assert "/stranger" not in parts.known
    assert list(parts.to_tell()) == [REASONER.node, MONITOR.node]
    assert parts.head_start() == 0.0


def test_part_on_a_host_whose_clock_was_set_back_is_a_part(parts):
    parts.hear(Sign("/late", "launcher", "http://a:4", 1e9), 0.0)
    assert "/late" in parts.known


def test_silent_part_that_the_master_does_not_know_is_forgotten_some_time(parts):
    for answer, now in [(Answer.SILENT, FORGOTTEN_AFTER), (Answer.UNKNOWN, FORGOTTEN_AFTER - 0.1)]:
        parts.note(REASONER.node, answer, now)
        assert REASONER.node in parts.to_tell()
    parts.note(REASONER.node, Answer.UNKNOWN, FORGOTTEN_AFTER)
    assert REASONER.node not in parts.known
    assert parts.to_tell() == {}, "it is not there again"


def test_one_that_was_started_after_the_loss_keeps_nobody_from_telling_it(parts):
    """It can't know of it."""
    parts.hear(Sign(REASONER.node, "reasoner", "http://a:9", 900.0), 1.0)
    parts.note(MONITOR.node, Answer.GONE, 2.0)
    assert list(parts.to_tell()) == [MONITOR.node]


def test_who_has_told_a_loss_tells_the_return_once(parts):
    parts.note(REASONER.node, Answer.GONE, 2.0)
    parts.to_tell()
    parts.hear(Sign(REASONER.node, "reasoner", "http://a:9", 900.0), 5.0)
    assert parts.to_tell() == {REASONER.node: ""}
    assert parts.to_tell() == {}


def test_who_only_looks_on_hears_all():
    parts = Parts()
    parts.hear(MONITOR, 0.0)
    assert list(parts.known) == [MONITOR.node]
