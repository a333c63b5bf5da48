"""The invariants, as pure functions: from a plan and what was observed to what is broken, one line each."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from statistics import median

from soak.observed import Observed, Pose, Sample, Told, Usage
from soak.plan import DRIVERS, NODE, PARTS, Fault, Kind, Mission

SPEEDS = {"v1": 0.3, "v2": 0.5, "v3": 0.75}
"""m/s, of variants.csv."""
SENSORS = {"k": "camera/depth/points", "b": "rear/scan", "": "front/scan"}
"""What a variant sees by, by the end of its name."""
DRIVER_OF = {"camera/depth/points": "camera", "rear/scan": "rear_laser", "front/scan": "front_laser"}

AGREES_S = 2.0
"""Wall s until what is told agrees with the processes."""
OLD_DATA_S, COMMAND_S, MARGIN_S = 1.0, 0.5, 0.4
"""ROS s: move_base takes older data as too old; the base stops without a command; a period of sensor and control."""
CONNECTS_S = 2.0
"""ROS s until the observer hears a sensor, or the base has no data, of a variant that was told just now."""
BUSY_S = 60.0
"""Wall s after which a function may change or recover no more while launcher, manipulator and master work: twice what
the launcher allows a node under a contested name."""
NAMED_S = 20.0
"""Wall s until a standing fault is named on /diagnostics."""
CHANGE_S = 10.0
"""Wall s in which a change is mostly over."""
MOVES, SPEED_MARGIN = 0.05, 1.15
"""m/s from which on the robot moves; how much faster than commanded ground truth may be: noise and slip."""
GROWTH_MB, GROWTH_DESCRIPTORS = 40.0, 40
"""By which a part may grow from the second to the last quarter of its life: caches fill, bags of rospy's queues do."""
SETTLED_S = 10.0
"""Wall s of a process's life in which it still grows: it reads models, connects, and offers its services."""
LIFE_S = 25.0
"""Shorter lives say nothing of growth."""

_STOPS = (Kind.KILL, Kind.FREEZE_FOR_GOOD, Kind.INTERRUPT, Kind.KILL_TWO)
"""After these a process does its work no more, unless somebody starts it again."""
_ENDS = (*_STOPS, Kind.USURP, Kind.KILL_IN_CHANGE, Kind.KILL_STARTING)

STABLE, RECONFIGURING, RECOVERING, FAILED = "STABLE", "RECONFIGURING", "RECOVERING", "FAILED"
MANIPULATOR, LAUNCHER = "rosgraph_manipulator", "rosgraph_launcher"

Check = Callable[[Mission, Observed], Iterator[str]]


def broken(mission: Mission, observed: Observed) -> list[str]:
    """Return what is broken: `name of the invariant: what was seen`."""
    return [f"{name}: {what}" for name, check in CHECKS.items() for what in check(mission, observed)]


def nothing_left(mission: Mission, observed: Observed) -> Iterator[str]:
    """No process is left behind."""
    if observed.end and observed.end.left:
        yield f"{len(observed.end.left)} left, {'; '.join(observed.end.left)[:300]}"


def one_of_each(mission: Mission, observed: Observed) -> Iterator[str]:
    """No two processes of one role serve at the same time; a sample takes a moment, so two in a row count."""
    former: set[str] = set()
    for sample in observed.samples:
        roles = [one.role for one in sample.processes if one.serves and one.role]
        twice = {role for role in roles if roles.count(role) > 1}
        for role in sorted(twice & former):
            yield f"two {role} at {sample.t:.1f} s"
            return
        former = twice


def agrees(mission: Mission, observed: Observed) -> Iterator[str]:
    """What is told agrees with the processes within 2 s, while the manipulator works and nothing is under way."""
    since: float | None = None
    began = observed.event("MISSION_START")
    for sample in observed.samples:
        told = observed.told_at(sample.t)
        if began is None or sample.t < began.t or told is None or not _disagrees(told, sample):
            since = None
            continue
        since = since or sample.t
        limit = AGREES_S * observed.stretch(since, sample.t)
        if sample.t - since > limit:
            what = f"{NODE} {'runs' if sample.has(NODE) else 'does not run'}"
            yield f"{_words(told)}, but {what} for {sample.t - since:.1f} s"
            return


def _disagrees(told: Told, sample: Sample) -> bool:
    if not (sample.works(MANIPULATOR) and sample.works("master")) or not told.functions:
        return False
    states = {state for _, state in told.functions.values()}
    if states == {STABLE}:
        return not sample.has(NODE)
    return states == {FAILED} and sample.has(NODE) and not any(one for one, _ in told.functions.values())


def comes_to_an_end(mission: Mission, observed: Observed) -> Iterator[str]:
    """Nothing goes on changing or recovering while those work who do it."""
    since: float | None = None
    former: Told | None = None
    for sample in observed.samples:
        told = observed.told_at(sample.t)
        busy = told is not None and any(state in (RECONFIGURING, RECOVERING) for _, state in told.functions.values())
        if told is None or not busy or not all(sample.works(role) for role in (MANIPULATOR, LAUNCHER, "master")):
            since = None
            continue
        if former is None or former.functions != told.functions or since is None:
            since, former = sample.t, told
        if sample.t - since > BUSY_S * observed.stretch(since, sample.t):
            yield f"{_words(told)} for {sample.t - since:.0f} s"
            return


