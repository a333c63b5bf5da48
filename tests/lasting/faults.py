"""Faults that the four parts of the meta-controller outlive: the same processes are to be measured for hours."""

from __future__ import annotations

from random import Random

from soak.plan import DRIVERS, NODE, PARTS, PELLET, PHASES, SPOILED, Fault, Kind

TARGETS: dict[Kind, tuple[str, ...]] = {
    Kind.KILL: (NODE, PELLET),
    Kind.FREEZE: (*PARTS, NODE, PELLET, *DRIVERS),
    Kind.KILL_IN_CHANGE: (NODE,),
    Kind.KILL_STARTING: (NODE,),
    Kind.USURP: (NODE,),
    Kind.DEAF_SUBSCRIBER: (*PARTS, NODE),
    Kind.HALF_OPEN: (*PARTS, NODE),
    Kind.DATA: (),
    Kind.CPU: (),
}
"""By kind: what is hit. Left out is what stays as it is for good: a killed driver, a changed parameter, a lock."""
_BRIEF = (Kind.KILL, Kind.KILL_IN_CHANGE, Kind.KILL_STARTING)
_WAYS = {Kind.KILL_IN_CHANGE: PHASES, Kind.DATA: SPOILED}


def fault(draw: Random) -> Fault:
    """Return the next fault."""
    kind = draw.choice(list(TARGETS))
    targets = TARGETS[kind]
    lasts = 0.0 if kind in _BRIEF else round(draw.uniform(2.0, 8.0), 1)
    how = draw.choice(_WAYS.get(kind, ("",)))
    return Fault(kind, 0.0, (draw.choice(targets),) if targets else (), how, lasts, round(draw.random(), 4))
