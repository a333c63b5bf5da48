"""Plans what an arm does for an action, among what is known to be around it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from arm_motion.grasping import reachable
from arm_motion.scene import Scene
from robot_formulas.geometry import Pose

from metacontrol_manipulation.handling.deeds import Move, go, put, rise, take
from metacontrol_manipulation.handling.surroundings import BlockPose, Surroundings
from metacontrol_manipulation.pick_place.actions import Pick, Place, PutDown
from metacontrol_manipulation.pick_place.pyramid import SIDE, TABLE_HEIGHT

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from arm_motion.scene import Box
    from pybullet_simulator.robot.manipulator import ArmMount

    from metacontrol_manipulation.handling.deeds import Deed
    from metacontrol_manipulation.pick_place.progress import Progress

_CELL = 0.02
"""m; places within it count as the same when it is asked what is in reach."""
_AT_HOME = 0.1
"""rad within which all joints of an arm are at home."""
_NEAR = 0.045
"""m: a known block that is nearer to a place than this is the one that is meant."""


class Handler:
    """Plans for both arms. It keeps a planning scene: close it."""

    def __init__(self, mounts: Iterable[ArmMount]) -> None:
        """Prepare.

        Args:
            mounts: where the arms stand on the robot.
        """
        self._mounts = {mount.name: mount for mount in mounts}
        self._scene = Scene()
        self._bare = Scene()
        self._reached: dict[tuple[str, int, int, int], bool] = {}
        self._seed = 0

    def close(self) -> None:
        """Free the planning scenes."""
        self._scene.close()
        self._bare.close()

    def deeds(
        self,
        action: Pick | Place | PutDown,
        joints: Mapping[str, Sequence[float]],
        cell: Pose,
        progress: Progress,
        way_of_other: Sequence[Deed] = (),
    ) -> list[Deed]:
        """Return what the arm of an action does, from where it is.

        Args:
            action: what is to be done.
            joints: of both arms, rad.
            cell: pose of the cell frame in base_link.
            progress: the blocks that are known.
            way_of_other: what the other arm is at: it may stop, and go back, anywhere on its way.

        Raises:
            HandlingError: it is out of reach, or there is no path.
        """
        around = self._look_around(action.arm, joints, cell, progress, action, way_of_other)
        here = joints[action.arm]
        if isinstance(action, Pick):
            block = BlockPose(action.block.x, action.block.y, action.block.z, action.block.yaw)
            return take(self._scene, around, here, block, self._seed)
        if isinstance(action, Place):
            return put(self._scene, around, here, BlockPose(*action.slot.position), self._seed)
        return put(self._scene, around, here, BlockPose(action.x, action.y, TABLE_HEIGHT + SIDE / 2.0), self._seed)

    def place_and_leave(
        self,
        action: Place,
        joints: Mapping[str, Sequence[float]],
        cell: Pose,
        progress: Progress,
        way_of_other: Sequence[Deed] = (),
    ) -> list[Deed]:
        """Return how an arm puts a block into its slot, and goes out of the camera's way; see `deeds`.

        Raises:
            HandlingError: it is out of reach, or there is no path.
        """
        deeds = self.deeds(action, joints, cell, progress, way_of_other)
        after = replace(progress, filled=progress.filled | {action.slot})
        there = {**joints, action.arm: _end(deeds, joints[action.arm])}
        return [*deeds, *self.away(action.arm, there, cell, after, way_of_other, holds=False)]

    def away(
        self,
        arm: str,
        joints: Mapping[str, Sequence[float]],
        cell: Pose,
        progress: Progress,
        way_of_other: Sequence[Deed] = (),
        *,
        holds: bool,
    ) -> list[Deed]:
        """Return how an arm goes out of the camera's way.

        Raises:
            HandlingError: there is no path.
        """
        self._look_around(arm, joints, cell, progress, None, way_of_other)
        return go(self._scene, joints[arm], self._mounts[arm].home, self._seed, holds=holds)

    def rise(self, arm: str, joints: Mapping[str, Sequence[float]], cell: Pose, progress: Progress) -> list[Deed]:
        """Return how a hand rises straight from among the blocks; nothing where it is not there.

        Raises:
            HandlingError: something is in the way.
        """
        self._look_around(arm, joints, cell, progress, None)
        top = TABLE_HEIGHT - self._mounts[arm].z
        return rise(self._scene, joints[arm], top) if self.is_away(arm, joints[arm]) else []

    def is_away(self, arm: str, joints: Sequence[float]) -> bool:
        """Return whether an arm is not where it is out of the way."""
        return max(abs(one - other) for one, other in zip(joints, self._mounts[arm].home, strict=True)) > _AT_HOME

    def hand(self, arm: str, joints: Sequence[float], cell: Pose) -> tuple[float, float, float]:
        """Return where an arm's hand is, the point between its fingertips, in the cell frame, m.

        Args:
            arm: which one.
            joints: rad.
            cell: pose of the cell frame in base_link.
        """
        (x, y, z), _ = self._bare.forward(joints)
        mount = self._mounts[arm]
        place = cell.inverse() @ Pose(mount.x + x, mount.y + y)
        return place.x, place.y, mount.z + float(z)

    def reach(self, arm: str, position: tuple[float, float, float], base_y: float, home_x: float) -> bool:
        """Return whether an arm reaches a place from above, when nothing is in the way.

        Args:
            arm: which one.
            position: m, in the cell frame.
            base_y: m, where the base stands along the table.
            home_x: m, how far before the table, in the cell frame.
        """
        mount = self._mounts[arm]
        x, y, z = position[0] - home_x - mount.x, position[1] - base_y - mount.y, position[2] - mount.z
        key = arm, round(x / _CELL), round(y / _CELL), round(z / _CELL)
        if key not in self._reached:
            self._reached[key] = reachable(self._bare, key[1] * _CELL, key[2] * _CELL, key[3] * _CELL)
        return self._reached[key]

    def _look_around(
        self,
        arm: str,
        joints: Mapping[str, Sequence[float]],
        cell: Pose,
        progress: Progress,
        action: Pick | Place | PutDown | None,
        way_of_other: Sequence[Deed] = (),
    ) -> Surroundings:
        """Fill the scene with what is around an arm, without the block that it takes."""
        self._seed += 1
        around = Surroundings(self._mounts[arm], cell)
        known = [BlockPose(block.x, block.y, block.z, block.yaw) for block in progress.blocks]
        known += [BlockPose(*slot.position) for slot in progress.filled]
        if isinstance(action, Pick):
            block = action.block
            known = [one for one in known if _distance(one, (block.x, block.y, block.z)) > _NEAR]
        other = next((mount for name, mount in self._mounts.items() if name != arm), None)
        if other is None:
            self._scene.set(around.boxes(known))
            return around
        ways: list[Box] = []
        for deed in way_of_other:
            if isinstance(deed, Move):
                ways += around.of_other(other, self._bare.swept(list(deed.trajectory.positions)))
        self._scene.set(around.boxes(known), around.other_arm(other, joints[other.name]), ways)
        return around


def _end(deeds: Sequence[Deed], joints: Sequence[float]) -> Sequence[float]:
    """Return where an arm is after it has done something, rad."""
    moves = [deed for deed in deeds if isinstance(deed, Move)]
    return list(moves[-1].trajectory.positions[-1]) if moves else joints


def _distance(one: BlockPose, place: tuple[float, float, float]) -> float:
    return float(((one.x - place[0]) ** 2 + (one.y - place[1]) ** 2 + (one.z - place[2]) ** 2) ** 0.5)
