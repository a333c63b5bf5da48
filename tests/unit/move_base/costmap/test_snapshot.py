"""Snapshots: a part of a costmap is the same as that part of the whole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from move_base.costmap.grid import FREE, LETHAL, UNKNOWN, Geometry
from move_base.costmap.inflation import Inflation
from move_base.costmap.snapshot import Radii, Snapshot
from move_base.parameters.parameters import Layer

RADII = Radii(0.1, 0.2, 0.05)


@st.composite
def snapshots(draw):
    """Two snapshots of one costmap: with any obstacles or none, any radii, and any layer or none."""
    shape = draw(st.tuples(st.integers(1, 60), st.integers(1, 60)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    chance = draw(st.sampled_from([0.0, 0.001, 0.01, 0.1, 0.9]))
    costs = np.where(rng.random(shape) < chance, LETHAL, FREE).astype(np.uint8)
    costs[rng.random(shape) < draw(st.sampled_from([0.0, 0.1]))] = UNKNOWN
    resolution = draw(st.sampled_from([0.02, 0.05, 0.3]))
    radius = draw(st.floats(0.0, 0.8))
    layer = Layer("inflation", "inflation", inflation_radius=radius, inflate_unknown=draw(st.booleans()))
    inflation = Inflation(draw(st.sampled_from([layer, None])), resolution, 0.1, draw(st.floats(0.1, 0.5)))
    geometry = Geometry(resolution, shape[1], shape[0], -1.0, 2.0)
    return tuple(Snapshot(geometry, costs, inflation, RADII) for _ in range(2))


ENDS = st.tuples(st.integers(-10, 70), st.integers(0, 40)).map(lambda pair: (pair[0], pair[0] + pair[1]))


@given(snapshots(), st.lists(st.tuples(ENDS, ENDS), min_size=1, max_size=4))
def test_part_is_what_the_whole_has_there(pair, areas):
    lazy, eager = pair
    assert eager.costs.shape == eager.clearance.shape == eager.geometry.shape
    assert eager.clearance.max() <= eager.clearance_limit
    for rows, columns in areas:
        part = lazy.part(rows, columns)
        height, width = part.costs.shape
        window = (slice(part.row, part.row + height), slice(part.column, part.column + width))
        np.testing.assert_array_equal(part.costs, eager.costs[window])
        np.testing.assert_array_equal(part.clearance, eager.clearance[window])
        cells = np.mgrid[slice(*rows), slice(*columns)].reshape(2, -1)
        inside = (cells >= 0).all(axis=0) & (cells < np.array([lazy.geometry.shape]).T).all(axis=0)
        found = cells[0, inside], cells[1, inside]
        np.testing.assert_array_equal(part.costs_at(*found), eager.costs[found])
        np.testing.assert_array_equal(part.clearance_at(*found), eager.clearance[found])
        if inside.any():
            assert lazy.part_with(*found) is part


@given(snapshots(), st.floats(-2.0, 3.0), st.floats(1.0, 5.0), st.floats(0.0, 1.0))
def test_part_around_a_point_has_the_cells_within_reach(pair, x, y, reach):
    snapshot, _ = pair
    part = snapshot.part_around(x, y, reach)
    rows, columns = np.indices(snapshot.geometry.shape).reshape(2, -1)
    centres = snapshot.geometry.centres(rows, columns)
    for row, column in zip(rows[(near := (np.abs(centres - (x, y)) <= reach).all(axis=1))], columns[near], strict=True):
        assert part.covers((row, row), (column, column))


def test_nothing_is_inflated_again_while_look_ups_stay_near():
    snapshot = Snapshot(
        Geometry(0.05, 400, 400, 0.0, 0.0), np.zeros((400, 400), dtype=np.uint8), Inflation(None, 0.05, 0.1, 0.2), RADII
    )
    part = snapshot.part((100, 120), (200, 220))
    assert part.costs.size < 50 * 50
    assert snapshot.part((99, 119), (202, 222)) is part
    assert snapshot.part((90, 110), (202, 222)) is not part


@pytest.mark.parametrize("shape", [(1, 1), (30, 50)])
def test_without_obstacles_everything_is_as_far_as_can_be(shape):
    inflation = Inflation(Layer("inflation", "inflation"), 0.05, 0.1, 0.2)
    snapshot = Snapshot(Geometry(0.05, shape[1], shape[0], 0.0, 0.0), np.zeros(shape, dtype=np.uint8), inflation, RADII)
    assert not snapshot.costs.any()
    assert (snapshot.clearance == np.float32(snapshot.clearance_limit)).all()
