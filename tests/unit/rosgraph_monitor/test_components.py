"""Status of components over time."""

import pytest
from rosgraph_monitor.components import (
    ComponentStatus,
    ComponentTracker,
    NodeCondition,
    component_statuses,
    parse_mapping,
)
from rosgraph_monitor.status import Level, Status

ALIVE, GONE, UNKNOWN = NodeCondition.ALIVE, NodeCondition.GONE, NodeCondition.UNKNOWN
TRUE, FALSE, RECOVERED = ComponentStatus.TRUE, ComponentStatus.FALSE, ComponentStatus.RECOVERED


def history(tracker, *steps, excused=(), patience=None):
    """Feed (time, condition) of the node `laser`; return what is said of it each time."""
    said = []
    for now, condition in steps:
        statuses = tracker.update({"laser": condition}, now, excused=excused, patience=patience)
        said.append(statuses[0][1] if statuses else None)
    return said


def test_death_is_false_until_the_return_which_is_recovered_once():
    steps = (0.0, ALIVE), (0.5, GONE), (1.0, GONE), (1.5, ALIVE), (2.0, ALIVE)
    assert history(ComponentTracker({}), *steps) == [TRUE, FALSE, FALSE, RECOVERED, TRUE]


def test_node_that_never_ran_fails_after_the_grace():
    tracker = ComponentTracker({}, grace=2.0)
    assert history(tracker, (0.0, GONE), (1.9, GONE)) == [None, None]
    assert tracker.waited_for == {"laser"}
    assert history(tracker, (2.0, GONE), (3.0, ALIVE)) == [FALSE, RECOVERED]


def test_node_that_is_not_asked_yet_is_not_judged():
    assert history(ComponentTracker({}), (0.0, UNKNOWN), (1.0, ALIVE), (2.0, UNKNOWN)) == [None, TRUE, None]


def test_failed_node_stays_failed_until_its_successor_answers():
    steps = (0.0, ALIVE), (1.0, GONE), (2.0, UNKNOWN), (3.0, ALIVE)
    assert history(ComponentTracker({}), *steps) == [TRUE, FALSE, FALSE, RECOVERED]


def test_patience_lets_a_restart_be_announced():
    steps = (0.0, ALIVE), (1.0, GONE), (1.9, GONE), (2.0, GONE)
    assert history(ComponentTracker({}), *steps, patience={"laser": 1.0}) == [TRUE, None, None, FALSE]


def test_excused_node_is_not_judged_and_comes_back_as_if_nothing_was():
    tracker = ComponentTracker({})
    assert history(tracker, (0.0, ALIVE)) == [TRUE]
    assert history(tracker, (1.0, GONE), (2.0, GONE), excused={"laser"}) == [None, None]
    assert history(tracker, (3.0, ALIVE)) == [TRUE]


def test_node_that_failed_before_the_excuse_recovers_after_it():
    tracker = ComponentTracker({})
    assert history(tracker, (0.0, ALIVE), (1.0, GONE)) == [TRUE, FALSE]
    assert history(tracker, (2.0, ALIVE), excused={"laser"}) == [None]
    assert history(tracker, (3.0, ALIVE), (4.0, ALIVE)) == [RECOVERED, TRUE]


def test_node_that_is_not_expected_any_more_is_forgotten():
    tracker = ComponentTracker({}, grace=1.0)
    assert history(tracker, (0.0, ALIVE), (1.0, GONE)) == [TRUE, FALSE]
    assert tracker.update({}, 2.0) == []
    assert history(tracker, (3.0, ALIVE)) == [TRUE]


def test_node_maps_to_its_component():
    tracker = ComponentTracker(parse_mapping({"laser_resender": {"node": "/laser"}}))
    assert tracker.update({"laser": ALIVE}, 0.0) == [("laser_resender", TRUE)]


@pytest.mark.parametrize("value", [[], {"a": "b"}, {"a": {"node": 1}}, {"a": {"node": "/"}}])
def test_mapping_of_another_shape_is_refused(value):
    with pytest.raises(ValueError, match="components"):
        parse_mapping(value)


def test_published_form():
    assert component_statuses([("laser", FALSE), ("base", RECOVERED)]) == [
        Status(Level.ERROR, "laser", "Component status", (("laser", "FALSE"),)),
        Status(Level.OK, "base", "Component status", (("base", "RECOVERED"),)),
    ]