def _words(told: Told) -> str:
    return ", ".join(f"{name} {one} {state}" for name, (one, state) in told.functions.items())


def sees_where_it_goes(mission: Mission, observed: Observed) -> Iterator[str]:
    """The robot does not move for longer than the time-outs allow without current data of a sensor."""
    limit = OLD_DATA_S + COMMAND_S + MARGIN_S
    stamps: dict[str, float] = {}
    wanted: dict[str, float] = {}
    scans = iter(observed.scans)
    scan = next(scans, None)
    for pose in observed.poses:
        while scan is not None and scan.t <= pose.t:
            if scan.stamp <= pose.ros + MARGIN_S:  # not from the future
                stamps[scan.topic] = max(scan.stamp, stamps.get(scan.topic, 0.0))
            scan = next(scans, None)
        sensors = _sensors(observed, pose)
        wanted = {topic: wanted.get(topic, pose.ros + CONNECTS_S) for topic in sensors}
        newest = max((stamps.get(topic, wanted[topic]) for topic in sensors), default=math.inf)
        age = pose.ros - newest
        if pose.speed > MOVES and age > limit + 0.3 * (observed.stretch(pose.t, pose.t) - 1.0):
            yield f"{pose.speed:.2f} m/s at {pose.ros:.2f} s, data {age:.2f} s old"
            return


def keeps_the_speed(mission: Mission, observed: Observed) -> Iterator[str]:
    """The robot is not faster than the variants allow that are, or just were, deployed."""
    for pose in observed.poses:
        names = _variants(observed, pose)
        ahead = max((SPEEDS[name.split("_")[1]] for name in names if _is_variant(name)), default=None)
        if ahead is None:
            continue
        allowed = math.hypot(ahead, min(ahead, SPEEDS["v1"])) * SPEED_MARGIN
        if pose.speed > allowed:
            yield f"{pose.speed:.2f} m/s at {pose.ros:.2f} s, {' or '.join(sorted(names))} allow {allowed:.2f}"
            return


def stays_small(mission: Mission, observed: Observed) -> Iterator[str]:
    """Memory and descriptors of each process stay flat, until the mission has ended: figures are drawn then."""
    lives: dict[tuple[int, str], list[Usage]] = defaultdict(list)
    start, over = observed.event("MISSION_START"), observed.event("MISSION_END")
    for usage in observed.usages:
        if over is None or usage.t <= over.t:
            lives[usage.pid, usage.role].append(usage)
    for (_, role), life in lives.items():
        begin, end = life[0].t, life[-1].t
        settled = SETTLED_S * observed.stretch(begin, begin + SETTLED_S)
        begin = max(begin + settled, start.t if start else end)
        length = end - begin
        if length < LIFE_S or not role:
            continue
        early = [one for one in life if begin + 0.25 * length <= one.t <= begin + 0.5 * length]
        late = [one for one in life if one.t >= end - 0.25 * length]
        if not early or not late:
            continue
        memory = median(one.memory for one in late) - median(one.memory for one in early)
        descriptors = median(one.descriptors for one in late) - median(one.descriptors for one in early)
        if memory > GROWTH_MB:
            yield f"{role} grew by {memory:.0f} MB within {length:.0f} s"
        if descriptors > GROWTH_DESCRIPTORS:
            yield f"{role} opened {descriptors:.0f} descriptors more within {length:.0f} s"


def names_what_is_broken(mission: Mission, observed: Observed) -> Iterator[str]:
    """A driver that is dead or stopped for good, and a part that is stopped for good, is named on /diagnostics."""
    last = observed.samples[-1].t if observed.samples else 0.0
    for strike in observed.struck():
        fault = mission.faults[strike.index]
        if fault.kind not in _STOPS:
            continue
        stands = (*DRIVERS, *PARTS) if fault.kind is Kind.FREEZE_FOR_GOOD else DRIVERS  # a dead part is started again
        for role in fault.targets:
            until = strike.t + NAMED_S * observed.stretch(strike.t, strike.t + NAMED_S)
            if role not in stands or until > last:
                continue
            if role in DRIVERS and not _monitored(observed, strike.t, until):
                continue
            if not any(strike.t <= one.t <= until and role in one.text for one in observed.troubles):
                yield f"{role} ({fault.kind.value}) within {until - strike.t:.0f} s"


