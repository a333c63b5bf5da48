"""What is heard becomes the state of the page; the systems are unlike the demonstrators."""

from types import SimpleNamespace as Thing

import pytest
from metacontrol_bags.decision import Decision
from metacontrol_bags.record import Event
from metacontrol_dashboard.state.feed import Feed
from metacontrol_dashboard.state.recording import Recorder
from metacontrol_dashboard.state.store import Store
from node_kit.parts import Sign


@pytest.fixture
def store():
    return Store()


@pytest.fixture
def feed(store):
    return Feed(store, "/boat")


def stamp(seconds):
    return Thing(secs=int(seconds), nsecs=round((seconds - int(seconds)) * 1e9))


def status(message, *values, name="", level=0, hardware_id="robot:/boat"):
    pairs = [Thing(key=key, value=value) for key, value in values]
    return Thing(message=message, name=name, level=level, hardware_id=hardware_id, values=pairs)


def tell(feed, now, *statuses, publisher="/boat/rosgraph_monitor"):
    feed.take_diagnostics(Thing(header=Thing(stamp=stamp(now)), status=list(statuses)), now, now, publisher)


def lines(store):
    return [line["text"] for line in store.changes()["add"].get("timeline", [])]


def test_component_has_its_health_reason_and_history(store, feed):
    tell(feed, 1.0, status("Component status", ("sonar", "TRUE")))
    tell(feed, 2.0, status("Component status", ("sonar", "FALSE"), ("reason", "silent"), level=2))
    tell(feed, 3.0, status("Component status", ("sonar", "FALSE"), ("reason", "silent"), level=2))
    tell(feed, 4.0, status("Component status", ("sonar", "RECOVERED")))
    assert store.get("component", "sonar") == {
        "status": "RECOVERED",
        "reason": "",
        "since": 4.0,
        "failures": 1,
        "history": [[1.0, "TRUE", ""], [2.0, "FALSE", "silent"], [4.0, "RECOVERED", ""]],
    }
    assert lines(store) == ["component sonar has failed", "component sonar is back"]


def test_levels_are_a_log_and_a_stale_one_is_a_gap(store, feed):
    tell(feed, 1.0, status("QA status", ("noise", "0.5")))
    tell(feed, 2.0, status("QA stale", ("noise", "no message"), level=3))
    assert store.changes()["add"]["level/noise"] == [[1.0, 0.5], [2.0, None]]
    assert store.get("quality", "noise") == {"level": None, "stamp": 2.0}


def test_passed_limit_is_a_line(store, feed):
    feed.take_limits({"noise": 0.4})
    tell(feed, 1.0, status("QA status", ("noise", "0.5")))
    assert lines(store) == ["noise 0.50 is above 0.4"]


def test_finding_that_is_not_repeated_is_over(store, feed):
    tell(feed, 1.0, status("Missing node", ("reason", "dead"), ("actual", "dead"), name="sonar", level=2))
    assert [store.get("finding", key)["name"] for key in store.keys("finding")] == ["sonar"]
    feed.look(10.0)
    assert store.keys("finding") == []


def test_another_robot_is_not_heard(store, feed):
    tell(feed, 1.0, status("Component status", ("sonar", "FALSE"), hardware_id="robot:/buoy"))
    assert store.keys("component") == []


def test_cost_of_a_node_has_both_figures(store, feed):
    tell(feed, 1.0, status("CPU Usage", ("sonar", "12.34")), status("Memory Usage", ("sonar", "80")))
    assert store.get("usage", "/sonar") == {"cpu": 12.3, "memory": 80.0}


def test_decision_keeps_the_moment_at_which_it_was_made(store, feed):
    feed.take_decision(Decision("a", "DECIDED", "o_sail", "component:sonar", "slow", "blind", stamp=5.0))
    feed.take_decision(Decision("a", "EXECUTED", "o_sail", "component:sonar", "slow", "blind", stamp=6.0))
    found = store.get("decision", "a")
    assert (found["state"], found["stamp"], found["first"]) == ("EXECUTED", 6.0, 5.0)
    assert "slow -> blind done" in lines(store)


def test_proposal_is_no_fault(store, feed):
    feed.take_decision(Decision("a", "PROPOSED", "o_sail", "component:sonar", "slow", "blind", stamp=5.0))
    [line] = store.changes()["add"]["timeline"]
    assert (line["text"], line["bad"]) == ("slow -> blind waits for approval", False)


def test_configurations_are_a_log_of_changes(store, feed):
    for now, state in ((1.0, "STABLE"), (2.0, "STABLE"), (3.0, "RECONFIGURING")):
        functions = [Thing(function="f_sail", configuration="slow", state=state)]
        feed.take_configuration(Thing(header=Thing(stamp=stamp(now)), functions=functions), now)
    feed.take_configuration(Thing(header=Thing(stamp=stamp(4.0)), functions=[]), 4.0)
    assert store.changes()["add"]["configuration"] == [
        [1.0, "f_sail", "slow", "STABLE"],
        [3.0, "f_sail", "slow", "RECONFIGURING"],
        [4.0, "f_sail", "", ""],
    ]
    assert store.keys("function") == []


def test_part_that_gives_no_sign_is_silent_and_one_that_ends_is_gone(store, feed):
    feed.take_sign(Sign("/boat/reasoner", "reasoner"), 1.0)
    feed.look(10.0)
    assert store.get("part", "/boat/reasoner") == {"part": "reasoner", "silent": True}
    feed.take_sign(Sign("/boat/reasoner", "reasoner", ends=True), 11.0)
    assert store.keys("part") == []


def test_robot_that_stands_is_not_told_again(store, feed):
    feed.take_pose(1.0, 2.0, 0.5)
    version = store.version
    feed.take_pose(1.001, 2.0, 0.5)
    assert store.version == version


def test_frames_of_a_recording_bring_the_whole_state(store, feed):
    recorder = Recorder(store)
    for number in range(30):
        feed.take_event(Event(number / 20, "PERTURBATION", f"component:{number}", {}))
        recorder.look(number / 20)
    recorder.cut(2.0)
    added = [line for _, change in recorder.frames for line in change["add"].get("timeline", [])]
    assert len(added) == 30
    assert len(recorder.frames) < 20


def test_end_of_a_mission_is_told(store, feed):
    def event(kind, **values):
        return Event(9.0, kind, "r1", values)

    feed.take_event(event("MISSION_END", outcome="aborted", reason="move_base: no way"))
    assert store.get("mission", "end") == {"ok": False, "text": "move_base: no way", "stamp": 9.0}
    feed.take_event(event("MISSION_START"))
    assert store.get("mission", "end") is None
    feed.take_event(event("MISSION_END", outcome="reached"))
    assert store.get("mission", "end") == {"ok": True, "text": "goal reached", "stamp": 9.0}
