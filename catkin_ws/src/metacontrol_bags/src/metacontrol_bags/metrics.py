"""Summarise a mission from its record alone.

Definitions
- Mission time runs from the event MISSION_START to MISSION_END; `stamp_s` is simulated seconds since MISSION_START.
- Shares and means of a QA are weighted by time: a sample holds until the next one. `time_above_threshold` and `mean_qa`
  are those of the ground truth, `observed_qa` those of what the observers reported, over the time they were not stale.
- `violations` of the ground truth: each from the first moment above the threshold to the relief, from which on the
  level kept the threshold for 5 s or to the end of the mission. `relief_s` is the time between the two, null where the
  mission ended above the threshold; `above_s` and `pieces` are the time above it and in how many pieces.
  `violation_places` are cells [i, j, seconds above the threshold]; a cell covers x from i to i + 1 times `cell_m`, in m
  in the map frame, and y from j to j + 1.
- `detect_s` of a component: from the perturbation that hit it to the stamp of the first diagnostic that reports it
  FALSE. Of a QA: from the moment when the ground truth rose above the threshold (the rise that the observers' first
  report falls into) to the first report above the threshold of that violation; null where the ground truth was below
  the threshold then.
- `decide_s`: from that diagnostic to the Decision DECIDED. `execute_s`: from DECIDED to EXECUTED.
- `control` is about the initial configuration until the first change: the rate that its controller was set to, and the
  share of its periods in which no velocity command came. A command that is late within its period does not count as
  missed. A controller that lags a whole period behind its schedule, at once or little by little, has missed one.
- `unrecorded` are the spans [from, to] in s since MISSION_START, longer than 0.5 s, in which the bag has no pose of the
  ground truth: way, shares and means are not of all of the mission then.
- `success` is the paper's: goal reached, mean safety risk < 0.4, risk below its threshold for more than 95 % of the
  time, energy below its threshold for more than 90 % of the time; and not longer than 250 s.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED
from metacontrol_bags.gaps import holes
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.record import FARTHEST_M, MissionRecord, Samples
from metacontrol_bags.series import held, mean, periods_missed, share_above, start_of_run
from metacontrol_bags.violations import CELL_M, describe
from metacontrol_bags.words import DiagnosticWords, FunctionGrounding, MissionEvent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from metacontrol_bags.decision import Decision

SCHEMA_VERSION = 1


TIMEOUT_S = 250.0
"""A run that lasts longer than this has failed (paper, section on D2)."""


class MetricsError(ValueError):
    """An event of a mission has impossible content; one line that names the event and the value."""


DEFAULT_THRESHOLDS = {"safety": 0.6, "energy": 0.62}
"""Thresholds of D2 (paper), where the bag does not tell any."""

MAX_MEAN_SAFETY = 0.4
MAX_SHARE = {"safety": 0.05, "energy": 0.10}
"""The paper's definition of success: limits of the mean risk and of the shares of time above the thresholds."""

_LARGEST = 1e200
"""No number of an event is so large: what is made of it stays finite."""

_SAME_MOMENT_S = 0.05
"""Stamps of different nodes may differ by a few periods of `/clock` (0.01 s) for what happened in the same moment."""

_CLOCK_LAG_S = 0.5
"""s by which the clock of a node may lag behind another on a loaded machine: effects may be stamped before causes."""


