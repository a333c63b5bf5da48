"""A decision to a message and back, and in words."""

import io
from dataclasses import replace
from types import SimpleNamespace

import pytest
from bag_helpers import Types
from metacontrol_bags import messages
from metacontrol_bags.decision import RELIEF, Candidate, Cause
from metacontrol_bags.decision_tables import render
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.planning.log_line import line
from reasoner_helpers import OBJECTIVE
from rich.console import Console


@pytest.fixture
def decide(knowledge_base, reasoner):
    """Return a function that decides because of a limit, or of a component."""

    def decide(cause="qa", **settings):
        core = Mape(knowledge_base, reasoner, [OBJECTIVE], Settings(correct_expected=False, **settings))
        core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
        for tick in range(60):
            if cause == "qa":
                core.observe_level(tick / 10, "safety", 0.75, stamp=tick / 10)
            else:
                core.observe_component(tick / 10, cause, "FALSE", tick / 10)
            if decisions := core.step(tick / 10):
                return decisions[0]
        raise AssertionError("no decision")

    return decide


def test_message_and_back(decide):
    record = decide()
    again = messages.decision(Types().decision(record, 5.0), 6.0)
    assert again.reasons[0].stamp == pytest.approx(record.reasons[0].stamp)
    assert again.stamp_monitored == pytest.approx(record.stamp_monitored)
    assert again.stamp == 5.0
    for name in ("candidates", "causes", "explanation", "degraded", "to_configuration", "state", "releases"):
        assert getattr(again, name) == getattr(record, name)


def test_times_of_rospy_and_of_rosbags():
    assert messages.seconds(SimpleNamespace(secs=3, nsecs=500_000_000)) == 3.5
    assert messages.seconds(SimpleNamespace(sec=3, nanosec=500_000_000)) == 3.5


def test_log_line_is_short_and_tells_what_was_violated_by_how_much_and_what_is_done(decide):
    decision = decide()
    told = replace(decision, explanation=f"{decision.explanation}; expected more", corrections=("expected more",))
    assert line(told) == line(decision)
    assert "safety 0.75 > 0.6" in line(decision)
    assert "safety by 25%" in line(decision)
    assert "scan_slow -> scan_slower" in line(decision)
    assert len(line(decision)) < 250


def test_log_line_of_a_dry_run_says_so(decide):
    assert line(decide(dry_run=True)).startswith("dry run, nobody is asked")


def test_refusal_tells_why_every_design_is_out(decide):
    record = decide("base")
    assert record.to_configuration == ""
    assert "stays with scan_slow" in line(record)
    assert all(candidate.lost_because for candidate in record.candidates)


def test_tables_show_every_candidate_with_its_reason(decide):
    console = Console(width=160, record=True, file=io.StringIO())
    record = decide("laser")
    console.print(render(record))
    text = console.export_text()
    for candidate in record.candidates:
        assert candidate.name in text
    assert "requires laser, which does not work" in text
    assert "compError" in text


def test_brackets_in_foreign_names_are_no_markup(decide):
    record = decide("laser")
    odd = record.candidates[0].__class__(**{**record.candidates[0].__dict__, "name": "[bold]x[/bold]"})
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(render(record.__class__(**{**record.__dict__, "candidates": (odd,)})))
    assert "[bold]x[/bold]" in console.export_text()


def test_return_of_a_design_passes_no_limit(decide):
    gone = Cause(1.0, "qa:glare", "what made glare violate the limit has been gone for 5.0 s", RELIEF, quality="glare")
    record = replace(decide(), reasons=(gone,), causes=(gone.text,))
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(render(record))
    assert "limit passed" not in line(record)
    assert "0%" not in console.export_text()


def test_table_says_what_a_number_in_brackets_is(decide):
    legend = "level that counted (level that the model expects)"
    for counted, is_told in ((0.0323, True), (0.05, False)):
        candidate = Candidate("dim_lamp", {"glare": 0.05}, {"glare": counted}, chosen=True)
        console = Console(width=160, record=True, file=io.StringIO())
        console.print(render(replace(decide(), candidates=(candidate,))))
        assert (legend in console.export_text()) == is_told
