"""Calibration: runs are kept, resumed and turned into levels and tables."""

import csv
import dataclasses
from pathlib import Path

import pytest
from click.testing import CliRunner
from metacontrol_bags.series import quantile
from metacontrol_experiments.campaign import calibration, variant_table
from metacontrol_experiments.campaign.calibration import OBSERVED, CalibrationError, Job, Run
from metacontrol_experiments.campaign.definition import Definition
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.io import calibration_runs, tables
from metacontrol_experiments.io.ground_files import read_ground

DEFINITION = Definition()
SHORT = "short: {start: [-8, -8, 0.78], goal: [-6, -6.5, 0]}\n"


def a_run(variant="f1_v1_r1", route="r1", seed=1, **changes):
    usual = {"outcome": "reached", "collisions": 0, "duration_s": 40.0, "path_m": 19.0, "safety": 0.3, "energy": 0.4}
    rest = {
        "safety_mean": 0.1,
        "safety_above": 0.0,
        "energy_median": 0.2,
        "energy_above": 0.0,
        "ground": "",
        "definition": DEFINITION.describe(OBSERVED),
        "commit": "abc",
    }
    return Run(variant, route, seed, **(usual | rest | changes))


def a_family():
    """Two frequencies, two speeds, three seeds: faster ones riskier, higher frequencies dearer."""
    return [
        a_run(
            f"f{f}_v{v}_r1",
            route,
            seed,
            duration_s=60.0 / v + seed * 0.1,
            safety=0.3 * v + seed * 0.001,
            energy=0.2 * v + 0.05 * f + seed * 0.001,
        )
        for f in (1, 2)
        for v in (1, 2)
        for route in ("r1", "r2")
        for seed in (1, 2, 3)
    ]


def test_variants_meet_the_same_world_and_routes_another_one():
    first, other = Job("f1_v1_r1", "r1", 1), Job("f3_v2_r1", "r1", 1)
    assert first.world_seed == other.world_seed
    worlds = {
        Job("f1_v1_r1", route, seed).world_seed for route in ("r1", "r2", "r3", "r4", "r5", "r6") for seed in (1, 2)
    }
    assert len(worlds) == 12
    assert max(worlds) < 2**20, "campaigns have theirs from there on"


def test_file_of_runs_is_resumed_where_it_was_cut_off(tmp_path):
    path = tmp_path / "runs.csv"
    one, two = a_run(), a_run(seed=2)
    assert list(tables.append_runs(path, [one])) == [one]
    whole = path.read_text()
    path.write_text(whole + "f1_v1_r1,r1,2,rea")
    assert tables.read_runs(path) == [one]
    list(tables.append_runs(path, [two]))
    assert tables.read_runs(path) == [one, two]
    assert path.read_text().startswith(whole)


def test_runs_are_written_as_they_come(tmp_path):
    path = tmp_path / "runs.csv"
    coming = tables.append_runs(path, iter([a_run(), a_run(seed=2)]))
    next(coming)
    assert tables.read_runs(path) == [a_run()]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n", "its columns are not"),
        (None, "line 2 is no run"),
        ("a" * 200_000 + "\n", "field larger than field limit"),
    ],
    ids=["columns", "row", "cell"],
)
def test_file_that_holds_no_runs_is_refused(tmp_path, text, said):
    path = tmp_path / "runs.csv"
    names = [field.name for field in dataclasses.fields(Run)]
    path.write_text(text or ",".join(names) + "\n" + ",".join("x" * len(names)) + "\n")
    with pytest.raises(CalibrationError, match=said):
        tables.read_runs(path)


def test_missing_missions_are_those_that_other_variants_drove():
    runs = [a_run(), a_run("f1_v2_r1"), a_run(seed=2)]
    assert calibration.missing_runs(runs, ["f1_v1_r1", "f1_v2_r1"]) == [Job("f1_v2_r1", "r1", 2)]


def test_levels_are_means_over_missions_and_performance_is_relative_to_the_fastest():
    runs = [
        a_run(duration_s=60.0, energy=0.3),
        a_run(seed=2, duration_s=40.0, energy=0.5),
        a_run("f1_v2_r1", duration_s=30.0),
    ]
    levels = calibration.measure([*runs, a_run("f1_v2_r1", seed=2, outcome="aborted", duration_s=9.0)])
    assert levels["f1_v1_r1"]["energy"].value == pytest.approx(0.4)
    assert levels["f1_v1_r1"]["energy"].spread == pytest.approx(0.1414, abs=1e-4)
    assert levels["f1_v1_r1"]["performance"].value == pytest.approx((0.5 + 0.75) / 2)
    assert levels["f1_v2_r1"]["performance"].value == 0.5


