"""Maps are sent as runs of equal cells."""

import math
import tracemalloc
from types import SimpleNamespace as Thing

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from metacontrol_dashboard.state.grids import packed, yaw_of


@given(arrays(np.int8, st.tuples(st.integers(1, 20), st.integers(1, 20)), elements=st.integers(-1, 100)))
def test_runs_read_back_as_the_grid(grid):
    found = packed(grid, 0.1, 0.0, 0.0)
    runs = found["runs"]
    cells = [shade for shade, count in zip(runs[::2], runs[1::2], strict=True) for _ in range(count)]
    expected = [0 if v < 0 else 1 if v < 1 else 2 if v < 50 else 3 if v < 99 else 4 for v in grid.ravel()]
    assert cells == expected


def test_large_map_is_thinned_out_and_obstacles_stay():
    grid = np.zeros((700, 500), dtype=np.int8)
    grid[333, 222] = 100
    found = packed(grid, 0.05, 1.0, 2.0)
    assert (found["rows"], found["columns"], found["resolution"]) == (234, 167, pytest.approx(0.15))
    assert 4 in found["runs"][::2]


SHAPES = st.one_of(
    st.tuples(st.integers(1, 3), st.integers(1, 2000)),
    st.tuples(st.integers(1, 2000), st.integers(1, 3)),
    st.tuples(st.integers(290, 330), st.integers(290, 330)),
)


@given(SHAPES, st.integers(0, 2**32 - 1))
def test_thinned_map_has_the_worst_of_each_square(shape, seed):
    grid = np.random.default_rng(seed).choice(np.array([-1, 0, 30, 60, 100], np.int8), shape)
    found = packed(grid, 0.05, 0.0, 0.0)
    step = math.ceil(max(shape) / 300)
    starts = [(row, column) for row in range(0, shape[0], step) for column in range(0, shape[1], step)]
    worst = np.array([grid[row : row + step, column : column + step].max() for row, column in starts])
    assert (found["rows"], found["columns"]) == tuple(-(-side // step) for side in shape)
    assert found["runs"] == packed(worst.reshape(found["rows"], found["columns"]), 0.05 * step, 0.0, 0.0)["runs"]


@pytest.mark.parametrize("shape", [(1_200_000, 1), (1, 1_200_000)])
def test_narrow_map_takes_no_more_memory_than_it_has(shape):
    tracemalloc.start()
    try:
        found = packed(np.zeros(shape, dtype=np.int8), 0.05, 0.0, 0.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert {found["rows"], found["columns"]} == {300, 1}
    assert peak < 10_000_000


def test_yaw_of_an_orientation():
    turned = Thing(x=0.0, y=0.0, z=math.sin(0.4), w=math.cos(0.4))
    assert yaw_of(turned) == pytest.approx(0.8)
