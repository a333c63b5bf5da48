"""What can be said of any run with a meta-controller, whatever the robot and its mission.

Definitions
- The run lasts from the event MISSION_START to MISSION_END; from the first to the last message where there are none.
- `configurations`: for how many s each configuration of a function was deployed, from the first report on, and
  `changing_s`: the part of it in which it was not STABLE.
- `qualities`: the observed levels, weighted by time. A limit is known from MISSION_START (`nfr_<qa>`), or from the
  causes of decisions, which also tell on which side it is; the last one counts. A limit that was always kept is not
  known from these.
- `components`: failures as the monitor reports them. `recovered_s` is the time from a failure to the next report that
  the component works, null where none came.
"""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED
from metacontrol_bags.metrics import reconfigurations, rounded
from metacontrol_bags.series import held, mean_of
from metacontrol_bags.words import DiagnosticWords, FunctionGrounding, MissionEvent

if TYPE_CHECKING:
    from metacontrol_bags.record import MissionRecord

_LIMIT = "nfr_"


def describe_adaptation(record: MissionRecord) -> dict[str, Any]:
    """Return the figures of a run; what the bag does not tell is empty or None."""
    start, end = record.start_stamp, record.end_stamp
    ended = record.event(MissionEvent.MISSION_END)
    last = {decision.id: decision for decision in record.decisions}
    done = reconfigurations(record, EXECUTED)
    durations = [change["execute_s"] for change in done if change["execute_s"] is not None]
    return {
        "duration_s": round(end - start, 4),
        "outcome": (ended.values.get("reason") or ended.values.get("outcome")) if ended else None,
        "configurations": _configurations(record, start, end),
        "decisions": {
            "count": len(last),
            "by_state": dict(Counter(decision.state for decision in last.values())),
            "by_trigger": dict(Counter(decision.trigger for decision in last.values())),
            "degraded": sum(decision.degraded for decision in last.values()),
        },
        "reconfigurations": done,
        "reconfigurations_failed": reconfigurations(record, FAILED),
        "reconfiguration_s": {
            "mean": round(sum(durations) / len(durations), 4) if durations else None,
            "max": max(durations, default=None),
        },
        "qualities": _qualities(record, start, end),
        "components": _components(record, start),
    }


def limits(record: MissionRecord) -> dict[str, tuple[float, str]]:
    """Return the limit of each quality, as far as it is known, and whether a level violates it "above" or "below"."""
    began = record.event(MissionEvent.MISSION_START)
    found: dict[str, tuple[float, str]] = {}
    for key, text in (began.values if began else {}).items():
        if key.startswith(_LIMIT):
            try:
                found[key.removeprefix(_LIMIT)] = float(text), "above"
            except ValueError:
                continue
    causes = (cause for decision in record.decisions if decision.state == DECIDED for cause in decision.reasons)
    for cause in causes:
        if cause.quality and cause.excess > 0.0:
            found[cause.quality] = cause.limit, "below" if "<" in cause.text else "above"
    return {name: limit for name, limit in found.items() if math.isfinite(limit[0])}


def _configurations(record: MissionRecord, start: float, end: float) -> dict[str, dict[str, dict[str, float]]]:
    """Return by function and configuration for how long it was deployed, s. Each message tells of all functions."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    stamps = sorted({report.stamp for report in record.configurations})
    until = dict(pairwise([*stamps, end]))
    last = {(report.function, report.stamp): report for report in record.configurations}  # of one moment
    for report in last.values():
        duration = min(until[report.stamp], end) - max(report.stamp, start)
        if not report.configuration or duration <= 0.0:
            continue
        shares = found.setdefault(report.function, {})
        share = shares.setdefault(report.configuration, {"s": 0.0, "changing_s": 0.0})
        share["s"] = round(share["s"] + duration, 4)
        if report.state != FunctionGrounding.STABLE:
            share["changing_s"] = round(share["changing_s"] + duration, 4)
    return found


def _qualities(record: MissionRecord, start: float, end: float) -> dict[str, dict[str, Any]]:
    known = limits(record)
    found: dict[str, dict[str, Any]] = {}
    for name in sorted({report.name for report in record.observed}):
        samples = tuple((r.stamp, np.nan if r.level is None else r.level) for r in record.observed if r.name == name)
        levels, durations = held(samples, start, end)
        fresh = ~np.isnan(levels)
        limit, side = next((known[key] for key in (name, f"{name}_min", f"{name}_max") if key in known), (None, None))
        violated = None
        if limit is not None:
            beyond = levels > limit if side == "above" else levels < limit
            violated = round(float(durations[beyond & fresh].sum()), 4)
        found[name] = {
            "mean": rounded(mean_of(levels[fresh], durations[fresh])),
            "limit": limit,
            "violated": side,
            "violated_s": violated,
            "observed_s": round(float(durations[fresh].sum()), 4),
            "stale_s": round(float(durations[~fresh].sum()), 4),
        }
    return found


def _components(record: MissionRecord, start: float) -> dict[str, list[dict[str, float | None]]]:
    """Return the failures of each component that has failed."""
    found: dict[str, list[dict[str, float | None]]] = {}
    failed: dict[str, float] = {}
    for report in sorted(record.components, key=lambda report: report.stamp):
        name = report.component
        if report.status == DiagnosticWords.COMPONENT_FALSE:
            if name not in failed:
                failed[name] = report.stamp
                found.setdefault(name, []).append({"stamp_s": round(report.stamp - start, 4), "recovered_s": None})
        elif name in failed:
            found[name][-1]["recovered_s"] = round(report.stamp - failed.pop(name), 4)
    return found
