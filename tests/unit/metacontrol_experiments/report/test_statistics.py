"""Intervals, tests and effect sizes against values worked out by hand or known from textbooks."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_experiments.report.statistics import (
    Estimate,
    holm,
    mcnemar,
    mean,
    rate,
    ratio,
    superiority,
    wilcoxon,
)

Z = 1.959963984540054
"""97.5 % quantile of the standard normal distribution."""


@pytest.mark.parametrize(("met", "count"), [(7, 10), (0, 10), (10, 10), (90, 100), (1, 1)])
def test_rate_has_wilsons_interval(met, count):
    p, n = met / count, count
    centre = (p + Z**2 / (2 * n)) / (1 + Z**2 / n)
    half = Z / (1 + Z**2 / n) * math.sqrt(p * (1 - p) / n + Z**2 / (4 * n**2))
    found = rate([True] * met + [False] * (count - met))
    assert (found.value, found.count) == (p, count)
    assert (found.low, found.high) == pytest.approx((centre - half, centre + half))


def test_mean_has_the_interval_of_all_resamples():
    values = (1.0, 2.0, 4.0)
    means = np.sort([sum(sample) / 3 for sample in product(values, repeat=3)])  # all 27, each as probable
    found = mean(values)
    assert found.value == pytest.approx(7 / 3) and found.count == 3
    assert (found.low, found.high) == pytest.approx((means[0], means[-1]))  # each end has 1/27, more than 2.5 %


def test_interval_of_many_values_is_that_of_the_normal_distribution():
    values = np.random.default_rng(4).exponential(2.0, 4000)
    half = Z * values.std() / math.sqrt(len(values))
    found = mean(list(values))
    assert found.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert found.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_same_values_have_the_same_interval_whatever_was_computed_before():
    first = mean([0.1, 0.5, 0.9, 0.2])
    mean([3.0, 1.0, 2.0])
    assert mean([0.1, 0.5, 0.9, 0.2]) == first


def test_single_value_has_no_interval_and_equal_ones_have_none_that_is_wide():
    assert mean([3.0]) == Estimate(3.0, None, None, 1)
    assert mean([3.0, 3.0]) == Estimate(3.0, 3.0, 3.0, 2)
    with pytest.raises(ValueError, match="no value"):
        mean([])


def test_ratio_is_of_sums_and_over_pairs():
    assert ratio([1.0, 2.0], [0.0, 0.0]) is None
    proportional = ratio([1.0, 2.0, 4.0], [2.0, 4.0, 8.0])  # each resample has the same ratio
    assert (proportional.value, proportional.low, proportional.high) == pytest.approx((0.5, 0.5, 0.5))
    assert ratio([1.0, 1.0, 1.0], [0.0, 0.0, 3.0]).high == math.inf  # a resample may have no whole at all


def test_mcnemar_is_the_sign_test_of_pairs_that_differ():
    first = [True] * 10 + [False] * 2 + [True] * 30
    second = [False] * 10 + [True] * 2 + [True] * 30
    found = mcnemar(first, second)
    assert found.p == pytest.approx(2 * (1 + 12 + 66) / 2**12)  # 0, 1 or 2 heads of 12, on both sides
    assert found.difference.value == pytest.approx(8 / 42)
    assert mcnemar([True, False], [True, False]).p == 1.0


def test_wilcoxon_ranks_differences():
    found = wilcoxon([1.0, 2.0, 3.0, 4.0, 5.0], [0.0] * 5)
    assert found.p == pytest.approx(2 / 2**5)  # all of one sign: 1 of 32 on each side
    assert found.difference.value == 3.0
    # ranks 1, 2, 3; the sum of positive ranks is 5 or 6, or as far on the other side: 1 + 1 of 8, twice
    assert wilcoxon([-1.0, 2.0, 3.0], [0.0] * 3).p == pytest.approx(4 / 8)
    assert wilcoxon([0.3, 0.5], [0.3, 0.5]).p == 1.0


def test_wilcoxon_counts_zero_differences_by_their_ranks():
    # Pratt: the others have the ranks 4 to 7. Of the 16 choices of signs, 6 have negative ranks of at most 4 + 5:
    # none, each single one, and these two; with ranks 1 to 4 it would be 5 of 16.
    assert wilcoxon([0.0, 0.0, 0.0, -1.0, -2.0, 3.0, 4.0], [0.0] * 7).p == pytest.approx(2 * 6 / 16)


@given(st.lists(st.integers(0, 4), min_size=1, max_size=8), st.lists(st.integers(0, 4), min_size=1, max_size=8))
def test_superiority_is_the_share_of_larger_values_with_ties_as_halves(first, second):
    shares = [1.0 if one > other else 0.5 if one == other else 0.0 for one in first for other in second]
    assert superiority(first, second) == pytest.approx(sum(shares) / len(shares))


def test_holm_steps_down():
    # sorted 0.005, 0.01, 0.03, 0.04 times 4, 3, 2, 1 are 0.02, 0.03, 0.06, 0.04; none may be below the one before
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0] and holm([]) == []


@given(st.lists(st.floats(0.0, 1.0), max_size=12))
def test_holm_rejects_what_its_definition_rejects(ps):
    rejected = set()
    for rank, index in enumerate(sorted(range(len(ps)), key=ps.__getitem__)):
        if ps[index] > 0.05 / (len(ps) - rank):
            break
        rejected.add(index)
    found = holm(ps)
    assert all(
        (p <= 0.05 or p == pytest.approx(0.05)) == (index in rejected) or p == pytest.approx(0.05)
        for index, p in enumerate(found)
    )
