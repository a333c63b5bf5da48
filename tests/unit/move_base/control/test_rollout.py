"""Roll-outs: where velocities lead, and whether a footprint is free, found with a part of the costmap or all of it."""

import math
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from move_base.control.rollout import Footprint, Rollout, roll_out
from move_base.costmap.grid import FREE, LETHAL, Geometry
from move_base.costmap.inflation import Inflation
from move_base.costmap.snapshot import Radii, Snapshot
from robot_formulas.geometry import Pose, inscribed_radius

RADII = Radii(0.1, 0.2, 0.05)
GEOMETRY = Geometry(0.05, 80, 60, -2.0, -1.5)
CORNERS = st.sampled_from(
    [
        np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]),
        np.array([[0.5, 0.0], [-0.2, 0.3], [-0.2, -0.3]]),
        np.array([[0.1, 0.1], [0.1, -0.1], [-0.1, -0.1], [-0.1, 0.1]]),
    ]
)


def free_plainly(footprint, rollout, costs):
    """Whether each trajectory is free, by the distances of cells to every obstacle, pose by pose."""
    obstacles = GEOMETRY.centres(*np.nonzero(costs == LETHAL)).reshape(-1, 2)
    margin = footprint.margin + 0.5 * GEOMETRY.resolution

    def is_free(pose):
        if not GEOMETRY.contains(pose.x, pose.y):
            return False
        middle = distance(np.array([[pose.x, pose.y]]), obstacles)
        edge = pose.apply(footprint.edge)
        return middle > footprint.circumscribed + margin or (
            middle > footprint.inscribed + margin and distance(edge, obstacles) > margin
        )

    trajectories = zip(rollout.x, rollout.y, rollout.yaw, strict=True)
    return [all(is_free(Pose(*pose)) for pose in zip(*trajectory, strict=True)) for trajectory in trajectories]


def distance(points, obstacles):
    """The smallest distance between the cells of points (N, 2), or those at the border, and obstacles (M, 2)."""
    rows, columns = GEOMETRY.cells(points)
    centres = GEOMETRY.centres(rows.clip(0, GEOMETRY.height - 1), columns.clip(0, GEOMETRY.width - 1))
    return np.hypot(*(centres[:, None, :] - obstacles).T).min() if len(obstacles) else math.inf


@given(
    CORNERS,
    st.floats(0.0, 0.2),
    st.integers(0, 2**32),
    st.sampled_from([0.0, 0.002, 0.02]),
    st.builds(Pose, st.floats(-2.5, 2.5), st.floats(-2.0, 2.0), st.floats(-4.0, 4.0)),
)
def test_trajectories_are_free_as_their_poses_are_one_by_one(corners, margin, seed, chance, robot):
    # On a border of cells, and where the margin is just a distance between cells, rounding decides.
    robot, margin = Pose(robot.x + 0.00137, robot.y + 0.00171, robot.yaw), margin + 0.00119
    rng = np.random.default_rng(seed)
    costs = np.where(rng.random(GEOMETRY.shape) < chance, LETHAL, FREE).astype(np.uint8)
    footprint = Footprint(corners, margin)
    # All distances count that decide something: inscribed and circumscribed radius with their margin.
    inflation = Inflation(None, GEOMETRY.resolution, inscribed_radius(corners), footprint.circumscribed + margin)
    velocities = rng.uniform((-0.2, -0.3, -1.5), (0.8, 0.3, 1.5), (12, 3))
    rollout = roll_out(velocities, robot, 1.5, 6)
    lazy, eager = (Snapshot(GEOMETRY, costs, inflation, RADII) for _ in range(2))
    free = footprint.is_free(rollout, lazy)
    assert eager.costs is not None  # from now on it looks up in the whole
    np.testing.assert_array_equal(free, footprint.is_free(rollout, eager))
    with mock.patch("move_base.control.rollout.EDGES_AT_ONCE", 1):
        np.testing.assert_array_equal(free, footprint.is_free(rollout, eager))
    np.testing.assert_array_equal(free, free_plainly(footprint, rollout, costs))
    here = Rollout(np.zeros((1, 3)), *(np.array([[value]]) for value in (robot.x, robot.y, robot.yaw)))
    assert footprint.is_free_at(robot, lazy) == free_plainly(footprint, here, costs)[0]


@given(
    st.lists(st.tuples(*[st.sampled_from([-1.2, -0.3, 0.0, 1e-12, 0.1, 0.5])] * 3), min_size=1, max_size=30),
    st.builds(Pose, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-4.0, 4.0)),
    st.integers(1, 7),
)
def test_velocities_that_turn_alike_lead_where_each_leads_alone(velocities, robot, steps):
    together = roll_out(np.array(velocities), robot, 2.0, steps)
    for index, velocity in enumerate(velocities):
        alone = roll_out(np.array([velocity]), robot, 2.0, steps)
        for axis in ("x", "y", "yaw"):
            np.testing.assert_array_equal(getattr(together, axis)[index], getattr(alone, axis)[0])
        # A constant turn moves the base on a circle: integrate it in small steps.
        x, y, yaw = robot.x, robot.y, robot.yaw
        for _ in range(2000):
            middle = yaw + velocity[2] * 0.0005
            x += 0.001 * (velocity[0] * math.cos(middle) - velocity[1] * math.sin(middle))
            y += 0.001 * (velocity[0] * math.sin(middle) + velocity[1] * math.cos(middle))
            yaw += 0.001 * velocity[2]
        assert (alone.x[0, -1], alone.y[0, -1], alone.yaw[0, -1]) == pytest.approx((x, y, yaw), abs=1e-5)
