"""What is still to do in a campaign, and what its table says."""

import json
from dataclasses import replace

import pytest
from metacontrol_experiments.campaign.matrix import CampaignError, Run
from metacontrol_experiments.campaign.progress import (
    Attempt,
    Result,
    Status,
    check_same,
    from_json,
    from_row,
    is_final,
    remaining,
    row,
    to_json,
)

RUN = Run("p", "r1", "f2_v2_r2", 7, 1.4, "killed", ("kill:front_laser@share:0.6",), "rules", 1, seed=5)
DONE, CRASHED = Attempt(Status.DONE, 2.5), Attempt(Status.CRASHED, 1.0, "it broke", "Traceback")
HUNG = Attempt(Status.HUNG, 9.0, "no end", "Thread")
SUMMARY = {"outcome": "reached", "success": True, "time_above_threshold": {"safety": 0.01}, "reconfigurations": [{}]}


def test_run_is_tried_once_more_unless_it_is_done():
    assert not is_final([]) and not is_final([CRASHED]) and not is_final([HUNG])
    assert is_final([DONE]) and is_final([CRASHED, DONE]) and is_final([HUNG, CRASHED])


def test_what_has_a_result_is_not_driven_again_however_it_ended():
    runs = [replace(RUN, repeat=number) for number in (1, 2, 3)]
    results = {runs[0].name: Result(runs[0], (DONE,)), runs[2].name: Result(runs[2], (CRASHED, HUNG))}
    assert remaining(runs, results) == [runs[1]]


def test_folder_of_another_campaign_is_refused():
    held = {RUN.name: Result(replace(RUN, seed=6, timeout=5.0), (DONE,))}
    with pytest.raises(CampaignError, match=r"out/p/.*rules-1: is another mission \(seed, timeout\): delete it"):
        check_same([RUN], held, "out", "delete it")


def test_result_survives_its_file_but_for_the_logs():
    result = Result(RUN, (CRASHED, DONE), SUMMARY, {"host": "a"})
    read = from_json(to_json(result), "result.json")
    assert read == replace(result, attempts=(replace(CRASHED, log=""), DONE))
    assert "Traceback" not in to_json(result)


def changed(*keys, to):
    """Return the text of a result's file in which one value is another one."""
    content = json.loads(to_json(Result(RUN, (DONE,), SUMMARY | {"collisions": 0, "mean_qa": {}}, {"host": "a"})))
    part = content
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = to
    return json.dumps(content)


@pytest.mark.parametrize(
    ("keys", "to", "place"),
    [
        (("summary",), [1], "summary: is"),
        (("summary",), "x", "summary: is"),
        (("summary",), None, "summary: is missing"),
        (("summary",), {"outcome": "reached"}, "summary.reconfigurations: is missing"),
        (("summary", "reconfigurations"), None, "summary.reconfigurations: is empty"),
        (("summary", "mean_qa"), None, "summary.mean_qa: is empty"),
        (("summary", "mean_qa"), {"safety": "low"}, "summary.mean_qa.safety: is 'low'"),
        (("summary", "duration_s"), "x", "summary.duration_s: is 'x'"),
        (("summary", "duration_s"), float("nan"), "summary.duration_s: is 'nan'"),
        (("summary", "collisions"), 10**400, "summary.collisions: is '1000"),
        (("summary", "outcome"), "\ud800", "surrogates not allowed"),
        (("provenance",), None, "provenance: is empty"),
        (("provenance", "host"), [1], "provenance.host: is"),
        (("attempts", 0, "wall_s"), None, r"attempts\[0\].wall_s: is empty"),
        (("attempts", 0, "wall_s"), "x", r"attempts\[0\].wall_s: is 'x'"),
        (("attempts", 0, "problem"), {"a": 1}, r"attempts\[0\].problem: is"),
        (("run", "clutter"), True, "run.clutter: is"),
        (("run", "seed"), 2**64, "run.seed: is"),
        (("run", "contingencies"), [1], r"run.contingencies\[0\]: is"),
    ],
)
def test_result_that_no_table_can_hold_is_refused_by_its_place(keys, to, place):
    with pytest.raises(CampaignError, match=rf"^x\.json: is no result of a run .*{place}.*delete it"):
        from_json(changed(*keys, to=to), "x.json")


@pytest.mark.parametrize("text", ["", "{}", "[]", "[" * 9999, to_json(Result(RUN, (DONE,)))[:-9], '{"run": {}}'])
def test_file_that_is_no_result_is_refused(text):
    with pytest.raises(CampaignError, match=r"^x\.json: is no result of a run .*delete it"):
        from_json(text, "x.json")


def test_row_has_run_figures_and_provenance():
    told = row(Result(RUN, (CRASHED, DONE), SUMMARY, {"host": "a", "commit": "c"}))
    assert (told["manager"], told["seed"], told["status"], told["attempts"]) == ("rules", 5, "done", 2)
    assert (told["outcome"], told["above_safety"], told["above_energy"]) == ("reached", 0.01, None)
    assert (told["reconfigurations"], told["wall_s"], told["host"]) == (1, 3.5, "a")


@pytest.mark.parametrize("attempts", [(DONE,), (CRASHED, DONE), (CRASHED, HUNG)])
def test_row_tells_the_result_again_but_for_attempts_before_the_last(attempts):
    summary = SUMMARY if attempts[-1] is DONE else None
    told = row(Result(RUN, attempts, summary, {"host": "a", "commit": "c", "ended": "e", "versions": "v"}))
    assert row(from_row(told, "x.parquet: row 1")) == told


def test_row_of_a_time_before_the_spares_is_of_a_mission_without_them():
    told = row(Result(RUN, (DONE,), SUMMARY, {"host": "a", "commit": "c", "ended": "e", "versions": "v"}))
    assert told.pop("spares") is False
    assert from_row(told, "x").run == RUN
    with pytest.raises(CampaignError, match=r"is another mission \(spares\)"):
        check_same([replace(RUN, spares=True)], {RUN.name: from_row(told, "x")}, "out", "delete it")


@pytest.mark.parametrize(
    "change",
    [
        *({"summary": "{"}, {"status": "gone"}, {"attempts": None}, {"attempts": float("inf")}, {"contingencies": 3}),
        *({"summary": "[1]"}, {"summary": "{}"}, {"summary": None}, {"wall_s": None}, {"wall_s": "x"}, {"host": 1}),
    ],
)
def test_row_that_is_no_result_is_refused(change):
    told = {**row(Result(RUN, (DONE,), SUMMARY)), **change}
    with pytest.raises(CampaignError, match=r"^x\.parquet: row 1: is no result of a run .*name a table"):
        from_row(told, "x.parquet: row 1")


def test_run_that_failed_has_a_row_with_the_same_columns():
    failed, done = row(Result(RUN, (CRASHED, HUNG))), row(Result(RUN, (DONE,), SUMMARY))
    assert failed.keys() == done.keys()
    assert (failed["status"], failed["problem"], failed["outcome"], failed["summary"]) == ("hung", "no end", None, None)


def test_row_without_the_column_is_of_a_mission_that_observed_no_surroundings():
    told = row(Result(RUN, (DONE,), SUMMARY, {"host": "a", "commit": "c", "ended": "e", "versions": "v"}))
    del told["environment"]
    read = from_row(told, "x.parquet: row 1")
    check_same([RUN], {RUN.name: read}, "x.parquet", "leave it out")
    with pytest.raises(CampaignError, match=r"another mission \(environment\)"):
        check_same([replace(RUN, environment=True)], {RUN.name: read}, "x.parquet", "leave it out")
