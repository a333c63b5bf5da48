"""Whole missions of D1 with the real command: each scenario once."""

import json
import subprocess

import pytest
from metacontrol_experiments.pyramid.record import read_pyramid

SEEDS = (3, 4, 5)
LIMIT_S = 1100.0


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    """Drive a scenario once; return its result and its folder.

    On a busy machine, an obstacle may come when the arm has passed. It strikes again then, so late that the pyramid may
    stand before all of the scenario has happened: such a mission is driven again.
    """
    driven = {}

    def drive(scenario):
        for seed in SEEDS if scenario not in driven else ():
            output = tmp_path_factory.mktemp(f"scenario{scenario}")
            words = ["--mission", "manipulation", "--scenario", scenario, "--seed", seed, "--output", output]
            command = ["metacontrol", "run", *map(str, words)]
            result = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
            console = (output / "log" / "console.log").read_text(errors="replace")
            assert result.returncode == 0, f"{result.stdout}{result.stderr}\n{console}"
            driven[scenario] = json.loads((output / "summary.json").read_text()), output
            names = [strike["name"] for strike in driven[scenario][0]["strikes"]]
            if not any(names.count(name) > 1 for name in names if name.startswith("obstacle")):
                break
        return driven[scenario]

    return drive


def changes(summary):
    return [(change["from"], change["to"]) for change in summary["reconfigurations"]]


def test_tags_are_found_again_in_the_dark_and_in_the_light_and_the_node_runs_on(mission):
    summary, _ = mission(1)
    assert (summary["success"], summary["placed"], summary["placed_lost"]) == (True, 6, 0)
    first, second = changes(summary)
    assert first == second[::-1] and set(first) == {"fd2_1", "fd2_2"}
    assert all(strike["recover_s"] is not None for strike in summary["strikes"])


def test_the_other_arm_goes_on_with_the_base_when_one_meets_an_obstacle(mission):
    summary, output = mission(2)
    assert (summary["success"], summary["placed"]) == (True, 6)
    assert changes(summary)[:3] == [("", "fd2_1"), ("", "fd1_1"), ("fd2", "fd1_right")]
    assert (output / "mission.png").stat().st_size > 100_000
    again = subprocess.run(
        ["metacontrol", "summary", str(output / "mission.bag")], capture_output=True, text=True, check=True
    )
    assert json.loads(again.stdout) == summary


def test_both_arms_go_on_when_the_stopped_one_is_free_again_and_a_dead_driver_is_repaired(mission):
    summary, output = mission(3)
    assert (summary["success"], summary["placed"]) == (True, 6)
    assert [strike["name"].partition(":")[0] for strike in summary["strikes"]].count("release") == 1
    assert changes(summary)[-1][1] == "fd2"
    last = read_pyramid(output / "mission.bag").groundings[-1]
    assert [report.function for report in last if report.configuration] == ["f_pick_place"]  # the others are released


def test_the_robot_stops_and_says_why_when_no_arm_works(mission):
    summary, _ = mission(4)
    assert (summary["success"], summary["goal_reached"], summary["stands_still"]) == (True, False, True)
    assert "no arm" in summary["reason"] or "arm is stopped" in summary["reason"]
    assert any(refusal["objective"] == "o_pick_place" for refusal in summary["refusals"])
