"""Whole missions with the real command: a master, a simulator, everything."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from typing import TYPE_CHECKING

import psutil
import pytest
import rosbag
from metacontrol_bags.bag import read_record

if TYPE_CHECKING:
    from pathlib import Path

FACTOR = ("--real-time-factor", "2")
SLOW = ("--real-time-factor", "0.5")
"""A driver takes wall time to start, a report to arrive; a goal is given up, and faults strike, by simulated time."""
CLUTTER = ("--contingency", "clutter:3", "--failure", "front_laser")
LIMITS = ("--nfr-energy", "1", "--nfr-safety", "1")
"""On a busy machine, either level may ask for a change before the laser fails."""
LIMIT_S = 240.0


def left_behind(output: Path) -> list[str]:
    """Command lines of processes that still run with the mission's log folder in their environment."""
    found = []
    for process in psutil.process_iter():
        try:
            if process.environ().get("ROS_LOG_DIR") == str(output / "log") and process.status() != psutil.STATUS_ZOMBIE:
                found.append(" ".join(process.cmdline()))
        except (psutil.Error, OSError):
            continue
    return found


def metacontrol(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["metacontrol", *arguments], capture_output=True, text=True, timeout=LIMIT_S, check=False)


def account(result: subprocess.CompletedProcess[str], output: Path) -> str:
    """All that a mission and its nodes have said."""
    return f"{result.stdout}{result.stderr}\n{(output / 'log' / 'console.log').read_text(errors='replace')}"


@pytest.fixture(scope="module")
def adapted(tmp_path_factory):
    output = tmp_path_factory.mktemp("adapted")
    return metacontrol("run", "--output", str(output), *CLUTTER, "--failure-at", "0.4", *LIMITS, *FACTOR), output


@pytest.fixture(scope="module")
def baseline(tmp_path_factory):
    output = tmp_path_factory.mktemp("baseline")
    arguments = ("--no-metacontrol", *CLUTTER, "--failure-at", "0.1", "--timeout", "60", *LIMITS, *FACTOR)
    return metacontrol("run", "--output", str(output), *arguments), output


def test_killed_laser_is_replaced_by_the_camera_and_the_robot_arrives(adapted):
    result, output = adapted
    assert result.returncode == 0, account(result, output)
    summary = json.loads((output / "summary.json").read_text())
    assert summary["goal_reached"] is True
    assert summary["collisions"] == 0
    assert summary["goals"] == {"sent": 1, "failed": 0}
    changes = [entry for entry in summary["reconfigurations"] if entry["trigger"] == "component:front_laser"]
    assert changes and changes[0]["to"].endswith("_k")
    assert all(changes[0][key] is not None for key in ("detect_s", "decide_s", "execute_s"))
    assert summary["final_configuration"].endswith("_k")


def test_timeline_tells_all_four_steps(adapted):
    result, _ = adapted
    assert "component front_laser has failed" in result.stdout
    for step in ("R1", "R2", "R3", "R4"):
        assert f" {step} " in result.stdout


def test_replay_of_the_bag_decides_the_same_again(adapted):
    command = ["rosrun", "mros1_reasoner", "replay", str(adapted[1] / "mission.bag")]
    replayed = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert "the same" in replayed.stdout


def test_summary_follows_from_the_bag_alone(adapted):
    _, output = adapted
    again = metacontrol("summary", str(output / "mission.bag"))
    assert json.loads(again.stdout) == json.loads((output / "summary.json").read_text())
    assert (output / "mission.png").stat().st_size > 10_000


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_metrics_of_the_bag_are_those_of_the_run_also_compressed(adapted, tmp_path, compression):
    _, output = adapted
    path = tmp_path / "mission.bag"
    with rosbag.Bag(str(output / "mission.bag")) as recorded, rosbag.Bag(str(path), "w", compression) as written:
        for topic, message, stamp, header in recorded.read_messages(raw=True, return_connection_header=True):
            written.write(topic, message, stamp, raw=True, connection_header=header)
    result = metacontrol("bag", "metrics", "--json", str(path))
    assert (result.returncode, result.stderr) == (0, "")
    (told,) = json.loads(result.stdout)
    assert told["summary"] == json.loads((output / "summary.json").read_text())


