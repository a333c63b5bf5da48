"""Blocks on the table, by depth alone: which lie loose, which slots of the pyramid are filled."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from metacontrol_manipulation.perception.clumps import clumps_in
from metacontrol_manipulation.perception.fitting import DIFFERENCE, Evidence, evidence_for, fitted
from metacontrol_manipulation.perception.scene import TABLE_HALF, Cube, DepthView, cube_depth, depth_view
from metacontrol_manipulation.perception.squares import RESOLUTION, Plane, Square, plane_at, squares_in
from metacontrol_manipulation.pick_place.pyramid import LAYERS, SIDE, SLOTS, TABLE_HEIGHT, Slot, carrying

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from metacontrol_manipulation.perception.camera import Camera

IN_SLOT = 0.01
"""m between a block and its slot within which the slot counts as filled."""
IN_SLOT_YAW = math.radians(15.0)
"""rad, the same for the yaw."""
AGREEMENT = 0.8
"""Share of a block's visible pixels that have to show it; more than the share of a gripper's that do by chance."""
VISIBILITY = 0.35
"""Share of a block's pixels that has to be visible."""
LEAST_PIXELS = 60
"""Pixels that have to show a block, of 300 to 400 without anything before it."""
CONTINUATION = 0.4
"""Share of the pixels around a block that may show something as near: two blocks that touch share one side of four."""
HELD = 0.04
"""m from where a gripper holds a block within which a cube is that block."""
WHERE_BLOCKS_LIE = ((-0.38, 0.0), (-0.70, 0.70))
"""m along x and y, the part of the table on which blocks lie."""


@dataclass(frozen=True, slots=True)
class Block:
    """A block that lies loose, in the cell frame.

    Attributes:
        x: m, its centre.
        y: m.
        z: m.
        yaw: rad, within -pi/4 and pi/4, because a cube looks the same after a quarter turn.
    """

    x: float
    y: float
    z: float
    yaw: float


@dataclass(frozen=True, slots=True)
class BlockView:
    """What a depth image tells of blocks.

    Attributes:
        blocks: those that lie loose with nothing on them, from the smallest y on.
        filled: slots with a block within `IN_SLOT`, and those that carry them.
        hidden: slots of which it can't be told, because something is before them.
        seen: share of the table's part for blocks that is not hidden.
        unclear: where something small is that may be a block which leans on something, its place about.
    """

    blocks: tuple[Block, ...]
    filled: frozenset[Slot]
    hidden: frozenset[Slot]
    seen: float
    unclear: tuple[Block, ...] = ()


def find_blocks(
    depth: NDArray[np.float32], camera: Camera, cell: Pose, held: Sequence[tuple[float, float, float]] = ()
) -> BlockView:
    """Return the loose blocks and the filled slots that a depth image shows.

    Args:
        depth: (height, width) in m along the optical axis, 0 or not a number where nothing was measured.
        camera: that took it.
        cell: pose of the cell frame in base_link.
        held: where grippers hold blocks, in the cell frame: such a block lies nowhere.
    """
    view = depth_view(depth, camera, cell)
    planes = [plane_at(view, TABLE_HEIGHT + SIDE * (layer + 1)) for layer in range(LAYERS + 1)]
    cubes = [cube for cube in _confirmed(fitted(_candidates(planes), view), view) if not _is_held(cube, held)]
    in_slots = _in_slots(cubes, held, view)
    known = [*cubes, *(cube for cube in in_slots.values() if cube not in cubes)]
    filled = carrying(in_slots)
    loose = [cube for cube in cubes if cube not in in_slots.values() and _can_be_taken(cube, known)]
    hidden = {
        slot for slot in SLOTS if slot not in filled and (_is_held(_in(slot), held) or _is_hidden(slot, known, view))
    }
    blocks = sorted((Block(cube.x, cube.y, cube.z, _quarter(cube.yaw)) for cube in loose), key=lambda block: block.y)
    unclear = tuple(Block(clump.x, clump.y, clump.top - SIDE / 2.0, clump.yaw) for clump in clumps_in(view, known))
    return BlockView(tuple(blocks), filled, frozenset(hidden), _seen(planes[0]), unclear)


def _candidates(planes: Sequence[Plane]) -> list[Cube]:
    """Return where cubes may be, from above: those below them are hidden in part."""
    found: list[Cube] = []
    for layer in reversed(range(len(planes))):
        z = TABLE_HEIGHT + SIDE * (layer + 0.5)
        slots = [Square(*slot.position[:2], 0.0) for slot in SLOTS if slot.layer == layer]
        for square in squares_in(planes[layer], slots):
            cube = Cube(square.x, square.y, z, square.yaw)
            if not any(_overlap(cube, other) for other in found):
                found.append(cube)
    return found


def _overlap(cube: Cube, other: Cube) -> bool:
    """Return whether two cubes can't both be there: they are nearer than two cubes may be, by a share."""
    return abs(cube.z - other.z) < 0.8 * SIDE and math.hypot(cube.x - other.x, cube.y - other.y) < 0.8 * SIDE


