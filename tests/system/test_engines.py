"""The same missions by both engines, through the real command."""

from __future__ import annotations

import json
import os
import signal
import statistics
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import psutil
import pytest
from metacontrol_experiments.io.processes import wait_until
from pyarrow import parquet

if TYPE_CHECKING:
    from pathlib import Path

SEEDS = 2
LIMIT_S = 500.0
ROUTES = "short: {start: [-8, -8, 0.78], goal: [-3, -4.2, 0]}\n"
CAMPAIGN = f"""
routes_file: routes.yaml
parts:
  short:
    routes: [short]
    initial_configurations: [f2_v2_r2]
    clutter: [2]
    failures: {{dead: ["kill:front_laser@share:0.3"]}}
    managers: {{mros: {SEEDS}}}
"""


def write_campaign(folder: Path) -> None:
    (folder / "routes.yaml").write_text(ROUTES)
    (folder / "short.yaml").write_text(CAMPAIGN)


def campaign(engine: str) -> list[str]:
    return ["metacontrol", "campaign", "short.yaml", "--engine", engine, "--output", engine]


def summaries(folder: Path, engine: str) -> list[dict[str, Any]]:
    rows = parquet.read_table(folder / engine / "results.parquet").to_pylist()
    assert [(row["status"], row["engine"], row["repeat"]) for row in rows] == [
        ("done", engine, number + 1) for number in range(SEEDS)
    ]
    return [json.loads(row["summary"]) for row in rows]


def placed(summary: dict[str, Any]) -> list[list[float]]:
    """Where the clutter of a mission lay."""
    return next(entry["places"] for entry in summary["perturbations"] if entry["name"] == "clutter:2")


def driven(summary: dict[str, Any]) -> float:
    """Return the seconds without those of reconfigurations, which take wall time on ROS."""
    delays = ("detect_s", "decide_s", "execute_s")
    return summary["duration_s"] - sum(change[name] or 0.0 for change in summary["reconfigurations"] for name in delays)


def spent_energy(summary: dict[str, Any]) -> float:
    """Return the energy level times the seconds for which it held, summed over the mission.

    The mean over time does not compare the engines: on ROS, the robot stands still for as long as the machine takes to
    reconfigure it, at a level near 0. On a loaded machine this halved the mean, with the same energy for the way.
    """
    return summary["mean_qa"]["energy"] * summary["duration_s"]


def test_both_engines_tell_the_same_story_over_seeds(tmp_path):
    """Compare what does not depend on how fast the machine is, with room for what a loaded machine does to the drive.

    The missions run at real-time factor 1: at 2, a machine with five times the work that it has cores for missed 69 %
    of the commands, and at 1 it missed 7 %.

    The energy: `power_load` and `energy_level` make the level (1.3 v + 0.1 a + 0.04 rate - 0.2) / 4.8; a, the largest
    vibration of a second, is about 27 v. The 6 m of the way take 4.0 * 6 / 4.8 = 5.0 level seconds at any speed, and
    17 s of commands at 20 Hz take 0.6 / 4.8 * 17 = 2.1. A loaded machine changes only the second part. A share m of
    commands that are missed takes 0.8 / 4.8 * 17 / 7.1 = 40 % of m away. A second of standing still under commands adds
    0.125, or 2 %; one more stop adds a second of driving at most, 0.37 or 5 %. The bound, relative to ROS, allows for
    20 % less energy there than in lockstep, which is half of the commands missed, and for 33 % more, which is 6 more
    stops. Chance is far below: the engines differ by 1.0 +- 1.0 % on an idle machine (docs/decisions/0015).
    """
    write_campaign(tmp_path)
    compared = ["metacontrol", "compare", "ros", "lockstep"]
    for command in (campaign("ros"), campaign("lockstep"), compared):
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        assert done.returncode == 0, done.stderr
    report = done.stdout
    sys.stdout.write(report)
    ros, lockstep = summaries(tmp_path, "ros"), summaries(tmp_path, "lockstep")
    for one, other in zip(ros, lockstep, strict=True):
        for summary in (one, other):
            assert summary["goal_reached"] and summary["collisions"] == 0
            assert "component:front_laser" in [change["trigger"] for change in summary["reconfigurations"]]
            assert summary["final_configuration"].endswith(("_k", "_b"))  # without the front laser
        assert placed(one) == placed(other)
        assert one["contingency"] == other["contingency"]
    assert len({str(placed(summary)) for summary in ros}) == SEEDS
    # Bounds, not an equality: single missions differ as two runs on ROS do, the more so on a loaded machine.
    for figure, share in (
        (lambda s: s["path_length_m"], 0.15),
        (driven, 0.4),
        (spent_energy, 0.25),
    ):
        means = [statistics.fmean(map(figure, engine)) for engine in (ros, lockstep)]
        assert means[1] == pytest.approx(means[0], rel=share), report


def of_missions(folder: Path) -> list[psutil.Process]:
    """Return the processes of missions that have their temporary files in a folder."""
    return [
        process
        for process in psutil.process_iter(["environ"])
        if str(folder) in (process.info["environ"] or {}).get("ROS_LOG_DIR", "")
    ]


def test_campaign_on_ros_that_is_interrupted_ends_its_mission(tmp_path):
    write_campaign(tmp_path)
    own = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen(campaign("ros"), cwd=tmp_path, env=own, stderr=subprocess.PIPE, text=True) as process:
        assert wait_until(lambda: process.poll() is not None or of_missions(tmp_path), LIMIT_S)
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=150.0)
    assert process.returncode == 130, said
    assert "interrupted" in said and "Traceback" not in said
    assert not list(tmp_path.glob("ros/runs/**/result.json"))
    # The mission notices that its worker is gone, and ends what it has started.
    assert wait_until(lambda: not of_missions(tmp_path), LIMIT_S), of_missions(tmp_path)
