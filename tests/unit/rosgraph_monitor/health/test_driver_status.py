"""Components follow what their drivers say on /diagnostics."""

import pytest
from rosgraph_monitor.diagnostics.status import Level
from rosgraph_monitor.health.components import NodeCondition, parse_components
from rosgraph_monitor.health.driver_status import DriverStatuses

ALIVE, FAILED, UNKNOWN = NodeCondition.ALIVE, NodeCondition.FAILED, NodeCondition.UNKNOWN


def test_error_of_a_driver_is_a_failure_until_it_is_well_again():
    statuses = DriverStatuses({"left_arm": "left_arm: safety"})
    assert statuses.conditions == {"left_arm": UNKNOWN}
    assert statuses.take("left_arm: safety", Level.OK)
    assert statuses.take("/left_arm: safety", Level.ERROR)
    assert statuses.conditions == {"left_arm": FAILED}
    assert not statuses.take("left_arm: safety", Level.ERROR)
    assert statuses.take("left_arm: safety", Level.WARN)
    assert statuses.conditions == {"left_arm": ALIVE}


def test_all_statuses_of_a_driver_count_where_the_task_is_not_named():
    statuses = DriverStatuses({"gripper": "hand_driver"})
    assert statuses.take("hand_driver: motor", Level.OK)
    assert statuses.take("hand_driver: fingers", Level.ERROR)
    assert not statuses.take("hand_driver: motor", Level.OK)
    assert statuses.conditions == {"gripper": FAILED}
    assert statuses.take("hand_driver: fingers", Level.OK)
    assert statuses.conditions == {"gripper": ALIVE}


@pytest.mark.parametrize("wanted", ["arm", "arm: safety", "amber/arm", "amber/arm: safety"])
@pytest.mark.parametrize("name", ["amber/arm: safety", "/amber/arm: safety", "arm: safety", "/arm: safety"])
def test_driver_of_a_robot_in_a_namespace_is_heard(wanted, name):
    statuses = DriverStatuses({"c_arm": wanted}, "/amber/")
    assert statuses.take(name, Level.ERROR, "stop")
    assert statuses.conditions == {"c_arm": FAILED}
    assert statuses.reasons == {"c_arm": "its driver says arm: safety: stop"}
    assert statuses.take("amber/arm: safety", Level.OK)


@pytest.mark.parametrize("name", ["amber_2/arm: safety", "amber/left/arm: safety", "cell/amber/arm: safety"])
def test_driver_elsewhere_is_not_heard(name):
    statuses = DriverStatuses({"c_arm": "arm"}, "/amber/")
    assert not statuses.take(name, Level.ERROR)


@pytest.mark.parametrize("name", ["hand_driver_2: motor", "other: hand_driver", "hand", ""])
def test_statuses_of_others_are_not_heard(name):
    statuses = DriverStatuses({"gripper": "hand_driver"})
    assert not statuses.take(name, Level.ERROR)
    assert statuses.conditions == {"gripper": UNKNOWN}


@pytest.mark.parametrize("level", [Level.STALE, 7, -1])
def test_what_is_stale_or_no_level_changes_nothing(level):
    statuses = DriverStatuses({"gripper": "hand_driver"})
    statuses.take("hand_driver: motor", Level.ERROR)
    assert not statuses.take("hand_driver: motor", level)
    assert statuses.conditions == {"gripper": FAILED}


def test_two_components_may_follow_one_driver():
    statuses = DriverStatuses({"a": "driver", "b": "driver: b"})
    assert statuses.take("driver: a", Level.ERROR)
    assert statuses.conditions == {"a": FAILED, "b": UNKNOWN}


def test_entries_of_components_name_the_status():
    components = parse_components({"left_arm": {"node": "left_arm", "diagnostic": "/left_arm: safety"}})
    assert components.driver_statuses == {"left_arm": "left_arm: safety"}
    assert components.of_node == {"left_arm": "left_arm"}


@pytest.mark.parametrize("entry", [{"diagnostic": ""}, {"diagnostic": 3}, {"diagnostic": "x", "max_age": 1.0}])
def test_bad_entry_is_refused(entry):
    with pytest.raises(ValueError, match="components/left_arm"):
        parse_components({"left_arm": entry})


def test_reason_is_what_the_driver_said_when_its_status_became_an_error():
    statuses = DriverStatuses({"arm": "arm_driver", "lamp": "lamp"})
    statuses.take("arm_driver: heat", Level.ERROR, "81 degrees")
    statuses.take("arm_driver: heat", Level.ERROR, "82 degrees")
    statuses.take("arm_driver: brake", Level.ERROR)
    statuses.take("lamp: bulb", Level.WARN, "old")
    assert statuses.reasons == {"arm": "error of arm_driver: brake; its driver says arm_driver: heat: 81 degrees"}
    statuses.take("arm_driver: brake", Level.OK)
    statuses.take("arm_driver: heat", Level.OK)
    assert statuses.reasons == {}
    statuses.take("arm_driver: heat", Level.ERROR, "90 degrees")
    assert statuses.reasons == {"arm": "its driver says arm_driver: heat: 90 degrees"}
