"""Scenarios of D1, as seeds draw them."""

import pytest
from metacontrol_experiments.pyramid.scenarios import NO_ARM, TITLES, Light, Obstacle, Release, draw

SEEDS = range(1, 101)


@pytest.mark.parametrize("number", TITLES)
def test_seed_draws_the_same_again_and_another_one_something_else(number):
    assert draw(number, 3) == draw(number, 3)
    assert number == 0 or len({draw(number, seed) for seed in SEEDS}) > 90


def test_light_changes_between_what_the_two_settings_of_the_camera_need():
    directions = set()
    for seed in SEEDS:
        drawn = draw(1, seed)
        first, second = (strike.what.level for strike in drawn.strikes)
        is_bright = drawn.light > 0.45
        assert (first > 0.45, second > 0.45) == (not is_bright, is_bright)
        assert drawn.configurations.endswith("fd2_1" if is_bright else "fd2_2")
        assert drawn.configurations.startswith("fd1_right" if drawn.stopped_arm == "left" else "fd1_left")
        assert drawn.strikes[1].placed >= drawn.strikes[0].placed + 2
        directions.add((drawn.stopped_arm, is_bright))
    assert len(directions) == 4


def test_obstacle_stands_between_the_blocks_of_its_arm_and_the_pyramid():
    for seed in SEEDS:
        (strike,) = draw(2, seed).strikes
        assert 0.1 < (strike.what.y if strike.what.arm == "left" else -strike.what.y) < 0.2
        assert draw(2, seed).stopped_arm == NO_ARM


def test_both_come_in_both_orders_and_the_stopped_arm_is_released():
    orders = set()
    for seed in SEEDS:
        strikes = [strike.what for strike in draw(3, seed).strikes]
        (met,) = (what for what in strikes if isinstance(what, Obstacle))
        assert strikes[-1] == Release(met.arm)
        orders.add(isinstance(strikes[0], Light))
    assert orders == {True, False}


def test_no_design_is_left_without_arms():
    drawn = draw(4, 1)
    assert {strike.what.arm for strike in drawn.strikes} == {"left", "right"}
    assert not drawn.can_be_built


def test_strike_tells_when_it_comes():
    assert [str(strike) for strike in draw(3, 2).strikes[-1:]] == [
        f"release:{draw(3, 2).strikes[-1].what.arm}@placed:4,after:5"
    ]
