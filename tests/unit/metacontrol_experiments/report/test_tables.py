"""The rows of the paper's tables, and who is compared with whom."""

import pytest
from helpers.campaign_tables import missions, result
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.report.tables import MEASURES, analyse

SAFETY, ENERGY, SUCCESS, TIME = MEASURES


def names(analysis, measure):
    return [row.name for row in analysis.rows_of(measure)]


def test_rows_are_those_that_the_campaign_has():
    cells = [{}, {"clutter": 5}, {"power": 1.3}, {"failures": ["kill:lidar"], "failure": "killed"}]
    found = analyse(missions([result("none", **cell) for cell in cells]))
    assert names(found, SAFETY) == ["clutter 0", "clutter 5", "total"]
    assert names(found, ENERGY) == ["power 1", "power 1.3", "total"]
    expected = ["clutter 0", "clutter 5", "power 1", "power 1.3", "component failure", "total"]
    assert names(found, SUCCESS) == expected
    assert names(found, TIME) == ["total"]


def test_kinds_of_failures_have_rows_of_their_own():
    failures = {"killed": ["kill:lidar"], "gone": ["unplug:lidar"], "dark": ["light:0"]}
    told = [result("none", failure=name, failures=texts) for name, texts in failures.items()]
    found = analyse(missions(told))
    expected = ["component failure", "component failure: gone", "component failure: killed", "failure: dark"]
    assert names(found, SUCCESS) == expected
    assert names(found, SAFETY) == []


def test_totals_are_without_failures_and_without_runs_that_crashed():
    told = [result("none", 1, safety=0.1), result("none", 2, safety=0.3)]
    told += [result("none", 3, safety=0.9, failures=["kill:lidar"]), result("none", 4, status=Status.CRASHED)]
    total = analyse(missions(told)).row("safety", "total").figures["none"]
    assert (total.value, total.count) == (pytest.approx(0.2), 2)


def test_managers_are_compared_with_the_baseline_and_ours_with_each():
    told = [result(name, repeat) for name in ("none", "mros", "rules", "zeal") for repeat in (1, 2)]
    found = analyse(missions(told))
    rivals = [(first, second) for table, row, first, second in found.comparisons if (table, row) == ("safety", "total")]
    assert rivals == [("mros", "none"), ("rules", "none"), ("zeal", "none"), ("mros", "rules"), ("mros", "zeal")]


def test_without_baseline_only_ours_is_compared():
    found = analyse(missions([result("mros"), result("rules")]))
    assert {key[2:] for key in found.comparisons} == {("mros", "rules")}
    assert analyse(missions([result("rules"), result("zeal")])).comparisons == {}


def test_comparison_is_over_pairs():
    told = [result("none", n, energy=0.01 * n) for n in (1, 2, 3, 4)] + [result("mros", n, energy=0.0) for n in (1, 2)]
    found = analyse(missions(told))
    compared = found.comparison(found.row("energy", "total"), "mros", "none")
    assert (compared.test.difference.value, compared.test.difference.count) == (pytest.approx(-0.015), 2)
    assert compared.ratio.value == 0.0 and compared.effect == 1.0


def test_effect_above_a_half_is_better_whatever_the_measure():
    told = [result("none", n, success=False, duration=40.0) for n in (1, 2)]
    told += [result("mros", n, success=True, duration=50.0) for n in (1, 2)]
    found = analyse(missions(told))
    success = found.comparison(found.row("success", "total"), "mros", "none")
    time = found.comparison(found.row("time", "total"), "mros", "none")
    assert (success.effect, time.effect) == (1.0, 0.0)


def test_every_test_is_corrected_for_all_others():
    told = [result("none", n, energy=0.01 * n) for n in range(1, 9)] + [result("mros", n) for n in range(1, 9)]
    found = analyse(missions(told))
    compared = found.comparison(found.row("energy", "total"), "mros", "none")
    assert compared.test.p == pytest.approx(2 / 2**8)
    # the row of power 1 has the same p, so both are multiplied by the number of all tests
    assert compared.corrected == pytest.approx(len(found.comparisons) * 2 / 2**8)


def test_mission_without_a_level_is_not_counted_as_zero():
    told = [result("none", 1, safety=0.2), result("none", 2, summary={"time_above_threshold": {"energy": 0.0}})]
    total = analyse(missions(told)).row("safety", "total").figures["none"]
    assert (total.value, total.count) == (0.2, 1)
