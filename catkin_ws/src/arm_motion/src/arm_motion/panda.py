"""The Franka Panda: its limits, its home, and its model in pybullet_data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pybullet_data

URDF = str(Path(pybullet_data.getDataPath()) / "franka_panda" / "panda.urdf")

LOWER = np.array([-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973])
UPPER = np.array([2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
"""rad; the data sheet's (soft) limits, which are 0.07 rad within those where the joints of the URDF end."""

MAX_VELOCITY = np.array([2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61])
"""rad/s; data sheet."""

MAX_ACCELERATION = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
"""rad/s2; limits of the Franka Control Interface."""

HOME = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
"""rad; elbow up, hand downwards, in front of the base."""

JOINTS = 7
TCP_LINK = 11
"""PyBullet's number of panda_grasptarget, the point between the fingertips."""
FINGERS = (9, 10)
"""PyBullet's numbers of the fingers' joints and links."""
OPEN = 0.04
"""m; how far each finger is from the middle when the gripper is open."""
