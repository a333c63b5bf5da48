"""Whole missions of D1 with the real command: the scenario in which most goes wrong, and the one without a way out."""

import json
import subprocess

import pytest
from metacontrol_experiments.pyramid.record import read_pyramid

SEEDS = {3: (4, 5, 3), 4: (3, 4, 5)}
"""By scenario; the obstacle of seed 3 often comes when the arm has passed."""
LIMIT_S = 1100.0
KINDS = {3: {"light", "obstacle", "component", "release"}, 4: {"obstacle"}}
"""What must have happened, by scenario."""


@pytest.fixture
def mission(tmp_path):
    """Drive a scenario; return its result and its folder.

    On a busy machine, an obstacle may come when the arm has passed. It strikes again then, so late that the pyramid may
    stand before all of the scenario has happened: another seed is driven then.
    """

    def drive(scenario):
        for seed in SEEDS[scenario]:
            output = tmp_path / str(seed)
            words = ["--mission", "manipulation", "--scenario", scenario, "--seed", seed, "--output", output]
            command = ["metacontrol", "run", *map(str, words)]
            result = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
            console = (output / "log" / "console.log").read_text(errors="replace")
            assert result.returncode == 0, f"{result.stdout}{result.stderr}\n{console}"
            summary = json.loads((output / "summary.json").read_text())
            if {strike["name"].partition(":")[0] for strike in summary["strikes"]} == KINDS[scenario]:
                break
        return summary, output

    return drive


def changes(summary):
    return [(change["from"], change["to"]) for change in summary["reconfigurations"]]


def test_an_arm_the_light_and_a_driver_fail_and_come_back_and_the_pyramid_stands(mission):
    summary, output = mission(3)
    assert (summary["success"], summary["placed"], summary["placed_lost"]) == (True, 6, 0)
    strikes = {strike["name"]: strike for strike in summary["strikes"]}  # of several alike, the last
    stopped = next(name.partition(":")[2] for name in strikes if name.startswith("release"))
    other = {"left": "right", "right": "left"}[stopped]
    made = changes(summary)
    assert ("fd2", f"fd1_{other}") in made and ("", "fd1_1") in made  # the other arm goes on, with the base
    assert ("fd2_2", "fd2_1") in made  # its setting for the dark, and that for the light
    assert made[-1] == (f"fd1_{other}", "fd2")
    late = [name for name, strike in strikes.items() if strike["recover_s"] is None]
    assert not [name for name in late if name.startswith(("obstacle", "component", "release"))]
    last = read_pyramid(output / "mission.bag").groundings[-1]
    assert [report.function for report in last if report.configuration] == ["f_pick_place"]  # the others are released
    assert (output / "mission.png").stat().st_size > 100_000
    again = subprocess.run(
        ["metacontrol", "summary", str(output / "mission.bag")], capture_output=True, text=True, check=True
    )
    assert json.loads(again.stdout) == summary


def test_the_robot_stops_and_says_why_when_no_arm_works(mission):
    summary, _ = mission(4)
    assert (summary["success"], summary["goal_reached"], summary["stands_still"]) == (True, False, True)
    assert "no arm" in summary["reason"] or "arm is stopped" in summary["reason"]
    assert any(refusal["objective"] == "o_pick_place" for refusal in summary["refusals"])
