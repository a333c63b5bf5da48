"""Reconfigurations, violations until relief, and cost, against values worked out by hand."""

from dataclasses import replace

import pytest
from helpers.campaign_tables import change, missions, result, violation
from metacontrol_experiments.report.adaptations import activity, costs, spans, total_cost

CPU, MEMORY = "cpu_percent_mean", "memory_mb_max"


def test_reconfigurations_and_violations_are_per_mission():
    told = [
        result("mros", 1, summary={"reconfigurations": [change(), change()], "reconfigurations_failed": [change()]}),
        result("mros", 2, summary={"collisions": 1}),
        result("none", 1, summary={"reconfigurations": [change()]}),
    ]
    found = activity(missions(told), "mros")
    assert (found.reconfigurations.value, found.failed, found.collisions.value) == (1.0, 1, 0.5)
    assert found.duration.value == 40.0


def test_relief_is_per_violation_and_lasts_to_the_end_where_there_is_none():
    first = {"energy": [violation(1.0, 2.0), violation(30.0, None)], "safety": []}
    second = {"energy": [violation(5.0, 3.0)], "safety": None}
    told = [result("mros", 1, duration=40.0, summary={"violations": first})]
    told += [result("mros", 2, summary={"violations": second}), result("mros", 3)]
    relief = activity(missions(told), "mros").relief
    assert (relief["energy"].violations, relief["energy"].unrelieved) == (3, 1)
    assert relief["energy"].per_mission.value == 1.0
    assert relief["energy"].seconds.value == pytest.approx((2.0 + 10.0 + 3.0) / 3)
    assert (relief["safety"].per_mission.count, relief["safety"].seconds) == (2, None)


def test_what_old_summaries_do_not_tell_is_left_out():
    found = result("mros")
    for key in ("violations", "collisions"):
        del found.summary[key]
    told = activity(missions([found]), "mros")
    assert (told.relief, told.reconfigurations.value, told.collisions) == ({}, 0.0, None)
    (bare,) = (replace(mission, summary={}) for mission in missions([found]))
    assert activity([bare], "mros").reconfigurations is None


def test_spans_are_by_kind_of_trigger():
    first = [change("qa:noise", 0.1, 0.2, 0.3), change("component:arm", None, 0.5, 0.6)]
    told = [result("mros", 1, summary={"reconfigurations": first}), result("mros", 2)]
    assert spans(missions(told), "mros") == {
        "component": {"detect_s": [], "decide_s": [0.5], "execute_s": [0.6]},
        "quality": {"detect_s": [0.1], "decide_s": [0.2], "execute_s": [0.3]},
    }
    assert spans(missions(told), "none") == {}


def test_cost_is_by_node_and_of_all_together():
    told = [
        result("mros", 1, summary={"cost": {"/a": {CPU: 10.0, MEMORY: 50.0}, "/b": {CPU: 5.0, MEMORY: None}}}),
        result("mros", 2, summary={"cost": {"/a": {CPU: 20.0, MEMORY: 70.0}}}),
        result("mros", 3),
    ]
    found = missions(told)
    each = costs(found, "mros")
    assert (each["/a"].cpu.value, each["/a"].memory.value, each["/b"].cpu.count) == (15.0, 60.0, 1)
    assert each["/b"].memory is None
    total = total_cost(found, "mros")
    assert (total.cpu.value, total.memory.value) == (17.5, 60.0)
    assert costs(found, "none") == {} and total_cost(found, "none").cpu is None