def summarise(record: MissionRecord) -> dict[str, Any]:
    """Return the content of summary.json; figures that the bag does not hold are None.

    Raises:
        MetricsError: an event of the mission says what cannot be.
    """
    start, end = record.start_stamp, record.end_stamp
    began, ended = record.event(MissionEvent.MISSION_START), record.event(MissionEvent.MISSION_END)
    told = began.values if began else {}
    closing = ended.values if ended else {}
    limits = thresholds(record)
    above = {name: share_above(record.true_quality.get(name, ()), limit, start, end) for name, limit in limits.items()}
    violated = {
        name: describe(record.true_quality.get(name, ()), record.poses, limit, start, end)
        for name, limit in limits.items()
    }
    means = {name: mean(record.true_quality.get(name, ()), start, end) for name in limits}
    goals = mission_goals(record)
    reached = bool(goals) and all(status is GoalStatus.SUCCEEDED for status in goals.values())
    duration = end - start
    return {
        "schema_version": SCHEMA_VERSION,
        "commit": told.get("commit", "unknown"),
        "engine": told.get("engine", "ros"),
        "mission": told.get("mission", "D2"),
        "route": told.get("route", "unknown"),
        "contingency": {
            "clutter": int(number(told, "clutter", 0)),
            "power": number(told, "power_factor", 1.0),
            "component": None if told.get("failure", "none") == "none" else told["failure"],
        },
        "metacontrol": told.get("metacontrol", "true" if record.decisions else "false") == "true",
        "seed": int(number(told, "seed", 0)),
        "goal_reached": reached,
        "success": not _unmet(reached, duration, means, above),
        "duration_s": rounded(duration),
        "path_length_m": rounded(path_length(record, start, end)),
        "collisions": _collisions(record.contacts, start, end),
        "initial_configuration": configuration_at(record, start) or told.get("initial_configuration"),
        "final_configuration": configuration_at(record, end) or told.get("initial_configuration"),
        "time_above_threshold": {name: rounded(value) for name, value in above.items()},
        "mean_qa": {name: rounded(value) for name, value in means.items()},
        "violations": {name: found for name, (found, _) in violated.items()},
        "violation_places": {"cell_m": CELL_M} | {name: cells for name, (_, cells) in violated.items()},
        "reconfigurations": reconfigurations(record, EXECUTED),
        "reconfigurations_failed": reconfigurations(record, FAILED),
        "perturbations": _perturbations(record),
        "goals": {
            "sent": len(goals),
            "failed": sum(status is not GoalStatus.SUCCEEDED for status in goals.values()),
        },
        "control": _control(record, told, start, end),
        "cost": _cost(record, start, end),
        "real_time_factor": _real_time_factor(duration, closing),
        "outcome": closing.get("outcome", "unknown"),
        "reason": closing.get("reason", "the bag holds no end of the mission"),
        "start_stamp_s": rounded(start),
        "unrecorded": [[rounded(since - start), rounded(until - start)] for since, until in holes(record)],
        "thresholds": limits,
        "observed_qa": {name: _observed(record, name, limit, start, end) for name, limit in limits.items()},
    }


def thresholds(record: MissionRecord) -> dict[str, float]:
    """Return the threshold of each QA: as MISSION_START has it (`nfr_<qa>`), else that of D2."""
    began = record.event(MissionEvent.MISSION_START)
    told = began.values if began else {}
    return {name: number(told, f"nfr_{name}", default) for name, default in DEFAULT_THRESHOLDS.items()}


def mission_goals(record: MissionRecord) -> dict[str, GoalStatus | None]:
    """Return the goals sent during the mission, by id, and how each ended; None if it did not end.

    A goal that the manipulator sends again keeps its id, so it does not count as another goal. A goal that was
    reached after a bad result counts as reached.
    """
    start, end = record.start_stamp - _SAME_MOMENT_S, record.end_stamp + _SAME_MOMENT_S
    goals: dict[str, GoalStatus | None] = {
        goal.id: None for goal in record.goals if goal.id and start <= goal.stamp <= end
    }
    for result in record.results:
        if result.id in goals and result.status is not None and result.stamp <= record.end_stamp + _CLOCK_LAG_S:
            goals[result.id] = GoalStatus.of(result.status)
    return goals


def configuration_at(record: MissionRecord, stamp: float) -> str | None:
    """Return the configuration in force at a moment: the last one reported; None before the first report."""
    reported = [report.configuration for report in record.configurations if report.stamp <= stamp + _SAME_MOMENT_S]
    return reported[-1] if reported else None


def path_length(record: MissionRecord, start: float, end: float) -> float:
    """Return the length of the way driven in m, from the ground truth."""
    stamps = record.poses[:, 0]
    way = record.poses[(stamps >= start) & (stamps <= end), 1:]
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def reconfigurations(record: MissionRecord, state: str) -> list[dict[str, Any]]:
    """Return the adaptations of the mission that ended in a state (EXECUTED or FAILED), in the order of time."""
    decided = {d.id: d for d in record.decisions if d.state == DECIDED and d.stamp >= record.start_stamp}
    closed = [d for d in record.decisions if d.state == state and d.id in decided and d.stamp <= record.end_stamp + 1.0]
    return [_reconfiguration(record, decided[d.id], d) for d in closed]


