"""What is told of a table that is incomplete, mixed or of something else."""

import pytest
from helpers.campaign_tables import missions, result
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.report.published import Published
from metacontrol_experiments.report.remarks import asked_by, broken, doubts, gaps, if_failures
from metacontrol_experiments.report.tables import analyse

PAPER = Published("a paper", titles={"safety": {"clutter 0": "no clutter", "clutter 9": "much clutter"}})


def doubted(told, asked=None):
    return doubts(analyse(missions(told)), asked)


def lacking(told):
    return gaps(analyse(missions(told)), PAPER)


def test_whole_table_of_one_commit_raises_no_doubt():
    assert doubted([result(name, n) for name in ("none", "mros") for n in (1, 2)], 4) == []


def test_missing_missions_are_counted():
    assert doubted([result()], 4000) == ["The campaign asks for 4,000 missions; the table has 1."]


def test_unequal_repeats_are_told_of_each_part():
    told = [result("none", 1), result("none", 2), result("mros", 1)]
    told += [result("none", 1, part="even"), result("mros", 1, part="even")]
    (repeats,) = doubted(told)
    assert repeats == "Repeats of a cell in part `main` are unequal: none 2, mros 1."


def test_cells_that_one_manager_lacks_are_told():
    told = [result("none", 1), result("none", 1, clutter=7), result("mros", 1)]
    assert doubted(told) == ["Managers have unequal numbers of cells in part `main`: none 2, mros 1."]


def test_pairs_that_are_missing_are_told_with_unequal_seeds():
    told = [result("none", n) for n in (1, 2, 3)]
    told += [result("mros", 1), result("mros", 2, seed=9), result("mros", 3, status=Status.HUNG)]
    (pairs,) = doubted(told)
    assert pairs.startswith("`mros` (2 missions) and the baseline (3) make only 1 pairs")
    assert pairs.endswith("in no test; 1 of them have unequal seeds.")


def test_several_commits_hosts_and_engines_are_told():
    told = [
        result(repeat=n, engine=engine, provenance={"commit": letter * 40, "host": f"host{n}"})
        for n, (letter, engine) in enumerate([("a", "ros"), ("b", "lockstep"), ("b", "lockstep")])
    ]
    assert doubted(told) == [
        "The table mixes 2 commits: bbbbbbbbbbbb (2), aaaaaaaaaaaa (1).",
        "The table mixes 3 hosts: host0 (1), host1 (1), host2 (1).",
        "The table mixes engines: 2 by lockstep, 1 by ros.",
    ]


def test_other_thresholds_than_the_published_ones_are_told():
    limits = {"safety": 0.5, "energy": 0.62}
    (other,) = doubted([result(summary={"thresholds": limits})])
    assert (
        other == "The thresholds are energy 0.62, safety 0.5; the published figures hold for energy 0.62, safety 0.6."
    )
    (mixed,) = doubted([result(repeat=1), result(repeat=2, summary={"thresholds": limits})])
    assert mixed == "Missions have different thresholds: energy 0.62, safety 0.5; energy 0.62, safety 0.6."


def test_crashed_and_hung_missions_count_as_failures_in_a_figure_of_their_own():
    told = [result("mros", 1), result("mros", 2, success=False), result("mros", 3, status=Status.CRASHED)]
    told += [result("mros", 4, status=Status.HUNG), result("none", 1)]
    found = missions(told)
    assert [mission.run.repeat for mission in broken(found)] == [3, 4]
    assert if_failures(found, "mros") == (0.5, 0.25)
    assert if_failures(found, "none") is None


def test_each_gap_is_one_line():
    told = lacking([result("rules")])
    assert told == [
        "No mission of the baseline (none): no difference to it, no test, no extra time.",
        "No mission of the meta-controller (mros): nothing is judged.",
        "Time above the safety threshold: no mission for the published rows much clutter.",
        "CPU and memory of the meta-controller are known of missions on ROS only: there are none here.",
    ]


def test_cost_of_missions_on_ros_is_no_gap():
    told = [result("mros", summary={"cost": {"/reasoner": {"cpu_percent_mean": 1.0, "memory_mb_max": 2.0}}})]
    assert not any("CPU" in line for line in lacking([result("none"), *told]))


def test_table_of_failures_only_has_no_totals():
    assert any("there are no totals" in line for line in lacking([result(failures=["kill:lidar"])]))


def test_unknown_levels_and_old_summaries_are_told():
    old = {"violations": None, "time_above_threshold": {"energy": 0.0}}
    found = result(summary=old)
    del found.summary["violations"]
    told = lacking([found])
    assert any(line.startswith("The summaries do not tell violations one by one") for line in told)
    assert "safety is not known of 1 mission(s): its table is without them." in told


@pytest.mark.parametrize("content", [None, [], {}, {"parts": {"a": {}}}, {"parts": {"a": {"routes": 3}}}, {"parts": 4}])
def test_campaign_that_makes_no_sense_asks_for_nothing_known(content):
    assert asked_by(content) in (None, 0)


def test_campaign_asks_for_the_product_of_its_lists():
    part = {"routes": ["a", "b"], "initial_configurations": ["c"], "managers": {"none": 2, "mros": 1}}
    more = part | {"clutter": [0, 1, 2], "power": [1, 2], "failures": {"x": [], "y": []}}
    assert asked_by({"parts": {"one": part, "two": more}}) == 2 * 3 + 2 * 3 * 2 * 2 * 3
