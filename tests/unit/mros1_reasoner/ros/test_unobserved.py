"""Lines about qualities that can't be observed."""

from mros1_reasoner.ros.unobserved import Unobserved


def test_a_reason_that_changes_is_told_once_in_a_period():
    unobserved = Unobserved(period=60.0)
    said = {now: unobserved.stale(now, "age", f"last message is {now} s old") for now in range(121)}
    assert {now: text for now, text in said.items() if text} == {
        now: f"QA age can't be observed: last message is {now} s old" for now in (0, 60, 120)
    }


def test_each_quality_is_told():
    unobserved = Unobserved()
    assert unobserved.stale(0.0, "age", "")
    assert unobserved.stale(0.0, "noise", "") == "QA noise can't be observed: no reason given"


def test_the_end_is_told_once_and_only_if_the_beginning_was():
    unobserved = Unobserved()
    assert unobserved.observed("age") is None
    unobserved.stale(0.0, "age", "no scan")
    assert [unobserved.observed("age") for _ in range(2)] == ["QA age is observed again", None]


def test_a_quality_that_comes_and_goes_makes_two_lines_in_a_period():
    unobserved, said = Unobserved(period=60.0), []
    for now in range(60):
        said += [unobserved.stale(now, "age", f"{now} s old"), unobserved.observed("age")]
    assert [text for text in said if text] == ["QA age can't be observed: 0 s old", "QA age is observed again"]
    assert unobserved.stale(60.0, "age", "60 s old")
