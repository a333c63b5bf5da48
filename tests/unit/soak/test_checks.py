"""Each invariant holds on good observations, and is broken by bad ones."""

from dataclasses import replace

import pytest
from soak.checks import CHECKS, broken, excuse_of
from soak.observed import Beat, End, Event, Observed, Pose, Process, Sample, Scan, Strike, Told, Trouble, Usage
from soak.plan import PARTS, Fault, Kind, Mission

ROLES = (*PARTS, "move_base", "master", "front_laser")
ALL = tuple(Process(100 + place, role) for place, role in enumerate(ROLES))
TWIN = Process(200, "move_base")
STABLE = {"f_navigate": ("f2_v2_r2", "STABLE")}


def plan(*faults):
    return Mission(0, 1, "r1", "f2_v2_r2", "pellet", faults)


def calm(processes=ALL, told=STABLE, speed=0.4, outcome="reached", reason="goal reached", seconds=60):
    """A mission in which nothing happens."""
    times = [float(second) for second in range(seconds)]
    return Observed(
        samples=[Sample(t, tuple(processes)) for t in times],
        told=[Told(0.5, 0.5, told)],
        poses=[Pose(t, t, speed) for t in times],
        scans=[Scan(t, "front/scan", t) for t in times],
        events=[
            Event(1.0, "MISSION_START", {}),
            Event(seconds - 1.0, "MISSION_END", {"outcome": outcome, "reason": reason}),
        ],
        usages=[Usage(t, process.pid, process.role, 70.0, 30) for t in times for process in ALL],
        beats=[Beat(t, 1.0) for t in times],
        end=End(seconds + 1.0, 0, "", ()),
    )


def names(observed, *faults):
    """The invariants that are broken."""
    return {what.partition(":")[0] for what in broken(plan(*faults), observed)}


def struck(observed, *faults, at=10.0):
    observed.strikes = [Strike(at, index, False, "") for index in range(len(faults))]
    return names(observed, *faults)


def test_calm_mission_breaks_nothing():
    assert names(calm()) == set()


def test_process_that_is_left_behind_is_told():
    observed = calm()
    observed.end = End(61.0, 0, "", ("123 python move_base",))
    assert names(observed) == {"no process is left behind"}


def test_two_of_one_role_are_told_and_a_warm_process_is_none():
    assert names(calm(processes=(*ALL, TWIN))) == {"no two of one role"}
    assert names(calm(processes=(*ALL, TWIN._replace(serves=False)))) == set()


def test_two_that_are_seen_in_one_sample_only_are_a_moment_of_reading():
    observed = calm()
    observed.samples[20] = Sample(20.0, (*ALL, TWIN))
    assert names(observed) == set()


WITHOUT = tuple(process for process in ALL if process.role != "move_base")


def gone(observed, begin, end, processes=WITHOUT):
    observed.samples = [Sample(one.t, processes if begin <= one.t < end else one.processes) for one in observed.samples]
    return observed


def test_node_that_does_not_run_while_stable_is_told_is_told():
    assert names(gone(calm(), 20, 24)) == {"what is told agrees with the processes"}
    assert names(gone(calm(), 20, 22)) == set()


def test_what_is_under_way_may_disagree():
    observed = gone(calm(), 20, 30)
    observed.told += [Told(20.0, 20.0, {"f_navigate": ("f2_v2_r2", "RECOVERING")}), Told(30.0, 30.0, STABLE)]
    assert names(observed) == set()


def test_dead_manipulator_tells_nothing():
    rest = tuple(process for process in WITHOUT if process.role != "rosgraph_manipulator")
    assert names(gone(calm(), 20, 30, rest)) == set()


def test_busy_machine_extends_deadlines():
    observed = gone(calm(), 20, 24)
    observed.beats = [Beat(beat.t, 3.0) for beat in observed.beats]
    assert names(observed) == set()


def test_node_that_runs_for_a_released_function_is_told():
    assert names(calm(told={"f_navigate": ("", "FAILED")})) == {"what is told agrees with the processes"}


def test_robot_that_moves_without_data_is_told():
    observed = calm()
    observed.scans = [scan for scan in observed.scans if not 20.0 < scan.t < 30.0]
    assert names(observed) == {"the robot sees where it goes"}
    observed.poses = [pose._replace(speed=0.0 if 21.5 < pose.t < 30.0 else 0.4) for pose in observed.poses]
    assert names(observed) == set()


@pytest.mark.parametrize("stamp", [0.0, 1000.0])
def test_stamps_of_the_past_and_the_future_are_no_current_data(stamp):
    observed = calm()
    observed.scans = [scan if scan.t <= 20.0 else scan._replace(stamp=stamp) for scan in observed.scans]
    assert names(observed) == {"the robot sees where it goes"}


