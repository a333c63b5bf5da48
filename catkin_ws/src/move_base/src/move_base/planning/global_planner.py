"""Global planner: A* on an inflated costmap, then any-angle straightening.

`pyastar2d` finds a path in a few milliseconds but counts a diagonal step like a straight one, so its paths wander. They
only choose the way around the obstacles: dynamic programming over straight shortcuts then makes them taut.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import pyastar2d
from robot_formulas.geometry import Pose

from move_base.costmap.grid import INSCRIBED, LETHAL, UNKNOWN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.costmap.grid import Geometry
    from move_base.costmap.snapshot import Snapshot

COST_FACTOR = 0.8 / 50.0
"""Weight per unit of cost over a free cell's weight of 1: NavFn's COST_FACTOR over its COST_NEUTRAL."""

UNKNOWN_WEIGHT = 253.0 / 50.0
"""Weight of an unknown cell that may be crossed: NavFn gives it the highest cost below an obstacle's."""

ESCAPE_WEIGHT, PUSH_WEIGHT = 30.0, 300.0
"""Weights of inscribed and of obstacle cells around a start that lies among them; high, for a short way out."""

TIGHT_FACTOR = 3.0
"""Factor of the weight of cells where the robot cannot turn: those with less clearance than its circumscribed radius.
So a plan keeps off corners and enters a gap straight, and takes the gap where the way round is longer than three times
its length."""

PINCH_WEIGHT = 10.0
"""Weight of cells where the robot fits with half of its padding only. NavFn refuses them, and so loses every passage
that is hardly wider than the padded robot as soon as a noisy return narrows it by a cell."""

STRAIGHT_BIAS = 0.02
"""Extra weight per metre from the line between start and goal: breaks the ties of pyastar2d's metric."""

STRAIGHTEN_ROUNDS = ((0.5, 24), (0.35, 12), (0.25, 8))
"""Distance between the nodes that shortcuts join (m) and the longest shortcut (nodes), per round. The first round finds
the long lines, the others, whose nodes lie on the shortcuts of the one before, move the corners."""

SAMPLE_CELLS = 2.0
"""Distance between the samples of a shortcut, cells: blocked areas are a robot's width wide at least."""

PATH_SPACING = 0.05
"""Distance between the points of a plan, m."""

SMOOTHING_POINTS = 9
"""Points of the moving average that rounds corners: 0.45 m."""


class PlanningError(Exception):
    """There is no plan; the message says why."""


@dataclass(frozen=True)
class Plan:
    """A path of the robot's centre.

    Attributes:
        points: (N, 2), m, about PATH_SPACING apart; the first is the start.
        goal: the goal reached by the last point.
    """

    points: NDArray[np.float64]
    goal: Pose

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """The distances between neighbouring points (N - 1,), m."""
        return np.asarray(np.hypot(*np.diff(self.points, axis=0).T))

    def headings(self) -> NDArray[np.float64]:
        """Return the direction of travel at each point, the goal's yaw at the last (N,)."""
        steps = np.diff(self.points, axis=0)
        return np.append(np.arctan2(steps[:, 1], steps[:, 0]), self.goal.yaw)


def make_plan(
    snapshot: Snapshot, start: Pose, goal: Pose, *, tolerance: float = 0.0, escape_radius: float, allow_unknown: bool
) -> Plan:
    """Plan from start to goal.

    Args:
        snapshot: the inflated global costmap.
        start: in the costmap's frame. It may lie in the inflated area, then the plan leaves it by a short way.
        goal: in the same frame.
        tolerance: how far from a blocked goal the plan may end, m; it ends at the nearest cell that can be reached.
        escape_radius: within this distance of a blocked start inflated cells may be crossed, m.
        allow_unknown: whether unknown cells may be crossed.

    Raises:
        PlanningError: start or goal outside the map, goal blocked, no way, or a tolerance that makes no sense.
    """
    g = snapshot.geometry
    if not 0.0 <= tolerance < np.inf:
        raise PlanningError(f"the tolerance must be finite and at least 0, is {tolerance:g}")
    if not g.contains(start.x, start.y):
        raise PlanningError(f"the robot at ({start.x:.2f}, {start.y:.2f}) is outside the map")
    if not g.contains(goal.x, goal.y):
        raise PlanningError(f"the goal ({goal.x:.2f}, {goal.y:.2f}) is outside the map")
    start_cell, goal_cell = g.cell(start.x, start.y), g.cell(goal.x, goal.y)
    weights = _weigh(snapshot, (slice(None), slice(None)), allow_unknown)
    goal_is_free = bool(np.isfinite(weights[goal_cell])) and snapshot.costs[goal_cell] != INSCRIBED
    if not np.isfinite(weights[start_cell]):
        _open_start(weights, snapshot, start_cell, escape_radius)
    end_cell = goal_cell if goal_is_free else _nearest_end(snapshot, weights, start_cell, goal, tolerance)
    cells = pyastar2d.astar_path(_biased(weights, start_cell, end_cell), start_cell, end_cell, allow_diagonal=True)
    if cells is None:
        raise PlanningError(f"there is no way to the goal ({goal.x:.2f}, {goal.y:.2f})")
    points = g.centres(cells[:, 0], cells[:, 1])
    points[0] = start.x, start.y
    if end_cell == goal_cell:
        points[-1] = goal.x, goal.y
    if len(points) == 1:
        points = np.array([[start.x, start.y], [points[-1, 0], points[-1, 1]]])
    for spacing, longest in STRAIGHTEN_ROUNDS:
        points = _straighten(resample(points, spacing), weights, g, longest)
    points = _smooth(resample(points, PATH_SPACING), weights, g)
    end = goal if end_cell == goal_cell else Pose(float(points[-1, 0]), float(points[-1, 1]), goal.yaw)
    return Plan(points, end)


