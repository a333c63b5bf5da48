"""The work cell on one core: steps while both arms and the base move, and images."""

from __future__ import annotations

import math
import time
from typing import Any

from pybullet_simulator.physics.cell_simulation import STEP, CellSimulation
from pybullet_simulator.robot.manipulator import ARMS
from support.figures import LIMIT, entry

_SECONDS = 20.0
_IMAGES = 20
_COMMAND_STEPS = 4


def run() -> list[dict[str, Any]]:
    """Return the entries `cell_speed` in simulated seconds per wall second without images, and `cell_image` in s."""
    cell = CellSimulation()
    steps = round(_SECONDS / STEP)
    began = time.perf_counter()
    for step in range(steps):
        if step % _COMMAND_STEPS == 0:
            swing = 0.3 * math.sin(step * STEP)
            cell.drive(0.0, 0.1 * math.sin(step * STEP), 0.0)
            for mount in ARMS:
                cell.arms[mount.name].command([angle + swing for angle in mount.home])
        cell.step()
    speed = _SECONDS / (time.perf_counter() - began)
    began = time.perf_counter()
    for _ in range(_IMAGES):
        cell.look()
    image = (time.perf_counter() - began) / _IMAGES
    cell.close()
    return [
        entry("cell_speed", speed, "s/s", steps, LIMIT, 3.0, higher_is_better=True),
        entry("cell_image", image, "s", _IMAGES, LIMIT, 0.1),
    ]
