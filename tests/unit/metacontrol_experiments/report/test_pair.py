"""Which pair stands for all, and what a log of lockstep tells over time."""

import pytest
from helpers.campaign_tables import LOG, change, missions, result
from metacontrol_experiments.report.pair import read_series, typical_pair


def adapting(repeat, theirs, ours, changes=1):
    return [
        result("none", repeat, energy=theirs),
        result("mros", repeat, energy=ours, summary={"reconfigurations": [change()] * changes}),
    ]


def test_typical_pair_has_the_median_gain_of_those_that_adapt():
    told = [*adapting(1, 0.5, 0.0), *adapting(2, 0.2, 0.1), *adapting(3, 0.3, 0.4), *adapting(4, 0.9, 0.0, changes=0)]
    found = typical_pair(missions(told))
    assert (found.baseline.manager, found.ours.manager, found.ours.run.repeat) == ("none", "mros", 2)
    assert "median gain in time above the thresholds of 3 pairs" in found.chosen


def test_pair_without_adaptation_stands_in():
    told = [*adapting(1, 0.0, 0.0, changes=0), result("none", 2)]
    found = typical_pair(missions(told))
    assert found.ours.run.repeat == 1 and "of 1 pair in which nothing fails" in found.chosen
    assert typical_pair(missions([result("none"), result("rules")])) is None


def test_log_tells_levels_contingencies_and_reconfigurations():
    found = read_series(LOG)
    assert found.stamps == pytest.approx((0.1, 0.2, 1.2))
    assert found.levels == {"safety": (0.25, 0.75, 0.1), "energy": (0.5, 0.5, 0.9)}
    assert [name for _, name in found.strikes] == ["clutter:7", "power:1.4"]
    assert found.disturbed_from == pytest.approx(1.0)
    assert [name for _, _, name in found.changes] == ["slow", "fast"]
    assert found.changes[0][:2] == pytest.approx((1.1, 2.1))
    assert found.changes[1][:2] == pytest.approx((2.2, 3.0))  # it does not end
    assert found.end == 3.0


def test_contingencies_of_the_start_count_where_there_are_no_others():
    assert read_series(LOG.replace("4.00 PERT", "4.00 OTHER")).disturbed_from == 0.0
    assert read_series(LOG.replace("PERTURBATION", "OTHER")).disturbed_from is None


@pytest.mark.parametrize(
    "log", ["", "roslaunch says\nhello 3.0\n", "3.00 MISSION_START east\n", "3.1 0 0 0 0 0 0 0 0\n"]
)
def test_other_texts_are_no_log_of_lockstep(log):
    assert read_series(log) is None
