"""The command `metacontrol report`, on a table of missions that nobody drove and on one whose pair it drives anew."""

import os
import subprocess
import sys

import pytest
from helpers.campaign_tables import change, result, write


def report(folder, *options):
    # Paths of matplotlib and others are those of this process.
    command = [sys.executable, "-m", "metacontrol_experiments.cli.main", "report", str(folder), *options]
    finished = subprocess.run(command, capture_output=True, text=True, check=False, env=dict(os.environ))
    assert finished.returncode == 0, finished.stderr
    return finished.stdout.splitlines()


@pytest.fixture
def campaign():
    """Two routes, three managers, two of which cross the limit less often."""
    level = {"none": 0.08, "mros": 0.01, "rules": 0.04}
    return [
        result(
            manager,
            repeat,
            route=route,
            power=1.4,
            energy=level[manager] + 0.01 * repeat,
            success=manager != "none",
            duration=40.0 if manager == "none" else 46.0,
            summary={} if manager == "none" else {"reconfigurations": [change()]},
        )
        for route in ("east", "west")
        for manager in level
        for repeat in range(1, 9)
    ]


def test_report_is_made_of_the_table_alone(campaign, tmp_path):
    table = write(tmp_path / "campaign", campaign)
    told = report(table, "--no-drive", "--output", str(tmp_path / "made"))
    assert told[0] == "behind in 2 comparisons; 5 of 9 targets reached"
    assert {*told[1:]} == {str(path) for path in (tmp_path / "made").rglob("*") if path.is_file()}
    text = (tmp_path / "made" / "report.md").read_text()
    # 5.5 % on average beside 1.86 %; 12.5 % in the baseline
    lost = next(line for line in text.splitlines() if line.startswith("| Time above the energy threshold | total |"))
    assert "| total | 5.50 (" in lost and "| the published MROS | 1.86 |" in lost
    assert "Time above the energy threshold, total: at most 1/1.6 of the baseline's | 44.00 (" in text
    assert "at most 7.5 s longer to the goal than the baseline on average | +6.00" in text
    assert "No figure “A pair of missions”: Its runs left no log." in text
    assert not (tmp_path / "campaign" / "report").exists()


def test_pair_is_driven_anew_where_it_left_no_log(tmp_path):
    cell = {"route": "r1", "start": "f2_v2_r2", "timeout": 2.0}
    table = write(tmp_path, [result("none", **cell), result("mros", **cell)])
    told = report(table)
    assert told[0].startswith("driving a pair of missions anew")
    assert str(tmp_path / "report" / "figures" / "pair.png") in told
    text = (tmp_path / "report" / "report.md").read_text()
    assert "Driven anew in lockstep, with other figures than in the table (none, mros)." in text