def test_former_variant_may_run_while_the_change_lasts():
    observed = calm(told={"f_navigate": ("f2_v3_r2", "STABLE")}, speed=0.7)
    observed.told.append(Told(30.0, 30.0, {"f_navigate": ("f2_v1_r2", "RECONFIGURING")}))
    observed.told.append(Told(40.0, 40.0, {"f_navigate": ("f2_v1_r2", "STABLE")}))
    observed.poses = [pose._replace(speed=0.7 if pose.t < 41.0 else 0.2) for pose in observed.poses]
    assert names(observed) == set()
    observed.poses = [pose._replace(speed=0.7 if pose.t < 45.0 else 0.2) for pose in observed.poses]
    assert names(observed) == {"the robot keeps the speed of its variant"}


def test_robot_that_moves_by_a_sensor_that_never_said_anything_is_told():
    observed = calm(told={"f_navigate": ("f1_v2_r1_k", "STABLE")})
    assert names(observed) == {"the robot sees where it goes"}
    observed.poses = [pose._replace(speed=0.4 if pose.t < 4.0 else 0.0) for pose in observed.poses]
    assert names(observed) == set()


def test_change_that_never_ends_is_told_while_all_work_who_make_it():
    busy = {"f_navigate": ("f2_v2_r2", "RECOVERING")}
    assert names(calm(told=busy, seconds=90)) == {"what is under way comes to an end"}
    assert names(calm(told=busy, seconds=55)) == set()
    rest = tuple(process for process in ALL if process.role != "rosgraph_launcher")
    assert names(gone(calm(told=busy, seconds=90), 50, 52, rest)) == set()


def test_part_that_is_stopped_for_good_has_to_be_named_and_a_dead_one_is_started_again():
    hangs = Fault(Kind.FREEZE_FOR_GOOD, 10.0, ("reasoner",))
    assert struck(calm(), hangs) == {"a standing fault is named"}
    observed = calm()
    observed.troubles = [Trouble(12.0, "/reasoner: hangs")]
    assert struck(observed, hangs) == set()
    assert struck(calm(), replace(hangs, kind=Kind.KILL)) == set()


def test_sensor_is_that_of_the_variant():
    observed = calm(told={"f_navigate": ("f1_v2_r1_b", "STABLE")})
    observed.scans = [scan._replace(topic="rear/scan" if scan.t < 20.0 else "front/scan") for scan in observed.scans]
    assert names(observed) == {"the robot sees where it goes"}


def test_robot_that_is_too_fast_is_told():
    assert names(calm(speed=0.9)) == {"the robot keeps the speed of its variant"}
    assert names(calm(speed=0.9, told={"f_navigate": ("f2_v3_r2", "STABLE")})) == set()


def test_robot_has_time_to_slow_down_after_a_change():
    observed = calm(told={"f_navigate": ("f2_v3_r2", "STABLE")}, speed=0.7)
    observed.told.append(Told(30.0, 30.0, {"f_navigate": ("f2_v1_r2", "STABLE")}))
    observed.poses = [pose._replace(speed=0.7 if pose.t < 32.0 else 0.2) for pose in observed.poses]
    assert names(observed) == set()
    observed.poses = [pose._replace(speed=0.7 if pose.t < 40.0 else 0.2) for pose in observed.poses]
    assert names(observed) == {"the robot keeps the speed of its variant"}


@pytest.mark.parametrize("grown", [{"memory": 3.0}, {"descriptors": 2}])
def test_part_that_grows_is_told(grown):
    observed = calm()
    for name, slope in grown.items():
        observed.usages = [one._replace(**{name: getattr(one, name) + slope * one.t}) for one in observed.usages]
    assert names(observed) == {"memory and descriptors stay flat"}


def test_what_draws_figures_when_the_mission_is_over_is_flat():
    observed = calm()
    observed.events[-1] = observed.events[-1]._replace(t=40.0)
    observed.usages = [one._replace(memory=70.0 if one.t <= 40.0 else 120.0) for one in observed.usages]
    assert names(observed) == set()


def test_part_that_grows_at_its_start_only_is_flat():
    observed = calm()
    observed.usages = [one._replace(memory=20.0 if one.t < 10.0 else 70.0) for one in observed.usages]
    assert names(observed) == set()
    observed.usages = [one._replace(memory=20.0 if one.t < 30.0 else 70.0) for one in observed.usages]
    assert names(observed) == {"memory and descriptors stay flat"}
    observed.beats = [Beat(beat.t, 3.0) for beat in observed.beats]
    assert names(observed) == set()


KILLED = Fault(Kind.KILL, 10.0, ("rear_laser",))


def test_dead_driver_has_to_be_named():
    assert struck(calm(), KILLED) == {"a standing fault is named"}
    observed = calm()
    observed.troubles = [Trouble(10.1, "/rear_laser: Missing node ")]
    assert struck(observed, KILLED) == set()
    assert struck(calm(seconds=25), KILLED) == set()


def test_command_that_never_ends_is_told():
    observed = calm()
    observed.end = End(300.0, None, "", ())
    assert names(observed) == {"the mission ends, with success where it can"}