def ends_well(mission: Mission, observed: Observed) -> Iterator[str]:
    """The mission ends by itself; with success where it can, with a reason where not."""
    if observed.end is None or observed.end.status is None:
        yield "the command had to be ended"
        return
    end = observed.event("MISSION_END")
    excuse = excuse_of(mission, observed)
    if end is None:
        if not excuse:
            yield f"status {observed.end.status} without an end of the mission: {observed.end.said[-300:]}"
        elif observed.end.status not in (0, 1, 2):
            yield f"status {observed.end.status} after {excuse}: {observed.end.said[-300:]}"
        return
    if end.values.get("outcome") == "reached":
        return
    reason = end.values.get("reason", "")
    if not reason:
        yield "no reason is told"
    for strike in observed.struck():
        fault = mission.faults[strike.index]
        if strike.t < end.t and not any(word in reason for word in _REASONS.get(fault.kind, ("",))):
            yield f"{reason} is told as the reason, after {fault}"
    if not excuse:
        yield f"{end.values.get('outcome')}, {reason}, though some variant can be deployed"


_REASONS = {
    Kind.KILL_MASTER: ("master",),
    Kind.REFUSING_MASTER: ("master",),
    Kind.KILL_SIMULATOR: ("simulator", "clock"),
}
"""Words of which one is in a true reason."""


def excuse_of(mission: Mission, observed: Observed) -> str:
    """Return why a mission may fail: what has struck leaves no variant, or nobody to say so; empty: nothing does."""
    struck = [(strike, mission.faults[strike.index]) for strike in observed.struck()]
    for _, fault in struck:
        if fault.kind.ends_mission:
            return str(fault)
    dead = {role for _, fault in struck for role in _lost_for_good(fault)}
    if dead.issuperset(DRIVER_OF.values()):
        return "no sensor is left"
    if "robot_state_publisher" in dead:
        return "the frames of the robot are gone"
    return _hangs_when_needed(mission, observed) or _somebody_elses_goal(mission, observed)


def _somebody_elses_goal(mission: Mission, observed: Observed) -> str:
    """Return which words of a stranger have taken the goal from the robot, as the end of the mission tells."""
    end = observed.event("MISSION_END")
    reason = end.values.get("reason", "") if end else ""
    if not any(word in reason for word in _TAKEN):
        return ""
    for strike in observed.struck():
        fault = mission.faults[strike.index]
        if fault.kind is Kind.DATA and any(name in strike.note for name in _AUTHORITIES):
            return f"{fault}: {strike.note}"
    return ""


def _hangs_when_needed(mission: Mission, observed: Observed) -> str:
    """Return which part was stopped for good before a change was needed, or was made for what had just been lost."""
    struck = [(strike.t, mission.faults[strike.index]) for strike in observed.struck()]
    for stopped, fault in struck:
        part = next((role for role in fault.targets if role in PARTS), "")
        if part and fault.kind is Kind.FREEZE_FOR_GOOD:
            later = [other for t, other in struck if t > stopped - CHANGE_S]
            lost = {role for other in later for role in _lost_for_good(other)} & set(DRIVER_OF.values())
            ended = {role for other in later if other.kind in _ENDS for role in other.targets}
            if lost or NODE in ended:
                return f"{fault}, with nobody in its place"
    return ""


_AUTHORITIES = ("/move_base/goal", "/move_base/cancel", "/move_base_simple/goal")
"""Whoever publishes there tells the robot what it shall do: wrong words are obeyed."""
_TAKEN = ("preempted", "cancelled")
"""Words of which one is in the reason where somebody has taken the goal back, or has given another one."""


def _lost_for_good(fault: Fault) -> tuple[str, ...]:
    """Return the drivers that a fault takes: nobody starts them again."""
    if fault.kind in (*_STOPS, Kind.USURP):
        return tuple(role for role in fault.targets if role in DRIVERS)
    return ()


def _variants(observed: Observed, pose: Pose) -> set[str]:
    """Return the variants that were deployed at a pose or 2 s before; during a change, the former one may still run."""
    names = set()
    for told in observed.told:
        if told.t > pose.t:
            break
        if told.ros < pose.ros - 2.0 and not any(state == RECONFIGURING for _, state in told.functions.values()):
            names.clear()
        names |= {one for one, _ in told.functions.values()}
    return names


def _sensors(observed: Observed, pose: Pose) -> set[str]:
    return {SENSORS[_end(name)] for name in _variants(observed, pose) if _is_variant(name)}


def _is_variant(name: str) -> bool:
    words = name.split("_")
    return len(words) >= 3 and words[1] in SPEEDS


def _end(name: str) -> str:
    words = name.split("_")
    return words[3] if len(words) > 3 else ""


def _monitored(observed: Observed, begin: float, end: float) -> bool:
    """Tell whether the monitor worked for most of a time: another fault may have hit it."""
    within = [sample.works("rosgraph_monitor") for sample in observed.samples if begin <= sample.t <= end]
    return bool(within) and sum(within) > 0.6 * len(within)


CHECKS: Mapping[str, Check] = {
    "no process is left behind": nothing_left,
    "no two of one role": one_of_each,
    "what is told agrees with the processes": agrees,
    "what is under way comes to an end": comes_to_an_end,
    "the robot sees where it goes": sees_where_it_goes,
    "the robot keeps the speed of its variant": keeps_the_speed,
    "memory and descriptors stay flat": stays_small,
    "a standing fault is named": names_what_is_broken,
    "the mission ends, with success where it can": ends_well,
}