def path_cost(points: NDArray[np.float64], snapshot: Snapshot, *, allow_unknown: bool) -> float:
    """Return the weighted length (m) of a path on a costmap; infinite where it is blocked or leaves the map."""
    if len(points) < 2:
        return 0.0
    rows, columns = snapshot.geometry.cells(points)
    if rows.min() < 0 or columns.min() < 0 or rows.max() >= snapshot.geometry.height:
        return float("inf")
    if columns.max() >= snapshot.geometry.width:
        return float("inf")
    weights = _weigh(snapshot, (rows, columns), allow_unknown)
    lengths = np.hypot(*np.diff(points, axis=0).T)
    return float((lengths * weights[1:]).sum())


def resample(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return points (N, 2) at equal distances of about `spacing` (m) along a polyline, both ends included."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(2, round(along[-1] / spacing) + 1)
    wanted = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(wanted, along, points[:, axis]) for axis in (0, 1)], axis=1)


def _weigh(snapshot: Snapshot, cells: tuple[Any, Any], allow_unknown: bool) -> NDArray[np.float32]:
    """Return the weights of cells (indices of rows and columns): 1 for a free cell, infinite for a blocked one."""
    table = (1.0 + COST_FACTOR * np.arange(256)).astype(np.float32)
    table[INSCRIBED : LETHAL + 1] = np.inf
    table[UNKNOWN] = UNKNOWN_WEIGHT if allow_unknown else np.inf
    costs = snapshot.costs[cells]
    weights = np.asarray(cv2.LUT(costs, table), dtype=np.float32).reshape(costs.shape)
    tight = snapshot.clearance[cells] < np.float32(snapshot.radii.circumscribed)
    np.multiply(weights, np.float32(TIGHT_FACTOR), out=weights, where=tight)
    weights[snapshot.pinched[cells]] = PINCH_WEIGHT
    return weights


def _nearest_end(
    snapshot: Snapshot, weights: NDArray[np.float32], start: tuple[int, int], goal: Pose, tolerance: float
) -> tuple[int, int]:
    """Return the free cell nearest to a blocked goal, within the tolerance, that can be reached from the start."""
    g = snapshot.geometry
    cell = g.cell(goal.x, goal.y)
    reach = int(tolerance / g.resolution)
    top, left = max(cell[0] - reach, 0), max(cell[1] - reach, 0)
    _, parts = cv2.connectedComponents(np.isfinite(weights).astype(np.uint8), connectivity=8)
    window = (slice(top, cell[0] + reach + 1), slice(left, cell[1] + reach + 1))
    opened = (snapshot.costs[window] == INSCRIBED) | (snapshot.costs[window] == LETHAL)  # to let the robot out
    rows, columns = np.nonzero((parts[window] == parts[start]) & ~opened)
    distances = np.hypot(rows + top - cell[0], columns + left - cell[1]) * g.resolution
    if len(distances) and distances.min() <= tolerance:
        best = int(distances.argmin())
        return int(rows[best] + top), int(columns[best] + left)
    where = f"the goal ({goal.x:.2f}, {goal.y:.2f})"
    cost = snapshot.costs[cell]
    if cost == LETHAL:
        raise PlanningError(f"{where} is in an obstacle")
    if cost == UNKNOWN:
        raise PlanningError(f"{where} is in unknown space")
    raise PlanningError(f"{where} is {snapshot.clearance[cell]:.2f} m from an obstacle, too close for the robot")


