"""What was grounded when, as the picture of a mission of D1 shows it."""

from metacontrol_bags.record import ConfigurationReport, Event, MissionRecord
from metacontrol_bags.words import MissionEvent
from metacontrol_experiments.pyramid.figure import spans
from metacontrol_experiments.pyramid.record import PyramidRecord

EVENTS = (Event(10.0, MissionEvent.MISSION_START, ""), Event(50.0, MissionEvent.MISSION_END, ""))


def record(*messages):
    groundings = tuple(tuple(ConfigurationReport(stamp, *told) for told in reports) for stamp, reports in messages)
    return PyramidRecord(MissionRecord(events=EVENTS), groundings)


def shown(asked, function):
    return [(begin, until, report.configuration, report.state) for begin, until, report in spans(asked, function)]


def test_grounding_lasts_until_another_one_or_the_release_though_all_of_it_has_one_stamp():
    one, two, move = ("pick", "one", "STABLE"), ("pick", "two", "STABLE"), ("move", "drive", "STABLE")
    asked = record((5.0, [one]), (20.0, [one, move]), (30.0, [two, move]), (30.0, [two]))
    assert shown(asked, "pick") == [(10.0, 30.0, "one", "STABLE"), (30.0, 50.0, "two", "STABLE")]
    assert shown(asked, "move") == [(20.0, 30.0, "drive", "STABLE")]


def test_what_is_over_before_the_mission_or_begins_after_it_is_not_shown():
    pick = ("pick", "one", "STABLE")
    assert shown(record((1.0, [pick]), (5.0, []), (60.0, [pick])), "pick") == []


def test_change_is_a_span_of_its_own():
    asked = record((5.0, [("pick", "one", "STABLE")]), (20.0, [("pick", "two", "RECONFIGURING")]))
    assert [state for *_, state in shown(asked, "pick")] == ["STABLE", "RECONFIGURING"]


def test_record_without_groundings_shows_none():
    assert shown(record(), "pick") == []