@pytest.mark.parametrize(("outcome", "reason"), [("aborted", "no path"), ("timeout", "")])
def test_failed_mission_is_told(outcome, reason):
    assert names(calm(outcome=outcome, reason=reason)) == {"the mission ends, with success where it can"}


def test_mission_may_fail_without_any_sensor_but_tells_why():
    faults = [Fault(Kind.KILL, 10.0, (role,)) for role in ("front_laser", "rear_laser", "camera")]
    named = [Trouble(10.1, role) for role in ("front_laser", "rear_laser", "camera")]
    observed = calm(outcome="aborted", reason="no sensor")
    observed.troubles = named
    assert struck(observed, *faults) == set()
    observed = calm(outcome="aborted", reason="")
    observed.troubles = named
    assert struck(observed, *faults) == {"the mission ends, with success where it can"}
    observed = calm(outcome="aborted", reason="no sensor")
    observed.troubles = named
    assert struck(observed, *faults[:2]) == {"the mission ends, with success where it can"}


def test_mission_whose_master_was_killed_need_not_tell_its_end():
    observed = calm()
    observed.events.pop()
    assert struck(observed, Fault(Kind.KILL_MASTER, 10.0)) == set()
    observed.end = End(61.0, -9, "killed", ())
    assert struck(observed, Fault(Kind.KILL_MASTER, 10.0)) == {"the mission ends, with success where it can"}
    observed.strikes = []
    assert names(observed) == {"the mission ends, with success where it can"}


def test_reason_has_to_be_true():
    fault = Fault(Kind.KILL_MASTER, 10.0)
    assert struck(calm(outcome="aborted", reason="roslaunch has ended: unknown configuration ''"), fault)
    assert not struck(calm(outcome="aborted", reason="roslaunch has ended: ROS master x is gone"), fault)


@pytest.mark.parametrize(
    ("topic", "reason", "is_excused"),
    [
        ("/move_base/cancel", "move_base: goal preempted: cancelled by the client", True),
        ("/move_base/goal", "move_base: goal aborted: no path", False),
        ("/tf", "move_base: goal preempted: cancelled by the client", False),
    ],
)
def test_a_goal_that_a_stranger_has_taken_is_no_failure_of_the_robot(topic, reason, is_excused):
    observed = calm(outcome="aborted", reason=reason)
    observed.strikes = [Strike(10.0, 0, False, f"{topic}, future")]
    assert bool(excuse_of(plan(Fault(Kind.DATA, 10.0, (), "future", 3.0)), observed)) == is_excused


def test_recorder_excuses_nothing():
    observed = calm()
    observed.strikes = [Strike(10.0, 0, False, "")]
    assert excuse_of(plan(Fault(Kind.KILL, 10.0, ("mission_recorder",))), observed) == ""


@pytest.mark.parametrize(
    ("target", "after", "is_excused"),
    [("front_laser", 5.0, True), ("move_base", 5.0, True), ("front_laser", -20.0, False)],
)
def test_nobody_changes_what_a_stopped_part_would_have_to_change(target, after, is_excused):
    observed = calm()
    hang = Fault(Kind.FREEZE_FOR_GOOD, 30.0, ("rosgraph_manipulator",))
    lost = Fault(Kind.KILL, 30.0 + after, (target,))
    observed.strikes = [Strike(30.0, 0, False, ""), Strike(30.0 + after, 1, False, "")]
    assert bool(excuse_of(plan(hang, lost), observed)) == is_excused
    observed.strikes = observed.strikes[:1]
    assert excuse_of(plan(hang, lost), observed) == ""


def test_a_rewritten_parameter_excuses_nothing():
    observed = calm()
    observed.strikes = [Strike(10.0, 0, False, "/move_base/oscillation_distance: 0.4 to x")]
    assert excuse_of(plan(Fault(Kind.PARAMETERS, 10.0, (), "huge")), observed) == ""


GROWING = [Usage(float(t), 300, "reasoner", 70.0 + 3.0 * t, 30) for t in range(60)]
BREAKS = {
    "no process is left behind": replace(calm(), end=End(61.0, 0, "", ("123 python move_base",))),
    "no two of one role": calm(processes=(*ALL, TWIN)),
    "what is told agrees with the processes": calm(processes=WITHOUT),
    "what is under way comes to an end": calm(told={"f_navigate": ("f2_v2_r2", "RECOVERING")}, seconds=90),
    "the robot sees where it goes": replace(calm(), scans=calm().scans[:20]),
    "the robot keeps the speed of its variant": calm(speed=0.9),
    "memory and descriptors stay flat": replace(calm(), usages=GROWING),
    "a standing fault is named": replace(calm(), strikes=[Strike(10.0, 0, False, "")]),
    "the mission ends, with success where it can": calm(outcome="aborted"),
}
"""What breaks each invariant, and no other one."""


@pytest.mark.parametrize("invariant", CHECKS)
def test_every_invariant_is_broken_by_an_observation(invariant):
    assert names(BREAKS[invariant], KILLED) == {invariant}
