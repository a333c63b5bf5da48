"""Paths of an arm that hit nothing: anywhere by OMPL's RRT-Connect, or along a straight line of the TCP.

A path is a list of joints, to be followed straight from one to the next.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from ompl import base, geometric, util

from arm_motion import kinematics
from arm_motion.panda import JOINTS, LOWER, UPPER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from arm_motion.scene import Box, Scene
    from arm_motion.vectors import Array, Vector

FINE = 0.01
"""rad; the norm of the steps in which a finished path is checked."""

_COARSE = 0.04  # rad, steps while planning; halved if the finished path is not free at fine steps
_ATTEMPTS = 3
_LINE_STEP = 0.005  # m
_TURN_STEP = 0.05  # rad
_LARGEST_STEP = 0.2  # rad of a joint from one point of a line to the next: more is a leap
_LAST_JOINT = np.array(sorted((step * 0.1 for step in range(-12, 13)), key=abs))  # rad


class NoPathError(RuntimeError):
    """There is no path, or none was found in time."""


def plan(
    scene: Scene,
    start: Vector,
    goal: Vector,
    *,
    seed: int,
    deadline: float,
    held: Box | None = None,
) -> list[Array]:
    """Return a short path between two postures that hits nothing.

    The same arguments give the same path if the search ends before its deadline, since nothing else depends on clocks;
    a search that ends by its deadline may succeed on a faster computer. OMPL has one generator of seeds in a process,
    which each call sets anew: calls in several threads at once would disturb each other.

    Args:
        scene: what is in the way.
        start: joints, rad.
        goal: joints, rad.
        seed: of the random search.
        deadline: s of wall time for each of at most three searches.
        held: what the arm holds, in the TCP's frame.

    Raises:
        NoPathError: start or goal is not free, or the search found nothing.
    """
    start, goal = np.asarray(start, float), np.asarray(goal, float)
    for name, joints in (("start", start), ("goal", goal)):
        if not scene.is_free(joints, held):
            raise NoPathError(f"the {name} {_text(joints)} hits something or is beyond a limit: choose another posture")
    if is_free(scene, [start, goal], held):
        return [start, goal]
    for attempt in range(_ATTEMPTS):
        path = _search(scene, start, goal, seed + attempt, deadline, held, _COARSE / 2**attempt)
        if is_free(scene, path, held):
            return path
    raise NoPathError(f"no path from {_text(start)} to {_text(goal)} is free at fine steps: use another seed or goal")


def line(
    scene: Scene,
    start: Vector,
    position: Vector,
    quaternion: Vector,
    held: Box | None = None,
) -> list[Array]:
    """Return a path along which the TCP moves straight, and turns evenly, to a pose.

    Joint 7 turns evenly, too; its angle at the end is chosen so that the joints move little.

    Raises:
        NoPathError: the pose, or part of the line, is out of reach or hits something.
    """
    start = np.asarray(start, float)
    positions, quaternions = _straight(*kinematics.forward(start), np.asarray(position), np.asarray(quaternion))
    share = np.linspace(0.0, 1.0, len(positions))
    reason = "is out of reach"
    tried = [_followed(start, positions, quaternions, start[6] + turn * share) for turn in _LAST_JOINT]
    ways = [way for way in tried if way is not None]
    for way in sorted(ways, key=_travel):
        path = list(way)
        if is_free(scene, path, held):
            return path
        reason = "hits something"
    raise NoPathError(f"the line to {_text(position)} from {_text(start)} {reason}: choose another posture or pose")


def is_free(scene: Scene, path: Sequence[Array], held: Box | None = None) -> bool:
    """Say whether a path is free at steps of at most 0.01 rad."""
    return scene.is_free(path[0], held) and all(
        scene.is_free(first + share * (second - first), held)
        for first, second in pairwise(path)
        for share in _shares(first, second)
    )


def _shares(first: Array, second: Array) -> Array:
    """Return shares of a way, those in its middle first, since they are free less often."""
    count = max(1, int(np.ceil(np.linalg.norm(second - first) / FINE)))
    shares = np.arange(1, count + 1) / count
    return shares[np.argsort(np.abs(shares - 0.5), kind="stable")]


def _search(
    scene: Scene, start: Array, goal: Array, seed: int, deadline: float, held: Box | None, step: float
) -> list[Array]:
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1 + seed % (2**31 - 2))
    space = base.RealVectorStateSpace(JOINTS)
    bounds = base.RealVectorBounds(JOINTS)
    for joint in range(JOINTS):
        bounds.setLow(joint, float(LOWER[joint]))
        bounds.setHigh(joint, float(UPPER[joint]))
    space.setBounds(bounds)
    space.setLongestValidSegmentFraction(step / float(np.linalg.norm(UPPER - LOWER)))
    setup = geometric.SimpleSetup(space)
    setup.setStateValidityChecker(lambda state: scene.is_free([state[joint] for joint in range(JOINTS)], held))
    states = [space.allocState(), space.allocState()]
    for state, joints in zip(states, (start, goal), strict=True):
        for joint in range(JOINTS):
            state[joint] = float(joints[joint])
    setup.setStartAndGoalStates(*states)
    planner = geometric.RRTConnect(setup.getSpaceInformation())
    setup.setPlanner(planner)
    setup.solve(deadline)
    if not setup.haveExactSolutionPath():
        raise NoPathError(
            f"no path from {_text(start)} to {_text(goal)} in {deadline} s: allow more time or another goal"
        )
    path = setup.getSolutionPath()
    simplifier = setup.getPathSimplifier()
    simplifier.reduceVertices(path)
    simplifier.partialShortcutPath(path)
    simplifier.reduceVertices(path)
    simplifier.smoothBSpline(path, 3)
    found = [np.array([path.getState(i)[joint] for joint in range(JOINTS)]) for i in range(path.getStateCount())]
    return [start, *found[1:-1], goal]


def _straight(position: Array, quaternion: Array, to: Array, turned: Array) -> tuple[Array, Array]:
    turned = turned / np.linalg.norm(turned)
    turned = turned if quaternion @ turned >= 0.0 else -turned
    angle = float(np.arccos(np.clip(quaternion @ turned, -1.0, 1.0)))
    steps = max(float(np.linalg.norm(to - position)) / _LINE_STEP, 2.0 * angle / _TURN_STEP)
    count = 1 + max(1, int(np.ceil(steps)))
    share = np.linspace(0.0, 1.0, count)[:, None]
    if angle > 1e-6:
        quaternions = (np.sin((1.0 - share) * angle) * quaternion + np.sin(share * angle) * turned) / np.sin(angle)
    else:
        quaternions = np.broadcast_to(quaternion, (count, 4))
    return position + share * (to - position), quaternions


def _followed(start: Array, positions: Array, quaternions: Array, last: Array) -> Array | None:
    """Return the way through poses that begins at a posture, or None if it leaps or ends on the way."""
    choices = kinematics.postures(positions, quaternions, last)
    way = [start]
    for options in choices[1:]:
        steps = np.abs(options - way[-1]).max(axis=1)
        if np.isnan(steps).all() or np.nanmin(steps) > _LARGEST_STEP:
            return None
        way.append(options[int(np.nanargmin(steps))])
    return np.array(way)


def _travel(way: Array) -> float:
    return float(np.abs(np.diff(way, axis=0)).sum())


def _text(joints: Vector) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in joints) + ")"
