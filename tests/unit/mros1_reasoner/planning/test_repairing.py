"""Expected losses of a repair that comes first, and of a change that comes first."""

import math
import random

import pytest
from mros1_reasoner.planning.repairing import Odds, Stakes, loss_of_change, loss_of_repair, worth_of_nothing


def stakes(**changes):
    usual = {"repaired": 0.9, "other": 0.6, "nothing": 0.0, "change": 2.0, "outlook": 60.0, "returns": True}
    return Stakes(**{**usual, **changes})


def test_losses_of_a_repair_that_is_certain():
    assert loss_of_repair(stakes(), Odds(10.0, 1.0)) == pytest.approx(10 * 0.9)
    # 2 s without anything, 8 s with the other design, 2 s to return
    assert loss_of_change(stakes(), Odds(10.0, 1.0)) == pytest.approx(2 * 0.9 + 8 * 0.3 + 2 * 0.9)


def test_losses_of_a_repair_that_is_in_vain():
    assert loss_of_repair(stakes(), Odds(10.0, 0.0)) == pytest.approx(10 * 0.9 + 2 * 0.9 + 48 * 0.3)
    assert loss_of_change(stakes(), Odds(10.0, 0.0)) == pytest.approx(2 * 0.9 + 58 * 0.3)


def test_without_another_design_any_chance_of_success_counts():
    alone = stakes(other=None, returns=False)
    assert loss_of_change(alone, Odds(10.0, 0.1)) == pytest.approx(60 * 0.9)
    assert loss_of_repair(alone, Odds(10.0, 0.1)) < loss_of_change(alone, Odds(10.0, 0.1))
    assert loss_of_repair(alone, Odds(10.0, 0.0)) == loss_of_change(alone, Odds(10.0, 0.0))


def test_design_that_is_not_taken_again_is_missed_for_the_whole_time():
    assert loss_of_change(stakes(returns=False), Odds(1.0, 1.0)) == pytest.approx(2 * 0.9 + 58 * 0.3)


def test_losses_are_those_of_a_simulated_time_line():
    rng = random.Random(4)
    for _ in range(300):
        repaired = rng.uniform(0.2, 1.0)
        case = stakes(
            repaired=repaired,
            other=rng.choice((None, rng.uniform(0.0, repaired))),
            change=rng.uniform(0.0, 80.0),
            returns=rng.random() < 0.5,
        )
        odds = Odds(rng.uniform(0.0, 80.0), rng.choice((0.0, 1.0)))
        assert loss_of_repair(case, odds) == pytest.approx(_simulated(case, odds, repairs_first=True), abs=0.15)
        if case.other is None:
            continue
        assert loss_of_change(case, odds) == pytest.approx(_simulated(case, odds, repairs_first=False), abs=0.15)


def _simulated(case, odds, *, repairs_first, tick=0.05):
    """Return the loss of a time line whose repair succeeds or fails for certain, by steps of `tick` s."""
    loss, now = 0.0, 0.0
    runs = "repaired"
    changes_to = "other" if case.other is not None and not repairs_first else None
    change_left = case.change
    while now < case.outlook - tick / 2:
        works = now >= odds.duration and odds.success == 1.0
        if changes_to is None and case.other is not None:
            wants_other = not works and (not repairs_first or now >= odds.duration)
            if runs == "repaired" and wants_other:
                changes_to, change_left = "other", case.change
            elif runs == "other" and works and case.returns:
                changes_to, change_left = "repaired", case.change
        if changes_to is not None and change_left <= 0.0:
            runs, changes_to = changes_to, None
            continue
        value = case.nothing
        if changes_to is not None:
            change_left -= tick
        elif runs == "other":
            value = case.other
        elif works:
            value = case.repaired
        loss += tick * (case.best - value)
        now += tick
    return loss


def test_nothing_is_worth_less_than_any_design():
    assert worth_of_nothing([0.2, 0.9]) == 0.0
    assert worth_of_nothing([-10.0, -4.0]) == -16.0
    assert worth_of_nothing([0.0, 0.0]) == -1.0
    assert worth_of_nothing([-math.inf, 5.0]) == 0.0
    assert worth_of_nothing([]) == 0.0
