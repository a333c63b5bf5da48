"""A campaign whose folder holds a result that cannot be used says so, and leaves the table of the others."""

import csv
import json

import pytest
from click.testing import CliRunner
from helpers.campaign_tables import pyramid_summary
from helpers.campaign_tables import result as driven
from metacontrol_experiments.campaign.progress import Attempt, Result, Status
from metacontrol_experiments.cli import campaign as command
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.cli.pyramid_campaign import REPORT, TABLE
from metacontrol_experiments.io.campaign_folder import RESULT, RUNS, results_of, write_result
from metacontrol_experiments.mission.settings import SUMMARY_NAME

D2 = "parts: {main: {routes: [r1], initial_configurations: [f2_v2_r2], managers: {none: 3}}}\n"
PYRAMIDS = pyramid_summary(True, 0.5)
D1 = "{mission: manipulation, scenarios: [1], seeds: 3, managers: [mros]}\n"


def refused(file, folder, *words):
    """Run a campaign in which nothing is left to drive, and see that its only line has these words."""
    result = CliRunner().invoke(metacontrol, ["campaign", str(file), "--output", str(folder)])
    assert (result.exit_code, type(result.exception)) == (2, SystemExit)
    [line] = result.output.splitlines()
    assert all(word in line for word in words), line


def written(folder, name, text):
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("spoil", [lambda told: told.pop("reconfigurations"), lambda told: told.update(outcome=[1])])
def test_result_of_d2_that_can_not_be_used_costs_the_others_nothing(tmp_path, spoil):
    file, folder = written(tmp_path, "c.yaml", D2), tmp_path / "out"
    asked = command._read(command._content(file), file, None, {"world": None, "routes": None})
    for run in asked.runs:
        write_result(folder, Result(run, (Attempt(Status.DONE, 1.0),), driven().summary, {"commit": "c"}))
    bad = folder / RUNS / asked.runs[1].name / RESULT
    content = json.loads(bad.read_text())
    spoil(content["summary"])
    bad.write_text(json.dumps(content))
    refused(file, folder, str(bad), "delete it to drive the run again")
    assert set(results_of(folder / "results.parquet")) == {asked.runs[0].name, asked.runs[2].name}


@pytest.mark.parametrize(
    "text",
    ["{}", "[1]", "null", "", "[" * 9999, json.dumps(PYRAMIDS | {"reason": "\ud800"})]
    + [json.dumps(PYRAMIDS | {key: to}) for key, to in (("duration_s", None), ("success", 1), ("strikes", [{}]))],
)
def test_summary_of_d1_that_can_not_be_used_costs_the_others_nothing(tmp_path, text):
    file, folder = written(tmp_path, "c.yaml", D1), tmp_path / "out"
    for seed in (1, 2, 3):
        home = folder / RUNS / f"scenario1_seed00{seed}_mros"
        home.mkdir(parents=True)
        (home / SUMMARY_NAME).write_text(text if seed == 2 else json.dumps(PYRAMIDS))
    refused(file, folder, f"scenario1_seed002_mros/{SUMMARY_NAME}", "delete it, and drive it again")
    with (folder / TABLE).open() as table:
        assert [row["seed"] for row in csv.DictReader(table)] == ["1", "3"]
    assert "| `mros` | 2 |" in (folder / REPORT).read_text()
