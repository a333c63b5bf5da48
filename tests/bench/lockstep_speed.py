"""Simulated seconds per wall second of D2 in lockstep, one process: the whole mission on route r1, the baseline.

Front laser 10 Hz x 361 rays, controller, planner and costmaps at the variant's rates; rear laser and camera unused. The
baseline: what the meta-controller analyses would be done by another process.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import rospkg
from metacontrol_experiments.io.input_files import read_route
from metacontrol_experiments.io.lockstep_setup import set_up
from metacontrol_experiments.lockstep.lockstep import SETTLE_S
from metacontrol_experiments.mission.settings import Settings
from support.figures import GAZEBO, entry

_RUNS = 3


def run() -> list[dict[str, Any]]:
    """Return the entry `lockstep_speed`: the best of some runs, since others share the processor."""
    package = Path(rospkg.RosPack().get_path("metacontrol_sim"))
    route = read_route(package / "worlds" / "routes.yaml", "r1")
    speeds = []
    with tempfile.TemporaryDirectory(prefix="bench_") as folder:
        for _ in range(_RUNS):
            lockstep = set_up(Settings(route, Path(folder), manager="none"))
            began = time.perf_counter()
            state = lockstep.run().state
            simulated = (state.ended_s or 0.0) - state.started_s + SETTLE_S
            speeds.append(simulated / (time.perf_counter() - began))
    return [entry("lockstep_speed", max(speeds), "s/s", len(speeds), *GAZEBO, higher_is_better=True)]