def test_baseline_stops_for_want_of_a_sensor(baseline):
    result, output = baseline
    assert result.returncode == 1, account(result, output)
    summary = json.loads((output / "summary.json").read_text())
    assert summary["goal_reached"] is False and summary["metacontrol"] is False
    assert summary["reconfigurations"] == []
    assert [entry["name"] for entry in summary["perturbations"]] == ["clutter:3", "component:front_laser"]
    assert (output / "mission.png").exists()


def test_both_runs_meet_the_same_clutter(adapted, baseline):
    places = [sorted(read_record(output / "mission.bag").obstacles) for _, output in (adapted, baseline)]
    assert len(places[0]) == 3 and places[0] == places[1]
    told = [json.loads((output / "summary.json").read_text())["contingency"] for _, output in (adapted, baseline)]
    assert told[0] == told[1] == {"clutter": 3, "power": 1.0, "component": "front_laser"}


@pytest.mark.parametrize("run", ["adapted", "baseline"])
def test_nothing_is_left_behind(run, request):
    _, output = request.getfixturevalue(run)
    assert left_behind(output) == []


def test_interrupted_mission_leaves_nothing_but_its_bag(tmp_path):
    command = ["metacontrol", "run", "--output", str(tmp_path), "--quiet"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + LIMIT_S
        while not (tmp_path / "mission.bag.active").exists() and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.1)
        assert left_behind(tmp_path)
        os.kill(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=150.0)
    assert process.returncode == 130, said
    assert left_behind(tmp_path) == []
    assert (tmp_path / "mission.bag").exists()


def test_robot_without_its_laser_waits_in_the_dark_until_the_camera_sees(tmp_path):
    (tmp_path / "routes.yaml").write_text("short: {start: [-8, -8, 0.78], goal: [-5, -5.6, 0]}\n")
    route = ("--routes", str(tmp_path / "routes.yaml"), "--route", "short")
    texts = ("light:0@time:1", "kill:front_laser@time:3", "light:1@time:8")
    strikes = [word for text in texts for word in ("--contingency", text)]
    result = metacontrol("run", "--no-spares", "--output", str(tmp_path), *route, *strikes, *LIMITS, *SLOW)
    assert result.returncode == 0, account(result, tmp_path)
    record = read_record(tmp_path / "mission.bag")
    dark, *_ = [report.stamp for report in record.observed if report.name == "light" and report.level == 0.0]
    light_again = next(event.stamp for event in record.events if event.name == "light:1")
    waits, *_ = [decision for decision in record.decisions if decision.state == "FAILED"]
    assert dark < waits.stamp < light_again
    assert "no design can be deployed without front_laser or where light 0 < 0.25" in waits.explanation
    taken = [decision for decision in record.decisions if decision.state == "EXECUTED"]
    assert taken[0].to_configuration.endswith("_k") and taken[0].stamp > light_again
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["goal_reached"] and summary["collisions"] == 0


def test_manager_in_place_of_the_reasoner_starts_the_dead_laser_again(tmp_path):
    (tmp_path / "routes.yaml").write_text("short: {start: [-8, -8, 0.78], goal: [-5, -5.6, 0]}\n")
    route = ("--routes", str(tmp_path / "routes.yaml"), "--route", "short")
    strike = ("--contingency", "kill:front_laser@time:2")
    result = metacontrol("run", "--output", str(tmp_path), "--manager", "respawn", *route, *strike, *SLOW)
    assert result.returncode == 0, account(result, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["goal_reached"] and summary["reconfigurations"] == []
    assert "component front_laser is back" in result.stdout
    assert left_behind(tmp_path) == []
