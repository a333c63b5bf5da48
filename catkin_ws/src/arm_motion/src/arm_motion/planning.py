"""Paths of an arm that hit nothing: anywhere by OMPL's RRT-Connect, or along a straight line of the TCP.

A path is a list of joints, to be followed straight from one to the next.
"""

from __future__ import annotations

from dataclasses import replace
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
_ROOM = 0.003  # m that what the arm holds is wider on a path: between two checks it may come nearer than at both
_ATTEMPTS = 3
_DEPARTURES, _DEPARTURE_TRIALS = (0.02, 0.05, 0.1, 0.2), 25  # rad of each joint
_SHORTCUTS = 30  # tries to cut a corner
_LINE_STEP = 0.005  # m
_TURN_STEP = 0.05  # rad
_LARGEST_STEP = 0.12  # rad of a joint from one point of a line to the next: more is a leap
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

    An arm that stands nearer to something than the scene's clearance, but does not touch it, leaves first. What it
    holds counts as wider than it is, by 3 mm on each side, where both ends have that room.

    The same arguments give the same path if the search ends before its deadline, since nothing else depends on clocks;
    a search that ends by its deadline may succeed on a faster computer. OMPL has one generator of seeds in a process,
    which each call sets anew: calls in several threads at once would disturb each other.

    Args:
        scene: what is in the way.
        start: joints, rad.
        goal: joints, rad.
        seed: of the random search.
        deadline: s of wall time for the search.
        held: what the arm holds, in the TCP's frame.

    Raises:
        NoPathError: start or goal is not free, or the search found nothing.
    """
    start, goal = np.asarray(start, float), np.asarray(goal, float)
    if not scene.is_free(goal, held):
        raise NoPathError(f"the goal {_text(goal)} hits something or is beyond a limit: choose another posture")
    before, start = _departure(scene, start, held, seed)
    held = _with_room(scene, held, start, goal)
    if is_free(scene, [start, goal], held):
        return [*before, start, goal]
    end = base.timedPlannerTerminationCondition(deadline)
    for attempt in range(_ATTEMPTS):
        path = _search(scene, start, goal, seed * _ATTEMPTS + attempt, end, held, _COARSE / 2**attempt)
        if path is None:
            raise NoPathError(
                f"no path from {_text(start)} to {_text(goal)} in {deadline} s: allow more time, or choose another goal"
            )
        if is_free(scene, path, held):
            return [*before, *path]
    raise NoPathError(f"no path from {_text(start)} to {_text(goal)} is free at fine steps: use another seed or goal")


def line(
    scene: Scene,
    start: Vector,
    position: Vector,
    quaternion: Vector,
    held: Box | None = None,
) -> list[Array]:
    """Return a path along which the TCP moves straight, and turns evenly, to a pose.

    Joint 7 turns evenly, too; its angle at the end is chosen so that the joints move little. From a few postures, such
    as one with an upright upper arm, joints would have to leap: that counts as out of reach.

    Raises:
        NoPathError: the pose, or part of the line, is out of reach or hits something.
    """
    start = np.asarray(start, float)
    reason = "is out of reach, or beyond the limits of the joints"
    poses = _straight(*kinematics.forward(start), np.asarray(position, float), np.asarray(quaternion, float))
    for way in sorted(_ways(start, *poses), key=_travel):
        path = list(way)
        if scene.is_free(path[-1], held) and is_free(scene, path, held):
            return path
        reason = "hits something"
    raise NoPathError(f"the line to {_text(position)} from {_text(start)} {reason}: choose another posture or pose")


def is_free(scene: Scene, path: Sequence[Array], held: Box | None = None, clearance: float | None = None) -> bool:
    """Say whether a path is free at steps of at most 0.01 rad, see `Scene.is_free`."""
    return scene.is_free(path[0], held, clearance) and all(
        scene.is_free(first + share * (second - first), held, clearance)
        for first, second in pairwise(path)
        for share in _shares(first, second)
    )


def _with_room(scene: Scene, held: Box | None, *ends: Array) -> Box | None:
    """Return a wider box than is held; the same one where that is free at the ends only without room, as on a table."""
    if held is None:
        return None
    length, width, height = (extent + 2.0 * _ROOM for extent in held.size)
    wider = replace(held, size=(length, width, height))
    return wider if all(scene.is_free(end, wider) for end in ends) else held


def _departure(scene: Scene, start: Array, held: Box | None, seed: int) -> tuple[list[Array], Array]:
    """Return the path to where a search can begin, and that posture: the start itself, or a free one beside it."""
    if scene.is_free(start, held):
        return [], start
    random = np.random.default_rng(seed)
    for distance in np.repeat(_DEPARTURES, _DEPARTURE_TRIALS):
        beside = start + random.uniform(-distance, distance, JOINTS)
        if scene.is_free(beside, held) and is_free(scene, [start, beside], held, clearance=0.0):
            return [start], beside
    raise NoPathError(f"the start {_text(start)} hits something or is beyond a limit: move the arm away first")


def _shares(first: Array, second: Array) -> Array:
    """Return shares of a way, those in its middle first, since they are free less often."""
    count = max(1, int(np.ceil(np.linalg.norm(second - first) / FINE)))
    shares = np.arange(1, count + 1) / count
    return shares[np.argsort(np.abs(shares - 0.5), kind="stable")]


def _search(
    scene: Scene,
    start: Array,
    goal: Array,
    seed: int,
    end: base.PlannerTerminationCondition,
    held: Box | None,
    step: float,
) -> list[Array] | None:
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
    setup.solve(end)
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    simplifier = setup.getPathSimplifier()
    simplifier.reduceVertices(path)
    simplifier.partialShortcutPath(path, _SHORTCUTS, _SHORTCUTS)
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


def _ways(start: Array, positions: Array, quaternions: Array) -> list[Array]:
    """Return the ways (n, 7) through n poses that begin at a posture and do not leap, by how far joint 7 turns."""
    count, turns = len(positions), len(_LAST_JOINT)
    last = start[6] + np.outer(np.linspace(0.0, 1.0, count), _LAST_JOINT).ravel()
    choices = kinematics.postures(np.repeat(positions, turns, axis=0), np.repeat(quaternions, turns, axis=0), last)
    way = [np.broadcast_to(start, (turns, JOINTS))]
    for options in choices.reshape(count, turns, 4, JOINTS)[1:]:
        steps = np.nan_to_num(np.abs(options - way[-1][:, None]).max(axis=2), nan=np.inf)
        best = steps.argmin(axis=1)
        following = options[np.arange(turns), best]
        following[steps[np.arange(turns), best] > _LARGEST_STEP] = np.nan
        way.append(following)
    return [one for one in np.stack(way, axis=1) if not np.isnan(one[-1]).any()]


def _travel(way: Array) -> float:
    return float(np.abs(np.diff(way, axis=0)).sum())


def _text(joints: Vector) -> str:
    return "(" + ", ".join(f"{value:.2f}" for value in joints) + ")"
