"""What a person is told while a mission runs."""

from metacontrol_bags.decision import Decision
from metacontrol_bags.record import ComponentReport, ConfigurationReport, Event, QualityReport
from metacontrol_bags.timeline import Timeline


def test_timeline_tells_changes_only():
    timeline = Timeline({"safety": 0.6})
    said = [
        entry.text
        for report in (
            ComponentReport(1.0, "front_laser", "TRUE"),
            ComponentReport(2.0, "front_laser", "FALSE"),
            ComponentReport(2.1, "front_laser", "FALSE"),
            QualityReport(2.2, "safety", 0.5),
            QualityReport(2.3, "safety", 0.7),
            QualityReport(2.4, "safety", 0.8),
            QualityReport(2.5, "safety", None),
            QualityReport(2.6, "safety", None),
            ConfigurationReport(2.7, "f_navigate", "a", "STABLE"),
            ConfigurationReport(2.8, "f_navigate", "b", "RECONFIGURING"),
            Decision("1", "EXECUTED", "o_navigate", "component:front_laser", "a", "b", stamp=2.9),
            ComponentReport(3.0, "front_laser", "RECOVERED"),
            ComponentReport(3.1, "front_laser", "TRUE"),
            Event(4.0, "MISSION_END", "r1", {"outcome": "reached", "reason": "goal reached"}),
        )
        for entry in timeline.tell(report)
    ]
    assert said == [
        "component front_laser has failed",
        "safety 0.70 is above 0.6",
        "safety cannot be observed: stale",
        "f_navigate: b RECONFIGURING",
        "a -> b done",
        "component front_laser is back",
        "mission over: goal reached",
    ]


def test_decision_tells_analysis_and_plan():
    report = Decision("1", "DECIDED", "o_navigate", "qa:energy", "a", "b", stamp=1.0, degraded=True)
    analysis, plan = Timeline({}).tell(report)
    assert (analysis.step, analysis.text) == ("R2", "o_navigate is violated by qa:energy")
    assert (plan.step, plan.text) == ("R3", "a -> b, degraded")


def test_share_of_the_way_is_shown_as_told_where_it_is_no_number():
    def told(share):
        (entry,) = Timeline({}).tell(Event(1.0, "PERTURBATION", "clutter:1", {"share": share}))
        return entry.text

    assert told("0.25") == "injected: clutter:1 after 25% of the way"
    assert told("half") == "injected: clutter:1 after half of the way"
