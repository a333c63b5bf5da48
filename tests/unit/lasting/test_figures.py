"""Whether a system that has lived for hours is as it was at the start."""

from random import Random

import pytest
from lasting.faults import TARGETS, fault
from lasting.figures import End, Goal, Reading, Recovery, Run, broken, changes, line, progress, read, report
from soak.plan import PARTS, Kind


def life(role, pid, memory, descriptors=lambda t: 20, threads=lambda t: 10, until=1000.0):
    return [
        Reading(float(t), pid, role, memory(t), descriptors(t), threads(t)) for t in range(0, 1001, 10) if t <= until
    ]


def run(*lives, **rest):
    return Run(readings=[reading for one in lives for reading in one], **rest)


def test_process_that_stays_as_it_was_is_flat():
    grown_once = life("reasoner", 1, lambda t: 50.0 if t < 100 else 70.0)
    assert broken(run(grown_once, end=End(1000.0, []))) == []
    assert changes(run(grown_once))[0].memory == (70.0, 70.0)


@pytest.mark.parametrize(
    ("grows", "said"),
    [
        ({"memory": lambda t: 60.0 + t / 50.0}, "reasoner grows: 63 to 79 MB"),
        ({"memory": lambda t: 60.0, "descriptors": lambda t: 20 + t // 20}, "27 to 67 descriptors"),
        ({"memory": lambda t: 60.0, "threads": lambda t: 10 + t // 20}, "17 to 57 threads"),
    ],
)
def test_growth_is_broken(grows, said):
    (found,) = broken(run(life("reasoner", 1, **grows)))
    assert said in found


def test_only_processes_that_lived_all_the_time_are_compared():
    young = [reading for reading in life("move_base", 2, lambda t: 200.0) if reading.t > 700.0]
    assert changes(run(life("move_base", 1, lambda t: 80.0, until=600.0), young)) == []


def test_fault_after_which_all_is_not_well_is_broken():
    recoveries = [Recovery(5.0, "KILL", "move_base", 1.5, 1.0), Recovery(60.0, "USURP", "move_base", None, 2.0)]
    assert broken(Run(recoveries=recoveries, end=End(90.0, ["left"]))) == [
        "left",
        "not well again after USURP (move_base)",
    ]


CANCEL = Recovery(60.0, "DATA", "nan: /move_base/cancel, nan", 0.0, 50.0)
STATUS = Recovery(60.0, "DATA", "flood: /move_base/status, flood", 0.0, 50.0)
POSE = Recovery(60.0, "DATA", "nan: /tf, nan", 0.0, 50.0)
KILL = Recovery(60.0, "KILL", "move_base: /move_base/cancelled", 1.0, 50.0)


@pytest.mark.parametrize(
    ("goal", "struck", "explained"),
    [
        (Goal(55.0, "succeeded", 40.0), KILL, True),
        (Goal(55.0, "preempted", 40.0), CANCEL, True),
        (Goal(55.0, "lost", 40.0), STATUS, True),
        (Goal(55.0, "aborted", 40.0), POSE, True),
        (Goal(49.0, "preempted", 40.0), CANCEL, False),
        (Goal(61.0, "preempted", 40.0), CANCEL, False),
        (Goal(55.0, "rejected", 40.0), CANCEL, False),
        (Goal(55.0, "lost", 40.0), CANCEL, False),
        (Goal(55.0, "preempted", 40.0), STATUS, False),
        (Goal(55.0, "late", 300.0), POSE, False),
        (Goal(55.0, "aborted", 40.0), KILL, False),
        (Goal(55.0, "preempted", 40.0), KILL, False),
        (Goal(55.0, "status-8", 40.0), STATUS, False),
    ],
)
def test_goal_that_ends_otherwise_than_what_struck_explains_is_broken(goal, struck, explained):
    expected = [f"a goal ended at {goal.t:.0f} s as {goal.outcome}, which nothing explains that struck then"]
    assert broken(Run(recoveries=[struck], goals=[goal], end=End(90.0, []))) == ([] if explained else expected)


def test_progress_is_that_of_all_runs():
    lives = [run(life("reasoner", 1, lambda t: 60.0), recoveries=[Recovery(5.0, "KILL", "", 1.5, 1.0)])] * 2
    lives.append(Run(recoveries=[Recovery(9.0, "USURP", "", None, 1.0)], end=End(1600.0, [])))
    assert progress(lives, 8.0) == "1.00 of 8 h, 3 faults, 1 after which not all was well again"


def test_report_has_what_was_written(tmp_path):
    path = tmp_path / "run-0.jsonl"
    lines = [line("reading", reading) for reading in life("reasoner", 1, lambda t: 60.0)]
    lines += [line("goal", Goal(50.0, "succeeded", 40.0)), line("goal", Goal(90.0, "succeeded", 38.0))]
    lines += [
        line("recovery", Recovery(10.0, "KILL", "", 2.0, 7.0)),
        line("stretch", (1.5,)),
        line("end", End(1000.0, [])),
    ]
    path.write_text("".join(lines) + '["reading", 10')
    told = report([read(path)], "abc", 7)
    assert "1 systems of seed 7 on code abc, 0.28 h, 1 faults\ngoals: succeeded 2\n" in told
    assert "| reasoner | 60 | 60 | 20 | 20 | 10 | 10 |" in told
    assert "| first quarter | 1 | 2.0 | 2.0 |" in told
    assert told.endswith("- nothing broken\n")


def test_faults_are_those_that_the_four_parts_outlive():
    drawn = [fault(Random(number)) for number in range(500)]
    assert {one.kind for one in drawn} == set(TARGETS)
    deadly = {Kind.KILL, Kind.USURP, Kind.KILL_IN_CHANGE, Kind.KILL_STARTING}
    assert not any(set(one.targets) & set(PARTS) for one in drawn if one.kind in deadly)
    assert all(one.lasts > 0.0 for one in drawn if one.kind not in deadly)