def test_level_is_what_is_not_exceeded_for_a_share_of_the_time():
    samples = ((0.0, 0.9), (1.0, 0.1), (11.0, 0.5), (20.0, 0.2))
    assert quantile(samples, 0.96, 0.0, 20.0) == 0.9
    assert quantile(samples, 0.95, 0.0, 20.0) == 0.5
    assert quantile(samples, 0.5, 0.0, 20.0) == 0.1
    assert quantile((), 0.5, 0.0, 20.0) is None


def test_table_shows_every_variant_and_that_the_claims_hold():
    text = variant_table.markdown(a_family())
    rows = {line.split(" | ")[0].strip("| "): line for line in text.splitlines() if line.startswith("| ")}
    assert {"f1_v1_r1", "f1_v2_r1", "f2_v1_r1", "f2_v2_r1"} <= rows.keys()
    assert "| 6 of 6 | 0 | 60.20 ± 0.25 |" in rows["f1_v1_r1"]
    for claim in ("faster variants take less time", "slower variants run less risk", "higher frequencies cost energy"):
        assert rows[claim].endswith("| 2 of 2 |")


def test_claim_that_does_not_hold_shows():
    runs = [dataclasses.replace(run, safety=0.3 + 0.01 * run.seed * int(run.variant[1])) for run in a_family()]
    (line,) = [line for line in variant_table.markdown(runs).splitlines() if "less risk" in line]
    assert line.endswith("| 0 of 2 |")


def test_one_seed_has_no_interval():
    text = variant_table.markdown([a_run(), a_run("f1_v2_r1", duration_s=30.0)])
    assert "| 40.00 |" in text and "±" not in text
    assert "| needs more seeds |" in text


def test_command_drives_once_and_writes_levels_only_when_all_variants_are_measured(tmp_path, monkeypatch):
    driven = []

    def drive(jobs, ground, definition, commit, processes):
        for job in jobs:
            driven.append(job)
            yield a_run(job.variant, job.route, job.seed)

    monkeypatch.setattr("metacontrol_experiments.cli.calibrate.drive", drive)
    files = ["--runs", str(tmp_path / "runs.csv"), "--levels", str(tmp_path / "qa.csv")]
    arguments = ["calibrate", "--seeds", "1", "--route", "r1", *files]
    part = CliRunner().invoke(metacontrol, [*arguments, "--variant", "f1_v1_r1"])
    assert part.exit_code == 0 and "38 missions are missing" in part.output
    assert not (tmp_path / "qa.csv").exists()
    assert CliRunner().invoke(metacontrol, arguments).exit_code == 0
    assert len(driven) == len(set(driven)) == 39
    rows = list(csv.DictReader((tmp_path / "qa.csv").open()))
    assert len(rows) == 39
    first = {"name": "f1_v1_r1", "safety": "0.300", "energy": "0.400", "performance": "1.000", "source": "measured"}
    first["energy_median"] = "0.200"
    assert rows[0] == first | {f"{name}_spread": "0.000" for name in calibration.QUALITIES} | {
        "missions": "1",
        "seeds": "1-1",
    }


def test_levels_by_different_definitions_do_not_mix(tmp_path):
    list(tables.append_runs(tmp_path / "runs.csv", [a_run()]))
    options = ["calibrate", "--route", "r1", "--runs", str(tmp_path / "runs.csv"), "--quantile", "energy=0.9"]
    refused = CliRunner().invoke(metacontrol, options)
    assert refused.exit_code == 2
    assert "holds levels by energy:0.975 safety:0.95, not by energy:0.9 safety:0.95: name another" in refused.output


def test_command_refuses_what_is_not_there(tmp_path):
    for option, name in (("--variant", "f9"), ("--route", "r9")):
        result = CliRunner().invoke(metacontrol, ["calibrate", option, name, "--runs", str(tmp_path / "runs.csv")])
        assert result.exit_code == 2 and f"{option}: no '{name}'" in result.output
    result = CliRunner().invoke(metacontrol, ["variants", "--runs", str(tmp_path / "runs.csv")])
    assert result.exit_code == 2 and "no runs" in result.output


def test_processes_side_by_side_drive_the_same_missions(tmp_path):
    routes = Path(tmp_path / "routes.yaml")
    routes.write_text(SHORT)
    ground = read_ground(None, routes)
    jobs = [Job(variant, "short", 1) for variant in ("f1_v3_r1", "f2_v2_r2")]
    alone = list(calibration_runs.drive(jobs, ground, DEFINITION, "abc", 1))
    assert [run.reached for run in alone] == [True, True]
    assert alone == list(calibration_runs.drive(jobs, ground, DEFINITION, "abc", 2))