def _open_start(weights: NDArray[np.float32], snapshot: Snapshot, cell: tuple[int, int], escape_radius: float) -> None:
    """Make blocked cells around the start passable at a high weight, in place."""
    reach = int(escape_radius / snapshot.geometry.resolution)
    top, left = max(cell[0] - reach, 0), max(cell[1] - reach, 0)
    window = (slice(top, cell[0] + reach + 1), slice(left, cell[1] + reach + 1))
    costs = snapshot.costs[window]
    rows, columns = np.ogrid[top : top + costs.shape[0], left : left + costs.shape[1]]
    distance = np.hypot(rows - cell[0], columns - cell[1])
    weights[window] = np.where((costs == INSCRIBED) & (distance <= reach), ESCAPE_WEIGHT, weights[window])
    weights[window] = np.where((costs == LETHAL) & (distance <= 0.5 * reach), PUSH_WEIGHT, weights[window])
    weights[cell] = ESCAPE_WEIGHT


def _biased(weights: NDArray[np.float32], start: tuple[int, int], end: tuple[int, int]) -> NDArray[np.float32]:
    """Add the bias to the straight line; the tables assume a resolution of 0.05 m closely enough at any other."""
    direction = np.array([end[0] - start[0], end[1] - start[1]], dtype=np.float32)
    length = float(np.hypot(*direction))
    if length < 1.0:
        return weights
    normal = direction[::-1] * np.array([1.0, -1.0], dtype=np.float32) / length
    rows = (np.arange(weights.shape[0], dtype=np.float32) - start[0]) * normal[0]
    columns = (np.arange(weights.shape[1], dtype=np.float32) - start[1]) * normal[1]
    bias = rows[:, None] + columns[None, :]
    np.abs(bias, out=bias)
    bias *= np.float32(STRAIGHT_BIAS * PATH_SPACING)
    bias += weights
    return bias


def _straighten(
    nodes: NDArray[np.float64], weights: NDArray[np.float32], geometry: Geometry, longest: int
) -> NDArray[np.float64]:
    """Return the cheapest chain of straight shortcuts, of at most `longest` steps, between a path's nodes (N, 2)."""
    count = len(nodes)
    if count < 3:
        return nodes
    longest = min(count - 1, longest)
    spacing = float(np.hypot(*(nodes[1] - nodes[0])))
    samples_per_step = max(2, round(spacing / (SAMPLE_CELLS * geometry.resolution)))
    # In units of cells and all positive, so that truncation finds the cell; x and y are the rows.
    pixels = ((nodes - (geometry.origin_x, geometry.origin_y)) / geometry.resolution).astype(np.float32).T.copy()
    flat = weights.ravel()
    costs = np.full((count, longest), np.inf)  # costs[j, k]: shortcut from node j - k - 1 to node j
    for step in range(1, longest + 1):
        starts = pixels[:, :-step]
        spans = pixels[:, step:] - starts
        fractions = _fractions(step * samples_per_step)
        places = spans[:, :, None] * fractions
        places += starts[:, :, None]
        columns, cells = places.astype(np.intp)
        cells *= geometry.width
        cells += columns
        means = flat.take(cells).sum(axis=1) / len(fractions)
        costs[step:, step - 1] = means * np.hypot(spans[0], spans[1]) * geometry.resolution
    best = np.zeros(count)  # from the last node to the first one, so that nearer ones come first
    previous = np.zeros(count, dtype=np.intp)
    for j in range(1, count):
        here = count - 1 - j
        totals = best[here + 1 : here + 1 + longest][:j] + costs[j, :j]
        step = int(totals.argmin())
        if totals[step] < np.inf:
            best[here], previous[j] = totals[step], j - step - 1
        else:  # the piece between two nodes cuts a corner: keep it as A* had it
            best[here], previous[j] = best[here + 1] + spacing * ESCAPE_WEIGHT, j - 1
    chain = [count - 1]
    while chain[-1] > 0:
        chain.append(int(previous[chain[-1]]))
    return nodes[chain[::-1]]


@lru_cache(maxsize=128)
def _fractions(samples: int) -> NDArray[np.float32]:
    """Return the middles of so many equal parts of 1."""
    return (np.arange(samples, dtype=np.float32) + np.float32(0.5)) / np.float32(samples)


def _smooth(points: NDArray[np.float64], weights: NDArray[np.float32], geometry: Geometry) -> NDArray[np.float64]:
    """Round corners by a moving average; a point that would come into a blocked cell stays where it was."""
    half = SMOOTHING_POINTS // 2
    if len(points) <= SMOOTHING_POINTS:
        return points
    sums = np.cumsum(np.vstack([np.zeros((1, 2)), points]), axis=0)
    smooth = points.copy()
    smooth[half:-half] = (sums[SMOOTHING_POINTS:] - sums[:-SMOOTHING_POINTS]) / SMOOTHING_POINTS
    rows, columns = geometry.cells(smooth)
    blocked = ~np.isfinite(weights[rows, columns])
    smooth[blocked] = points[blocked]
    return smooth