def rounded(value: float | None) -> Any:
    """Return a figure as a summary has it; None where it is not known, or beyond all numbers."""
    return None if value is None or not math.isfinite(value) else round(float(value), 4)


def number(values: dict[str, str], key: str, default: float) -> float:
    """Return a number among an event's values.

    Raises:
        MetricsError: the value is no number, or none that a mission can have.
    """
    try:
        found = float(values.get(key, default))
    except ValueError as error:
        raise MetricsError(f"mission/event: {key} is {values[key]!r}, which is no number") from error
    if not abs(found) < _LARGEST:  # nor is NaN
        raise MetricsError(f"mission/event: {key} is {values[key]!r}; expected a finite number, below {_LARGEST:g}")
    return found


def _reconfiguration(record: MissionRecord, decided: Decision, closed: Decision) -> dict[str, Any]:
    caused, reported = _cause(record, decided)
    return {
        "stamp_s": rounded(decided.stamp - record.start_stamp),
        "trigger": decided.trigger,
        "from": decided.from_configuration,
        "to": decided.to_configuration,
        "detect_s": _span(caused, reported),
        "decide_s": _span(reported, decided.stamp),
        "execute_s": _span(decided.stamp, closed.stamp_executed or closed.stamp),
        "degraded": decided.degraded,
    }


def _cause(record: MissionRecord, decided: Decision) -> tuple[float | None, float | None]:
    """Return when the cause of an adaptation began, and when it was first reported; None if that is unknown."""
    kind, _, name = decided.trigger.partition(":")
    if kind == "component":
        return _component_cause(record, name, decided)
    if kind == "qa":
        return _quality_cause(record, name, decided)
    return None, decided.stamp_monitored or None


def _component_cause(record: MissionRecord, name: str, decided: Decision) -> tuple[float | None, float | None]:
    until = decided.stamp + _CLOCK_LAG_S
    strikes = [
        event.stamp
        for event in record.events
        if event.kind == MissionEvent.PERTURBATION and event.name == decided.trigger and event.stamp <= until
    ]
    struck = strikes[-1] if strikes else None
    reports = [r for r in record.components if r.component == name and r.stamp <= until]
    if struck is not None:
        after = (
            r.stamp for r in reports if r.status == DiagnosticWords.COMPONENT_FALSE and r.stamp >= struck - _CLOCK_LAG_S
        )
        return struck, next(after, None)
    return None, start_of_run([(r.stamp, r.status == DiagnosticWords.COMPONENT_FALSE) for r in reports])


def _quality_cause(record: MissionRecord, name: str, decided: Decision) -> tuple[float | None, float | None]:
    limit = thresholds(record).get(name)
    if limit is None:
        return None, decided.stamp_monitored or None
    reports = [r for r in record.observed if r.name == name and r.stamp <= decided.stamp]
    reported = start_of_run([(r.stamp, r.level is not None and r.level > limit) for r in reports])
    if reported is None:
        return None, decided.stamp_monitored or None
    truth = [(s, v > limit) for s, v in record.true_quality.get(name, ()) if s <= reported + _SAME_MOMENT_S]
    return start_of_run(truth), reported


def verdict(summary: Mapping[str, Any], between: str) -> str:
    """Return "yes" for a successful mission, else "no" and the conditions that it did not meet.

    Args:
        summary: see `summarise`.
        between: what stands between two of them.
    """
    if summary["success"]:
        return "yes"
    reached, duration = summary["goal_reached"], summary["duration_s"]
    return f"no: {between.join(_unmet(reached, duration, summary['mean_qa'], summary['time_above_threshold']))}"


def _unmet(
    reached: bool, duration: float | None, means: Mapping[str, float | None], above: Mapping[str, float | None]
) -> list[str]:
    found = [] if reached else ["goal not reached"]
    if duration is None or duration > TIMEOUT_S:
        found.append(f"longer than {TIMEOUT_S:g} s")
    safety = means["safety"]
    if safety is None or safety >= MAX_MEAN_SAFETY:
        found.append(f"mean safety {'not known' if safety is None else f'{safety:.2f}'}, not below {MAX_MEAN_SAFETY}")
    for name, limit in MAX_SHARE.items():
        share = above[name]
        if share is None or share >= limit:
            shown = "not known" if share is None else f"{share:.1%}"
            found.append(f"time above the {name} threshold {shown}, not below {limit:.0%}")
    return found


