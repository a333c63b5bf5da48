"""Status of components over time."""

import math

import pytest
from rosgraph_monitor.diagnostics.status import Level, Status
from rosgraph_monitor.health.battery import charge_of, has_failed
from rosgraph_monitor.health.components import (
    ComponentStatus,
    ComponentTracker,
    NodeCondition,
    component_statuses,
    parse_components,
)
from rosgraph_monitor.health.topics import DEFAULT_MAX_AGE

ALIVE, GONE, UNKNOWN = NodeCondition.ALIVE, NodeCondition.GONE, NodeCondition.UNKNOWN
TRUE, FALSE, RECOVERED = ComponentStatus.TRUE, ComponentStatus.FALSE, ComponentStatus.RECOVERED


def history(tracker, *steps, excused=(), patience=None):
    """Feed (time, condition) of the node `laser`; return what is said of it each time."""
    said = []
    for now, condition in steps:
        statuses = tracker.update({"laser": condition}, now, excused=excused, patience=patience)
        said.append(statuses[0][1] if statuses else None)
    return said


def test_death_is_false_until_the_return_which_is_recovered_for_a_while():
    steps = (0.0, ALIVE), (0.5, GONE), (1.0, GONE), (1.5, ALIVE), (2.0, ALIVE), (2.6, ALIVE)
    assert history(ComponentTracker({}, recovery=1.0), *steps) == [TRUE, FALSE, FALSE, RECOVERED, RECOVERED, TRUE]


@pytest.mark.parametrize("period", [0.1, 1.0, 2.0])
def test_reader_that_looks_now_and_then_sees_a_recovery(period):
    """The monitor looks twice in a second, and at once when a node comes back."""
    moments = [0.0, 0.5, 1.0, 1.03, *(1.5 + number / 2 for number in range(20))]
    said = history(ComponentTracker({}), (0.0, ALIVE), (0.5, GONE), *((now, ALIVE) for now in moments[2:]))
    for offset in range(10):
        begin = period * offset / 10
        looks = [begin + period * number for number in range(int(9.0 / period))]
        read = [[s for at, s in zip(moments, said, strict=True) if at <= look][-1] for look in looks]
        assert RECOVERED in read


def test_failure_during_a_recovery_is_told_at_once():
    steps = (0.0, ALIVE), (0.5, GONE), (1.0, ALIVE), (1.1, GONE), (1.2, ALIVE)
    assert history(ComponentTracker({}), *steps) == [TRUE, FALSE, RECOVERED, FALSE, RECOVERED]


def test_successor_of_a_failed_node_is_not_blamed_before_it_is_known():
    tracker = ComponentTracker({})
    assert history(tracker, (0.0, ALIVE), (1.0, GONE)) == [TRUE, FALSE]
    history(tracker, (2.0, GONE), excused={"laser"})
    steps = (2.1, UNKNOWN), (2.2, GONE), (2.3, UNKNOWN), (2.4, ALIVE)
    assert history(tracker, *steps, patience={"laser": 1.0}) == [None, None, None, RECOVERED]


def test_failed_node_that_is_still_gone_after_the_excuse_has_failed():
    tracker = ComponentTracker({})
    assert history(tracker, (0.0, ALIVE), (1.0, GONE)) == [TRUE, FALSE]
    history(tracker, (2.0, GONE), excused={"laser"})
    assert history(tracker, (2.1, GONE), (3.2, GONE), (4.0, UNKNOWN), patience={"laser": 1.0}) == [None, FALSE, FALSE]


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
    assert history(tracker, (3.0, ALIVE), (9.0, ALIVE)) == [RECOVERED, TRUE]


def test_node_that_is_not_expected_any_more_is_forgotten():
    tracker = ComponentTracker({}, grace=1.0)
    assert history(tracker, (0.0, ALIVE), (1.0, GONE)) == [TRUE, FALSE]
    assert tracker.update({}, 2.0) == []
    assert history(tracker, (3.0, ALIVE)) == [TRUE]


def test_node_maps_to_its_component():
    tracker = ComponentTracker(parse_components({"laser_resender": {"node": "/laser"}}).of_node)
    assert tracker.update({"laser": ALIVE}, 0.0) == [("laser_resender", TRUE)]


def test_component_in_a_namespace_is_read_as_the_parameter_server_has_it():
    tree = {"arm": {"driver": {"node": "arm/driver"}, "eye": {"topic": "arm/scan"}}, "torso": {"driver": {"node": "t"}}}
    found = parse_components(tree)
    assert found.of_node == {"arm/driver": "arm/driver", "t": "torso/driver"}
    assert found.topics["arm/scan"].component == "arm/eye"


def test_topic_stands_for_a_component():
    found = parse_components(
        {"laser": {"topic": "/front/scan"}, "camera": {"node": "cam", "topic": "depth", "min_rate": 5}}
    )
    assert found.topics["front/scan"].max_age == DEFAULT_MAX_AGE
    assert (found.topics["depth"].min_rate, found.topics["depth"].component) == (5, "camera")
    assert found.of_node == {"cam": "camera"}


def test_battery_below_a_limit_fails_until_it_is_above_another():
    (battery,) = parse_components({"battery": {"topic": "battery_state", "below": 0.2, "above": 0.3}}).batteries
    charges = (0.5, 0.19, 0.25, 0.31)
    states = [failed := False]
    for charge in charges:
        failed = has_failed(battery, charge, failed)
        states.append(failed)
    assert states[1:] == [False, True, True, False]


@pytest.mark.parametrize(
    ("fields", "charge"),
    [((0.4, 1.0, 2.0), 0.4), ((math.nan, 1.0, 2.0), 0.5), ((math.nan, 1.0, math.nan), None), ((40.0, 0, 0), None)],
)
def test_charge_of_a_battery(fields, charge):
    assert charge_of(*fields) == charge


def test_node_that_runs_but_does_not_work_fails_without_grace_or_patience():
    steps = (0.0, ALIVE), (1.0, NodeCondition.FAILED), (2.0, ALIVE)
    assert history(ComponentTracker({}), *steps, patience={"laser": 9.0}) == [TRUE, FALSE, RECOVERED]
    assert history(ComponentTracker({}), (0.0, NodeCondition.FAILED)) == [FALSE]


@pytest.mark.parametrize(
    "value",
    [
        *([], {"a": "b"}, {"a": {"node": 1}}, {"a": {"node": "/"}}, {"a": {"topic": "t", "max_age": -1}}),
        *({"a": {"topic": "t", "below": 2}}, {"a": {"topic": "t", "below": 0.3, "above": 0.2}}, {"a": {}}),
        *({"a": {"node": "n", "max_age": 1}}, {"a": {"topic": "t", "max_age": math.nan}}),
    ],
)
def test_mapping_of_another_shape_is_refused(value):
    with pytest.raises(ValueError, match="components"):
        parse_components(value)


def test_published_form():
    assert component_statuses([("laser", FALSE), ("base", RECOVERED)]) == [
        Status(Level.ERROR, "laser", "Component status", (("laser", "FALSE"),)),
        Status(Level.OK, "base", "Component status", (("base", "RECOVERED"),)),
    ]
