"""Corrections are sound on any scale and in any direction."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mros1_reasoner.knowledge.model import Design, Direction, Objective, Quality
from mros1_reasoner.knowledge.scale import Correction, Scale
from mros1_reasoner.loop.levels import Expectation, Levels
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.planning.planner import Situation, difference, plan
from reasoner_helpers import OBJECTIVE

LOWER, HIGHER = Direction.LOWER_IS_BETTER, Direction.HIGHER_IS_BETTER


def test_positive_levels_are_on_a_ratio_scale_and_others_are_not():
    assert Scale.of(LOWER, [0.2, 0.4]).is_ratio
    assert not Scale.of(LOWER, [-45.0, -40.0]).is_ratio
    assert not Scale.of(LOWER, [0.0, 3.0]).is_ratio
    assert not Scale.of(LOWER, [20.0, 30.0], low=-40.0).is_ratio, "degrees, which may fall below zero"
    assert Scale.of(HIGHER, [-45.0, -40.0, -52.0]).span == 12.0


def test_noise_in_db_is_corrected_away_from_the_limit_that_it_passes():
    """A factor of 1.4 would make -56 dB of -40 dB, so that the louder tool would keep the limit of -45 dB."""
    designs = [Design("drill", "f", {"noise": -50.0}), Design("saw", "f", {"noise": -40.0})]
    designs.append(Design("file", "f", {"noise": -62.0}))
    scale = Scale.of(LOWER, [-50.0, -40.0, -62.0, -45.0])
    strain = scale.strain(-43.0, -50.0)
    assert str(strain) == "7 more than"
    situation = Situation(
        {"noise": Quality(LOWER)},
        current="drill",
        observed={"noise": -43.0},
        corrections={("noise", ""): scale.bounded(strain, 2.5)},
    )
    outcome = plan(Objective("o", "f", {"noise": -45.0}), designs, situation, lambda _: 0.0, difference)
    assert outcome.choice == "file"
    levels = {c.name: c.levels["noise"] for c in outcome.candidates}
    assert levels == pytest.approx({"drill": -43.0, "saw": -33.0, "file": -55.0})


@given(st.sampled_from([LOWER, HIGHER]), st.booleans(), st.floats(0.1, 100), st.floats(0.1, 100), st.floats(0.1, 100))
def test_correction_never_makes_a_level_look_better(direction, is_ratio, observed, expected, other):
    scale = Scale(direction, is_ratio, span=10.0)
    corrected = scale.bounded(scale.strain(observed, expected), 2.5).apply(other)
    assert direction.better(corrected, other) == other or corrected == pytest.approx(other)


@given(st.sampled_from([LOWER, HIGHER]), st.booleans(), st.floats(0.1, 100), st.floats(0.1, 100))
def test_strain_turns_the_expected_level_into_the_observed_one(direction, is_ratio, observed, expected):
    scale = Scale(direction, is_ratio, span=10.0)
    assert scale.strain(observed, expected).apply(expected) == pytest.approx(observed)


def test_correction_is_bounded():
    assert Scale(LOWER).bounded(Correction(factor=9.0), 2.5) == Correction(factor=2.5)
    assert Scale(HIGHER).bounded(Correction(factor=0.1), 2.5) == Correction(factor=0.4)
    assert Scale(LOWER, is_ratio=False, span=4.0).bounded(Correction(difference=90.0), 2.5).difference == 6.0
    assert Scale(HIGHER, is_ratio=False, span=4.0).bounded(Correction(difference=-90.0), 2.5).difference == -6.0


@pytest.mark.parametrize(
    ("scale", "before", "now", "expected"),
    [
        (Scale(LOWER), Correction(1.6), Correction(1.3), False),
        (Scale(LOWER), Correction(1.6), Correction(1.28), True),
        (Scale(HIGHER), Correction(0.5), Correction(0.59), False),
        (Scale(HIGHER), Correction(0.5), Correction(0.6), True),
        (Scale(LOWER, False, 10.0), Correction(difference=5.0), Correction(difference=3.5), False),
        (Scale(LOWER, False, 10.0), Correction(difference=5.0), Correction(difference=3.0), True),
        (Scale(HIGHER, False, 10.0), Correction(difference=-5.0), Correction(difference=-2.0), True),
    ],
)
def test_relief_is_a_share_of_what_was(scale, before, now, expected):
    assert scale.is_relieved(before, now, 0.2) is expected


def test_what_nobody_confirms_fades():
    assert Correction(factor=1.6).faded(0.5) == Correction(factor=pytest.approx(1.3))
    assert Correction(difference=-6.0).faded(1.0).difference == 0.0
    assert not Correction(factor=1.001).tells
    assert Correction(difference=0.5).tells


@pytest.mark.parametrize(("is_ratio", "expected", "can"), [(True, 0.5, True), (True, 0.0, False), (False, 0.0, True)])
def test_on_a_ratio_scale_nothing_is_compared_with_a_level_that_is_not_positive(is_ratio, expected, can):
    assert Scale(is_ratio=is_ratio).can_compare_with(expected) is can


def test_level_of_which_0_is_expected_is_corrected_by_the_difference():
    levels, against = Levels(), Expectation(Scale(is_ratio=False), limit=5.0, expected=0.0)
    for now in (1.0, 2.0, 3.0):
        levels.observe(now, ("o", "noise"), 3.0, against)
    assert levels.strain(3.0, ("o", "noise")) == Correction(difference=3.0)


def test_usual_level_of_0_tells_nothing_and_ends_nothing(knowledge_base, reasoner):
    designs = {
        name: replace(design, expected={**design.expected, "usual": 0.0})
        for name, design in knowledge_base.designs.items()
    }
    knowledge_base.designs = designs
    knowledge_base.qualities = {
        **knowledge_base.qualities,
        "usual": Quality(),
        "safety": replace(knowledge_base.qualities["safety"], typical="usual"),
    }
    core = Mape(knowledge_base, reasoner, [OBJECTIVE], Settings())
    core.observe_active(0.0, "f_move", "scan_slow", "STABLE")
    for now in range(12):
        core.observe_level(float(now), "safety", designs["scan_slow"].expected["safety"])
        assert core.step(float(now)) == []
