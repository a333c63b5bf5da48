"""A planning scene in PyBullet: an arm, boxes around it, another arm beside it, and what the arm holds.

Everything is in the arm's base frame (link0): m, rad, quaternions (x, y, z, w). The links' shapes are the convex hulls
of the meshes in pybullet_data, the fingers are open.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pybullet

from arm_motion import kinematics
from arm_motion.panda import FINGERS, JOINTS, LOWER, OPEN, TCP_LINK, UPPER, URDF

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

    from arm_motion.vectors import Array, Vector

TOUCH = 0.001
"""m; how deep a held box may be in another body: a block that stands on a table touches it."""

_MOVING = (1, 2, 3, 4, 5, 6, 8, 9, 10)
"""Links that may hit something: PyBullet's numbers. The links before only turn about the base's axis."""
_SELF = (*((link, other) for link in (4, 5, 6, 8, 9, 10) for other in (-1, 0, 1)), (4, 6), (4, 8))
"""Pairs of links that may hit each other, by 1000 random postures; other pairs never do, or always touch."""
_WITH_HELD = (-1, 0, 1, 2, 3, 4, 5, 6)
_FAR = (0.0, 0.0, 100.0)
_SWEEPING = ((2,), (3,), (4,), (5,), (6,), (8, 9, 10))
"""Links whose way is swept, the hand with its fingers as one; those before hardly leave their places."""
_ROOM_OF_HAND = 0.03
"""m by which the hand's way is wider: it may hold something."""
_SWEEP_STEP = 0.15
"""rad, the norm, between postures of a way that is swept."""
_BOXES_OF_BODY = 16
"""As many as PyBullet puts into one body."""


@dataclass(frozen=True, slots=True)
class Box:
    """A box.

    Attributes:
        position: of its centre, m: in link0, or in the TCP's frame if the arm holds it.
        size: full lengths along its axes, m.
        quaternion: its orientation.
    """

    position: tuple[float, float, float]
    size: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


