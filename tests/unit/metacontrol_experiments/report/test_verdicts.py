"""Where ours loses, and what becomes of each kind of target."""

import pytest
from helpers.campaign_tables import missions, result
from metacontrol_experiments.report.published import Aim, Published, Target
from metacontrol_experiments.report.tables import analyse
from metacontrol_experiments.report.verdicts import PUBLISHED, contests, judge, losses

PAPER = Published("a paper", {"energy": {"total": {"mros": 0.02, "none": 0.05}}})


def judged(told, target, published=PAPER):
    analysis = analyse(missions(told))
    found = contests(analysis, published)
    published = Published(published.source, published.rows, targets=(target,))
    (verdict,) = judge(analysis, published, found)
    return verdict


def lost(told, published=PAPER):
    analysis = analyse(missions(told))
    return [
        (contest.row.measure.key, contest.row.name, contest.rival, contest.is_clear)
        for contest in losses(contests(analysis, published))
    ]


def energies(**of):
    return [result(name, n, energy=level) for name, levels in of.items() for n, level in enumerate(levels, start=1)]


def test_ours_loses_to_whom_it_is_behind_in_any_row():
    found = lost(energies(none=[0.05, 0.06], mros=[0.03, 0.03], rules=[0.01, 0.01]))
    # rows: power 1 and total; the paper has the total only
    assert sorted(found) == [
        ("energy", "power 1", "rules", False),
        ("energy", "total", "published", True),
        ("energy", "total", "rules", False),
    ]


def test_equal_figures_are_no_loss_and_no_win():
    told = energies(none=[0.01, 0.02], mros=[0.02, 0.01])
    assert lost(told) == []
    verdict = judged(told, Target(Aim.BETTER, managers=("none",)))
    assert verdict.reached is False
    assert {(missed.row.measure.key, missed.wins, missed.loses) for missed in verdict.missed_in} == {
        ("safety", False, False),
        ("energy", False, False),
        ("success", False, False),
    }


def test_loss_over_pairs_is_told_though_the_table_looks_better():
    told = energies(mros=[0.03, 0.0, 0.0], rules=[0.02])  # 0.01 on average, but 0.03 in the same world
    assert ("energy", "total", "rules", False) in lost(told, Published("a paper"))


def test_clear_losses_come_first():
    told = energies(mros=[0.05] * 12, rules=[0.01] * 12, zeal=[0.05] * 11 + [0.04])
    assert [entry[2:] for entry in lost(told, Published("a paper"))][::3] == [("rules", True), ("zeal", False)]


def test_published_figure_is_clearly_better_outside_our_interval():
    analysis = analyse(missions(energies(mros=[0.0, 0.1])))
    (contest,) = [found for found in contests(analysis, PAPER) if found.rival == PUBLISHED]
    assert contest.loses and not contest.is_clear


@pytest.mark.parametrize(
    ("target", "reached", "value"),
    [
        (Target(Aim.AT_MOST, 0.02, "energy", "total"), True, 0.02),
        (Target(Aim.AT_MOST, 0.019, "energy", "total"), False, 0.02),
        (Target(Aim.AT_LEAST, 0.5, "success", "total"), True, 0.5),
        (Target(Aim.AT_LEAST, 0.51, "success", "total"), False, 0.5),
        (Target(Aim.BASELINE_OVER, 2.0, "energy", "total"), True, 0.5),
        (Target(Aim.BASELINE_OVER, 2.1, "energy", "total"), False, 0.5),
        (Target(Aim.ABOVE_BASELINE, 0.5, "success", "total"), True, 0.5),
        (Target(Aim.ABOVE_BASELINE, 0.6, "success", "total"), False, 0.5),
        (Target(Aim.EXTRA_TIME, 7.0), True, 7.0),
        (Target(Aim.EXTRA_TIME, 6.9), False, 7.0),
    ],
)
def test_targets_are_reached_at_their_bound(target, reached, value):
    told = [result("none", n, energy=0.04, success=False, duration=40.0) for n in (1, 2)]
    told += [result("mros", n, energy=0.02, success=n == 1, duration=44.0 + 2.0 * n) for n in (1, 2)]
    verdict = judged(told, target)
    assert (verdict.reached, verdict.figure.value) == (reached, pytest.approx(value))


def test_better_in_every_row_is_reached_by_those_who_win_all():
    told = [result("none", n, energy=0.04, safety=0.04, success=False) for n in (1, 2)]
    told += [result("mros", n) for n in (1, 2)]
    verdict = judged(told, Target(Aim.BETTER, managers=("none",)))
    assert (verdict.reached, verdict.contests, verdict.missed_in) == (True, 7, ())


@pytest.mark.parametrize(
    ("told", "target", "reason"),
    [
        ([result("none")], Target(Aim.AT_MOST, 0.1, "energy", "total"), "no mission of mros"),
        ([result("mros")], Target(Aim.AT_LEAST, 0.9, "success", "component failure"), "no such mission"),
        ([result("mros")], Target(Aim.BASELINE_OVER, 2.0, "energy", "total"), "no pair with the baseline"),
        ([result("mros", 1), result("none", 2)], Target(Aim.EXTRA_TIME, 7.5), "no pair with the baseline"),
        ([result("mros"), result("none")], Target(Aim.BASELINE_OVER, 2.0, "energy", "total"), "baseline's figure is 0"),
        ([result("mros")], Target(Aim.BETTER, managers=("none", "rules")), "no mission of none, rules"),
    ],
)
def test_target_that_cannot_be_told_says_why(told, target, reason):
    verdict = judged(told, target)
    assert verdict.reached is None and reason in verdict.reason


def test_one_absent_rival_keeps_the_last_target_open_unless_it_is_missed():
    target = Target(Aim.BETTER, managers=("none", "random"))
    win = [result("none", energy=0.1, safety=0.1, success=False), result("mros")]
    assert judged(win, target).reached is None
    assert judged([result("none"), result("mros", energy=0.1)], target).reached is False