def _collisions(contacts: Samples, start: float, end: float) -> int | None:
    """Return the contact episodes during the mission, None where nothing was recorded."""
    if not contacts:
        return None
    before = [count for stamp, count in contacts if stamp <= start] or [contacts[0][1]]
    until = [count for stamp, count in contacts if stamp <= end] or before
    return int(until[-1] - before[-1])


def _perturbations(record: MissionRecord) -> list[dict[str, Any]]:
    found = []
    for event in record.events:
        if event.kind == MissionEvent.PERTURBATION:
            entry: dict[str, Any] = {"stamp_s": rounded(event.stamp - record.start_stamp), "name": event.name}
            if "share" in event.values:
                entry["share"] = number(event.values, "share", 0.0)
            if "pid" in event.values:
                entry["pid"] = int(number(event.values, "pid", 0))
            if "places" in event.values:
                entry["places"] = _places(event.values["places"])
            found.append(entry)
    return found


def _places(text: str) -> list[list[float]]:
    """Return the places x,y of clutter, m in the map frame.

    Raises:
        MetricsError: the text holds no places.
    """
    try:
        places = [[float(figure) for figure in place.split(",")] for place in text.split()]
    except ValueError:
        places = [[]]
    if not all(len(place) == 2 and max(map(abs, place)) < FARTHEST_M for place in places):
        raise MetricsError(f"mission/event: places is {text!r}; expected x,y in m, space between them")
    return places


def _observed(record: MissionRecord, name: str, limit: float, start: float, end: float) -> dict[str, float | None]:
    """Return what the observers saw of a QA: mean, share above the threshold, and the s for which it was stale."""
    reports = tuple(report for report in record.observed if report.name == name)
    levels = tuple((r.stamp, np.nan if r.level is None else r.level) for r in reports)
    values, durations = held(levels, start, end)
    stale = np.isnan(values)
    fresh = float(durations[~stale].sum())
    return {
        "mean": rounded(float((values[~stale] * durations[~stale]).sum()) / fresh) if fresh > 0 else None,
        "time_above_threshold": rounded(float(durations[values > limit].sum()) / fresh) if fresh > 0 else None,
        "stale_s": rounded(float(durations[stale].sum())),
    }


def _control(record: MissionRecord, told: dict[str, str], start: float, end: float) -> dict[str, float | None]:
    """Return the rate of the initial configuration's controller, and the share of its periods that it missed."""
    changes = [
        r.stamp for r in record.configurations if r.state != FunctionGrounding.STABLE and start <= r.stamp <= end
    ]
    until = min(changes, default=end)
    rate = number(told, "controller_hz", 0.0)
    stamps = [stamp for stamp in record.commands if start <= stamp <= until]
    missed = periods_missed(stamps, rate) if rate > 0.0 else None
    return {"rate_hz": rate or None, "periods_missed": rounded(missed)}


def _cost(record: MissionRecord, start: float, end: float) -> dict[str, dict[str, float | None]]:
    """Return CPU (mean, per cent of a core) and memory (largest, MB) of each node that reported them."""
    during = [report for report in record.costs if start <= report.stamp <= end]
    costs = {}
    for node in sorted({report.node for report in during}):
        cpu = [report.value for report in during if report.node == node and report.figure == "cpu"]
        memory = [report.value for report in during if report.node == node and report.figure == "memory"]
        costs[node] = {
            "cpu_percent_mean": rounded(sum(cpu) / len(cpu)) if cpu else None,
            "memory_mb_max": rounded(max(memory)) if memory else None,
        }
    return costs


def _real_time_factor(duration: float, closing: dict[str, str]) -> float | None:
    """Return simulated over wall duration of the mission."""
    wall = number(closing, "wall_duration_s", 0.0)
    return rounded(duration / wall) if wall > 0 else None


def _span(begin: float | None, end: float | None) -> float | None:
    """Return the seconds from one moment to another, not below 0."""
    return None if begin is None or end is None else rounded(max(0.0, end - begin))