class Scene:
    """What an arm must not hit.

    A scene is a PyBullet world of its own: close it, or use it in a `with`. It is not for several threads at once.
    """

    def __init__(
        self,
        boxes: Sequence[Box] = (),
        other_arm: tuple[Sequence[float], Sequence[float]] | None = None,
        *,
        clearance: float = 0.005,
    ) -> None:
        """Build the scene.

        Args:
            boxes: what stands around the arm.
            other_arm: position of the other arm's link0, which has the same orientation, and its joints.
            clearance: m that the arm keeps from boxes and from the other arm. What it holds keeps none.
        """
        self.clearance = clearance
        self._client = pybullet.connect(pybullet.DIRECT)
        self._arm = self._load((0.0, 0.0, 0.0))
        self._other: int | None = None
        self._offset: tuple[float, ...] | None = None
        self._obstacles: list[int] = []
        self._ways: list[int] = []
        self._held: tuple[Box, int] | None = None
        self.set(boxes, other_arm)

    def set(
        self,
        boxes: Sequence[Box] = (),
        other_arm: tuple[Sequence[float], Sequence[float]] | None = None,
        ways: Sequence[Box] = (),
    ) -> None:
        """Replace boxes and other arm, which is faster than a new scene.

        Args:
            boxes: as above.
            other_arm: as above.
            ways: where another arm may come, see `swept`: boxes along the axes of the frame, of which many cost little.
        """
        for body in (*self._obstacles, *self._ways):
            pybullet.removeBody(body, physicsClientId=self._client)
        self._obstacles = [self._body(box) for box in boxes]
        self._ways = [self._bodies(ways[i : i + _BOXES_OF_BODY]) for i in range(0, len(ways), _BOXES_OF_BODY)]
        offset = None if other_arm is None else tuple(other_arm[0])
        if offset != self._offset:
            if self._other is not None:
                pybullet.removeBody(self._other, physicsClientId=self._client)
            # Loaded anew: what PyBullet moves is not link0, but its centre of mass, 5 cm above.
            self._offset, self._other = offset, None if offset is None else self._load(offset)
        if other_arm is not None and self._other is not None:
            self._pose(self._other, other_arm[1])

    def __enter__(self) -> Scene:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the scene."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1

    def forward(self, joints: Vector) -> tuple[Array, Array]:
        """Return position and quaternion of the TCP."""
        return kinematics.forward(joints)

    def inverse(self, position: Vector, quaternion: Vector, near: Vector) -> Array | None:
        """Return the joints that put the TCP there, nearest to the posture `near`, whether they are free or not.

        Returns:
            joints within the limits, or None if the pose is out of reach.
        """
        found = kinematics.inverse(position, quaternion, near)
        return found[0] if len(found) else None

    def free_inverse(
        self,
        position: Vector,
        quaternion: Vector,
        near: Vector,
        held: Box | None = None,
    ) -> Array | None:
        """Return the joints that put the TCP there, nearest to the posture `near`, and hit nothing.

        Returns:
            joints within the limits, or None if the pose is out of reach or something is always in the way.
        """
        found = kinematics.inverse(position, quaternion, near)
        return next((joints for joints in found if self.is_free(joints, held)), None)

    def swept(self, path: Sequence[Vector]) -> list[Box]:
        """Return boxes along the axes of link0 in which all that moves of the arm is, somewhere on a path.

        Args:
            path: joints, to be followed straight from one to the next. Neighbours should not be far from each other.
        """
        boxes: list[Box] = []
        for first, second in pairwise(_thinned(path)):
            lows, highs = (np.stack(bounds) for bounds in zip(self._bounds(first), self._bounds(second), strict=True))
            low, high = lows.min(axis=0), highs.max(axis=0)
            boxes += [_between(one, other) for one, other in zip(low, high, strict=True)]
        return boxes

    def _bounds(self, joints: Vector) -> tuple[Array, Array]:
        """Return the lowest and the highest corners (links, 3) of what moves in a posture."""
        self._pose(self._arm, joints)
        lows, highs = [], []
        for links in _SWEEPING:
            corners = np.array([pybullet.getAABB(self._arm, link, self._client) for link in links])
            lows.append(corners[:, 0].min(axis=0))
            highs.append(corners[:, 1].max(axis=0))
        lows[-1] -= _ROOM_OF_HAND
        highs[-1] += _ROOM_OF_HAND
        return np.stack(lows), np.stack(highs)

    def is_free(self, joints: Vector, held: Box | None = None, clearance: float | None = None) -> bool:
        """Say whether a posture is within the limits, and neither the arm nor what it holds hits anything.

        Args:
            joints: rad.
            held: what the arm holds, in the TCP's frame.
            clearance: in place of the scene's.
        """
        clearance = self.clearance if clearance is None else clearance
        joints = np.asarray(joints, float)
        if (joints < LOWER).any() or (joints > UPPER).any():
            return False
        self._pose(self._arm, joints)
        others = [*self._obstacles, *self._ways, *([] if self._other is None else [self._other])]
        if any(self._hits(other, clearance) for other in others) or self._hits_itself():
            return False
        return held is None or not self._held_hits(held, others)

    def _hits(self, other: int, clearance: float) -> bool:
        near = pybullet.getClosestPoints(self._arm, other, clearance, physicsClientId=self._client)
        return any(point[3] in _MOVING for point in near)

    def _hits_itself(self) -> bool:
        arm, client = self._arm, self._client
        return any(
            pybullet.getClosestPoints(arm, arm, 0.0, link, other, physicsClientId=client) for link, other in _SELF
        )

    def _held_hits(self, held: Box, others: list[int]) -> bool:
        if self._held is None or self._held[0] != held:
            if self._held is not None:
                pybullet.removeBody(self._held[1], physicsClientId=self._client)
            self._held = held, self._body(Box(_FAR, held.size))
        body = self._held[1]
        tcp = pybullet.getLinkState(self._arm, TCP_LINK, computeForwardKinematics=True, physicsClientId=self._client)
        pose = pybullet.multiplyTransforms(tcp[4], tcp[5], held.position, held.quaternion)
        pybullet.resetBasePositionAndOrientation(body, *pose, self._client)
        if any(pybullet.getClosestPoints(body, other, -TOUCH, physicsClientId=self._client) for other in others):
            return True
        near = pybullet.getClosestPoints(body, self._arm, -TOUCH, physicsClientId=self._client)
        return any(point[4] in _WITH_HELD for point in near)

    def _load(self, position: Sequence[float]) -> int:
        arm = pybullet.loadURDF(URDF, position, useFixedBase=True, physicsClientId=self._client)
        for finger in FINGERS:
            pybullet.resetJointState(arm, finger, OPEN, physicsClientId=self._client)
        return arm

    def _body(self, box: Box) -> int:
        half = [length / 2.0 for length in box.size]
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client)
        return pybullet.createMultiBody(
            0.0,
            shape,
            basePosition=box.position,
            baseOrientation=box.quaternion,
            physicsClientId=self._client,
        )

    def _bodies(self, boxes: Sequence[Box]) -> int:
        """Make one body of boxes."""
        shapes = pybullet.createCollisionShapeArray(
            [pybullet.GEOM_BOX] * len(boxes),
            halfExtents=[[length / 2.0 for length in box.size] for box in boxes],
            collisionFramePositions=[list(box.position) for box in boxes],
            collisionFrameOrientations=[list(box.quaternion) for box in boxes],
            physicsClientId=self._client,
        )
        return int(pybullet.createMultiBody(0.0, shapes, physicsClientId=self._client))

    def _pose(self, arm: int, joints: Vector) -> None:
        values = [[float(angle)] for angle in joints]
        pybullet.resetJointStatesMultiDof(arm, range(JOINTS), values, physicsClientId=self._client)


def _thinned(path: Sequence[Vector]) -> list[Array]:
    """Return postures of a path that are about as far from each other as its way is swept; at least two."""
    points = [np.asarray(joints, float) for joints in path]
    kept = [points[0]]
    for point in points[1:-1]:
        if np.linalg.norm(point - kept[-1]) >= _SWEEP_STEP:
            kept.append(point)
    return [*kept, points[-1]]


def _between(low: Array, high: Array) -> Box:
    (x, y, z), (length, width, height) = ((low + high) / 2.0).tolist(), (high - low).tolist()
    return Box((x, y, z), (length, width, height))
