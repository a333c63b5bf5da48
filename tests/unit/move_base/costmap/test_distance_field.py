"""Inflation that looks at changes only is the same as inflation of the whole grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from move_base.costmap.grid import FREE, LETHAL, UNKNOWN
from move_base.costmap.inflation import IncrementalInflation, Inflation
from move_base.parameters.parameters import Layer


@st.composite
def series(draw):
    """An inflation and the costs of one grid at some times: few or many cells change in between, or the size does."""
    shape = draw(st.tuples(st.integers(1, 60), st.integers(1, 60)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    weights = draw(st.sampled_from([(1.0, 0.0, 0.0), (0.99, 0.01, 0.0), (0.8, 0.1, 0.1), (0.1, 0.8, 0.1)]))
    costs = rng.choice(np.array([FREE, LETHAL, UNKNOWN], dtype=np.uint8), shape, p=weights)
    all_costs = [costs]
    for share in draw(st.lists(st.sampled_from([0.0, 0.001, 0.01, 0.5, 1.0]), max_size=5)):
        other = rng.choice(np.array([FREE, LETHAL, LETHAL, UNKNOWN, 100], dtype=np.uint8), shape)
        costs = np.where(rng.random(shape) < share, other, costs).astype(np.uint8)
        all_costs.append(costs)
    if draw(st.booleans()):
        all_costs.append(np.zeros((7, 9), dtype=np.uint8))
    radius = draw(st.sampled_from([0.0, 0.11, 0.3, 0.8]))
    layer = Layer("inflation", "inflation", inflation_radius=radius, inflate_unknown=draw(st.booleans()))
    resolution = draw(st.sampled_from([0.05, 0.2]))
    return Inflation(
        draw(st.sampled_from([layer, None])), resolution, 0.1, draw(st.sampled_from([0.1, 0.25]))
    ), all_costs


@given(series())
def test_changes_give_what_the_whole_grid_gives(inflation_and_costs):
    inflation, all_costs = inflation_and_costs
    incremental, results = IncrementalInflation(inflation), []
    for costs in all_costs:
        result, expected = incremental.update(costs), inflation.apply(costs)
        for given_back, array in zip(result, expected, strict=True):
            np.testing.assert_array_equal(given_back, array)
            assert given_back.dtype == array.dtype
        results.append((result, expected))
    for result, expected in results:  # what was given back stays as it was
        np.testing.assert_array_equal(result, expected)


@pytest.mark.parametrize("cell", [(0, 0), (0, 79), (40, 40), (79, 0)])
def test_one_obstacle_that_comes_and_goes_does_not_need_the_whole_grid(monkeypatch, cell):
    inflation = Inflation(Layer("inflation", "inflation"), 0.05, 0.2, 0.3)
    incremental = IncrementalInflation(inflation)
    free = np.zeros((80, 80), dtype=np.uint8)
    blocked = free.copy()
    blocked[cell] = LETHAL
    expected = [inflation.apply(costs)[0] for costs in (blocked, free, blocked)]
    incremental.update(free)
    monkeypatch.setattr(Inflation, "squares", None)
    for costs, inflated in zip((blocked, free, blocked), expected, strict=True):
        np.testing.assert_array_equal(incremental.update(costs)[0], inflated)