def _confirmed(cubes: Sequence[Cube], view: DepthView) -> list[Cube]:
    """Return the cubes that the image shows and that stand on something, without those that others explain better."""
    found = [(cube, evidence_for(cube, cubes, view)) for cube in cubes]
    found = [(cube, evidence) for cube, evidence in found if _is_shown(evidence) and not _floats(cube, cubes, view)]
    found.sort(key=lambda each: -each[1].shown)
    kept: list[Cube] = []
    for cube, _ in found:
        if not any(_overlap(cube, other) for other in kept):
            kept.append(cube)
    return kept


def _is_shown(evidence: Evidence) -> bool:
    return (
        evidence.shown >= LEAST_PIXELS
        and evidence.agreement >= AGREEMENT
        and evidence.visibility >= VISIBILITY
        and evidence.continuation <= CONTINUATION
    )


def _floats(cube: Cube, cubes: Sequence[Cube], view: DepthView) -> bool:
    """Return whether the camera sees below a cube that nothing carries, as below one in a gripper."""
    if cube.z < TABLE_HEIGHT + SIDE or any(_carries(other, cube) for other in cubes):
        return False
    # Points half a block below the cube, which whatever carries it would hide.
    steps = np.linspace(-0.4, 0.4, 9) * SIDE
    across, along = (grid.ravel() for grid in np.meshgrid(steps, steps))
    points = np.column_stack((cube.x + across, cube.y + along, np.full(across.size, cube.z - SIDE)))
    pixels = view.project(points)
    height, width = view.depth.shape
    with np.errstate(invalid="ignore"):
        points = points[((pixels > -0.5) & (pixels < (width - 0.5, height - 0.5))).all(axis=1)]
    columns, rows = np.round(view.project(points)).astype(int).T
    rays = view.rays[rows, columns]
    clear = ~np.isfinite(cube_depth(cube, view.origin, rays))
    expected = (cube.z - SIDE - view.origin[2]) / rays[:, 2]
    through = view.depth[rows, columns] > expected + DIFFERENCE
    return bool(clear.any() and through[clear].mean() > 0.9)


def _carries(below: Cube, cube: Cube) -> bool:
    """Return whether a cube stands on another one, at least in part."""
    return abs(cube.z - below.z - SIDE) < 0.2 * SIDE and math.hypot(cube.x - below.x, cube.y - below.y) < SIDE


def _can_be_taken(cube: Cube, cubes: Sequence[Cube]) -> bool:
    """Return whether nothing is on a cube, and it is not the top of something tall that is no pile of cubes."""
    if any(_carries(cube, other) for other in cubes):
        return False
    return cube.z < TABLE_HEIGHT + 2.0 * SIDE or any(_carries(other, cube) for other in cubes)


def _is_held(cube: Cube, held: Sequence[tuple[float, float, float]]) -> bool:
    return any(math.dist((cube.x, cube.y, cube.z), place) <= HELD for place in held)


def _in_slots(cubes: Sequence[Cube], held: Sequence[tuple[float, float, float]], view: DepthView) -> dict[Slot, Cube]:
    """Return the blocks in slots: those whose top was found, and from below those that are seen from the side."""
    found = {slot: cube for slot in SLOTS for cube in cubes if _fills(cube, slot)}
    for slot in SLOTS:
        known = [*cubes, *found.values()]
        carried = all(below in found for below in slot.supports)
        if slot not in found and carried and not _is_held(_in(slot), held) and _shows_in(slot, known, view):
            found[slot] = _in(slot)
    return found


def _in(slot: Slot) -> Cube:
    return Cube(*slot.position, 0.0)


def _fills(cube: Cube, slot: Slot) -> bool:
    return math.dist((cube.x, cube.y, cube.z), slot.position) <= IN_SLOT and abs(_quarter(cube.yaw)) <= IN_SLOT_YAW


def _shows_in(slot: Slot, cubes: Sequence[Cube], view: DepthView) -> bool:
    """Return whether a block in a slot is seen from the side, where its top is hidden."""
    block = _in(slot)
    return not any(_overlap(block, cube) for cube in cubes) and _is_shown(evidence_for(block, cubes, view))


def _is_hidden(slot: Slot, cubes: Sequence[Cube], view: DepthView) -> bool:
    """Return whether it can't be told what is in a slot that holds no block for certain."""
    block = _in(slot)
    if any(_overlap(block, cube) for cube in cubes):
        return False
    evidence = evidence_for(block, cubes, view)
    return evidence.visibility < VISIBILITY or evidence.agreement > 0.5


def _seen(top: Plane) -> float:
    """Return the share of the part for blocks in which the camera sees the plane of their tops, or through it."""
    rows, columns = (
        slice(round((low + half) / RESOLUTION), round((high + half) / RESOLUTION))
        for (low, high), half in zip(WHERE_BLOCKS_LIE, TABLE_HALF, strict=True)
    )
    return float((top.there | top.free)[rows, columns].mean())


def _quarter(yaw: float) -> float:
    """Return the yaw of a cube within -pi/4 and pi/4."""
    return math.remainder(yaw, math.pi / 2.0)
