"""Rows of a table as missions, what goes wrong in them, and their pairs."""

from dataclasses import replace

import pytest
from helpers.campaign_tables import missions, result
from metacontrol_experiments.campaign.progress import Status, row
from metacontrol_experiments.report.missions import Failure, ReportError, managers_of, missions_of, pairs_of


def test_mission_has_the_figures_of_its_row():
    (found,) = missions([result("rules", safety=0.02, energy=0.1, success=False, duration=50.0)])
    assert (found.manager, found.above("safety"), found.above("energy")) == ("rules", 0.02, 0.1)
    assert (found.success, found.time_to_goal, found.done) == (False, 50.0, True)
    assert found.provenance["host"] == "somewhere"


def test_time_to_the_goal_is_that_of_missions_that_reach_it():
    (found,) = missions([result(reached=False, duration=250.0)])
    assert found.time_to_goal is None


def test_crashed_mission_has_no_figures():
    (found,) = missions([result(status=Status.CRASHED, problem="it broke")])
    assert (found.done, found.problem, found.success, found.above("safety")) == (False, "it broke", None, None)


@pytest.mark.parametrize(
    ("failures", "kind"),
    [
        ([], Failure.NONE),
        (["unplug:lidar"], Failure.COMPONENT),
        (["freeze:lidar@time:3"], Failure.COMPONENT),
        (["light:0"], Failure.OTHER),
        (["light:0", "kill:lidar"], Failure.COMPONENT),
        (["explode:lidar"], Failure.OTHER),
    ],
)
def test_failures_are_of_components_or_others(failures, kind):
    (found,) = missions([result(clutter=7, power=1.4, failures=failures)])
    assert found.failure is kind


def test_baseline_and_ours_come_first():
    found = missions([result(name) for name in ("rules", "zeal", "mros", "respawn", "none")])
    assert managers_of(found) == ("none", "mros", "respawn", "rules", "zeal")
    assert managers_of(found[1:2]) == ("zeal",)


def test_pairs_are_of_equal_part_cell_repeat_and_seed():
    own = [result("mros", 1), result("mros", 2), result("mros", 3), result("mros", 4, clutter=7), result("mros", 5)]
    theirs = [
        result("none", 1),
        result("none", 2, part="other"),
        result("none", 3, seed=99),
        result("none", 4),
        result("none", 5, status=Status.HUNG),
    ]
    found = pairs_of(missions([*own, *theirs]), "mros", "none")
    assert [(one.run.repeat, other.run.repeat, one.manager, other.manager) for one, other in found] == [
        (1, 1, "mros", "none")
    ]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"status": "odd"}, r"t: row 1: is no result of a run \('odd'"),
        ({"summary": "[" * 9999}, "t: row 1: is no result of a run"),
        ({"summary": "[1]"}, r"row 1: is no result of a run \(its summary is no mapping\)"),
    ],
)
def test_row_that_is_no_result_is_refused(change, said):
    with pytest.raises(ReportError, match=said):
        missions_of([row(result()) | change], "t")


def test_table_of_something_else_is_refused():
    with pytest.raises(ReportError, match=r"t: row 1: has no column part, route, .* name the results\.parquet"):
        missions_of([{"name": "f1_v1_r1", "status": "done"}], "t")
    with pytest.raises(ReportError, match="t: holds no mission; drive some by: metacontrol campaign"):
        missions_of([], "t")


def test_table_without_summaries_still_has_figures():
    told = row(result(safety=0.5))
    del told["summary"]
    (found,) = missions_of([told], "t")
    assert found.above("safety") == 0.5 and found.summary == {}


def test_table_of_a_campaign_before_engines_had_names_is_read():
    told = row(result())
    del told["engine"]
    assert missions_of([told], "t") == (replace(*missions([result()])),)
