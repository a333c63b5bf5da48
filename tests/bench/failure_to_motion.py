"""Time from the SIGKILL of the laser's driver to the robot moving again, on the camera: wall, real-time factor 1.

Missions with the meta-controller, whose driver is killed on the way. "Moving again" is the first moment after the kill
at which the camera's variant is deployed and the robot, by the ground truth, goes faster than 0.05 m/s.
"""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from metacontrol_bags.bag import read_record
from support.figures import LIMIT, entry
from support.missions import drive

_MISSIONS = 3
_LIMIT_S = 2.0  # what was asked for
_MOVING_MPS = 0.05
_WINDOW = 10  # samples of 0.02 s over which the speed is taken
_TIMEOUT_S = 30.0  # simulated; the mission need not reach its goal


def run() -> list[dict[str, Any]]:
    """Return the entry `failure_to_motion`: the median in s."""
    times = [_measure(seed) for seed in range(1, _MISSIONS + 1)]
    return [entry("failure_to_motion", statistics.median(times), "s", len(times), LIMIT, _LIMIT_S)]


def _measure(seed: int) -> float:
    """Return the time of one mission in s; at real-time factor 1 simulated and wall time are the same."""
    with tempfile.TemporaryDirectory(prefix="bench_") as folder:
        options = ("--seed", str(seed), "--contingency", "kill:front_laser@time:8", "--timeout", str(_TIMEOUT_S))
        drive(folder, *options)
        record = read_record(Path(folder) / "mission.bag")
    killed = record.event("PERTURBATION")
    if killed is None:
        raise RuntimeError("the driver was not killed")
    deployed = [r.stamp for r in record.configurations if r.configuration.endswith("_k") and r.state == "STABLE"]
    if not deployed:
        raise RuntimeError("no variant on the camera was deployed")
    stamps, way = record.poses[:, 0], record.poses[:, 1:]
    speeds = np.hypot(*(way[_WINDOW:] - way[:-_WINDOW]).T) / (stamps[_WINDOW:] - stamps[:-_WINDOW])
    moving = stamps[:-_WINDOW][(stamps[:-_WINDOW] >= deployed[0]) & (speeds > _MOVING_MPS)]
    if not moving.size:
        raise RuntimeError("the robot did not move again")
    return float(moving[0] - killed.stamp)
