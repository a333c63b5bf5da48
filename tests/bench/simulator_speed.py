"""The simulator's core alone on one core: steps with motion, ground truth, and one laser of 361 rays at 10 Hz."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import rospkg
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.physics.simulation import STEP, Settings, Simulation
from pybullet_simulator.robot.motion_sensors import REAL
from robot_formulas.geometry import Pose
from support.figures import entry

_SECONDS = 60.0
_SCAN_STEPS = 10


def run() -> list[dict[str, Any]]:
    """Return the entry `simulator_speed`: simulated seconds per wall second."""
    world = read_world(Path(rospkg.RosPack().get_path("metacontrol_sim")) / "worlds" / "factory.yaml")
    simulation = Simulation(world, Settings(Pose(-8.0, -8.0, 0.78), errors=REAL))
    began = time.perf_counter()
    for step in range(round(_SECONDS / STEP)):
        if step % 5 == 0:
            simulation.command(0.3, 0.0, 0.4)
        simulation.step()
        if step % _SCAN_STEPS == 0:
            simulation.scan(simulation.robot.front_laser)
    value = _SECONDS / (time.perf_counter() - began)
    simulation.close()
    return [entry("simulator_speed", value, "s/s", round(_SECONDS / STEP))]
