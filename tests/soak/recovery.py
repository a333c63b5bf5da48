"""When a mission is well again after a fault: a pure function of what was observed."""

from __future__ import annotations

from soak.checks import STABLE
from soak.observed import Observed, Sample, Told
from soak.plan import NODE, PARTS, Mission

HOLDS_S = 1.0
"""Wall s that all must be well: a process that dies again at once has not recovered."""


def recoveries(mission: Mission, observed: Observed) -> dict[int, float | None]:
    """Return, for each fault that has struck, how long it took until all was well, s of the wall clock.

    It counts from the strike; for a fault that is taken back, from then. All is well where the four parts and the
    deployed node run and the manipulator tells that all is STABLE. None: the mission ended before. A later fault that
    strikes meanwhile prolongs the recovery of the former one.
    """
    ends = observed.event("MISSION_END")
    last = ends.t if ends else (observed.samples[-1].t if observed.samples else 0.0)
    found: dict[int, float | None] = {}
    for strike in observed.struck():
        fault = mission.faults[strike.index]
        lasted = observed.lasted(strike.index)
        if lasted is None:
            continue
        begin = lasted[1] if fault.lasts else lasted[0]
        found[strike.index] = _well_after(observed, begin, last)
    return found


def _well_after(observed: Observed, begin: float, last: float) -> float | None:
    since: float | None = None
    for sample in observed.samples:
        if sample.t < begin:
            continue
        if sample.t > last:
            return None
        if not is_well(sample, observed.told_at(sample.t)):
            since = None
            continue
        since = since or sample.t
        if sample.t - since >= HOLDS_S:
            return since - begin
    return None


def is_well(sample: Sample, told: Told | None) -> bool:
    """Tell whether all parts work, and what is deployed is STABLE."""
    if told is None or not told.functions:
        return False
    stable = all(state == STABLE for _, state in told.functions.values())
    return stable and all(sample.works(role) for role in (*PARTS, NODE))
