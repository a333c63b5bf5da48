"""R3, pure: which design to deploy for an objective, and why each other one was not taken."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace

from mros1_reasoner.model import Design, Direction, Objective

Utility = Callable[[Design], float]
Distance = Callable[[Design, Design], float]


@dataclass(frozen=True)
class Candidate:
    """A design that was considered.

    Attributes:
        design: what was considered.
        utility: how useful it is expected to be.
        violation: by how much its levels pass the objective's limits, as a sum of shares of the limits.
        chosen: whether it was taken.
        refused_because: why it can't be taken; empty for the chosen one and those that merely are less useful.
    """

    design: Design
    utility: float
    violation: float
    chosen: bool = False
    refused_because: str = ""


@dataclass(frozen=True)
class Plan:
    """What to deploy.

    Attributes:
        choice: name of the design, None when no design can be deployed.
        degraded: no design keeps every limit; the choice is the least violating one.
        candidates: all that were considered, best first.
        reason: why the choice was made, in words.
    """

    choice: str | None
    degraded: bool
    candidates: tuple[Candidate, ...]
    reason: str


@dataclass(frozen=True)
class Situation:
    """What planning has to heed beside the designs.

    Attributes:
        directions: direction of each quality attribute.
        unrealisable: components that are missing, by the name of the design that requires them.
        tried: why a design was tried in vain, by its name.
        current: name of the deployed design.
        observed: levels that were observed with it; they count in place of the expected ones.
    """

    directions: Mapping[str, Direction] = field(default_factory=dict)
    unrealisable: Mapping[str, Collection[str]] = field(default_factory=dict)
    tried: Mapping[str, str] = field(default_factory=dict)
    current: str | None = None
    observed: Mapping[str, float] = field(default_factory=dict)


def plan(
    objective: Objective,
    designs: Collection[Design],
    situation: Situation,
    utility: Utility,
    distance: Distance,
) -> Plan:
    """Choose a design that can be deployed, was not just tried in vain and keeps every limit.

    The highest utility wins, a tie goes to the smaller change. Where none keeps every limit, the least violating
    one is taken, the current one included; where all were tried in vain, they are tried again.
    """
    running = next((design for design in designs if design.name == situation.current), None)
    candidates = [_judge(objective, design, situation, utility) for design in designs]

    def change(candidate: Candidate) -> float:
        return distance(running, candidate.design) if running else 0.0

    def by_use(candidate: Candidate) -> tuple[float, float, str]:
        return -candidate.utility, change(candidate), candidate.design.name

    def by_violation(candidate: Candidate) -> tuple[float, float, float, str]:
        return candidate.violation, *by_use(candidate)

    fit = sorted((c for c in candidates if not c.refused_because), key=by_use)
    deployable = [c for c in candidates if not situation.unrealisable.get(c.design.name)]
    fresh = [c for c in deployable if c.design.name not in situation.tried or c.design.name == situation.current]
    if fit:
        degraded, best = False, fit[0]
        reason = f"{best.design.name} has the highest utility ({best.utility:g}) of the {len(fit)} (out of "
        reason += f"{len(candidates)}) designs that can be deployed and keep every limit"
        if len(fit) > 1 and fit[1].utility == best.utility and running:
            reason += f", and is a smaller change than {fit[1].design.name}, which is as useful"
    elif deployable:
        degraded, best = True, min(fresh or deployable, key=by_violation)
        verb = "stays: it" if best.design.name == situation.current else "is taken: it"
        reason = f"degraded: no design keeps every limit; {best.design.name} {verb} is the least violating"
        if not fresh:
            reason += ", and all were tried before"
    else:
        missing = sorted({c for components in situation.unrealisable.values() for c in components})
        reason = f"no design can be deployed without {', '.join(missing)}" if missing else "no design is known"
        return Plan(None, False, tuple(sorted(candidates, key=by_violation)), reason)
    chosen = replace(best, chosen=True, refused_because="")
    others = sorted((c for c in candidates if c is not best), key=lambda c: (bool(c.refused_because), *by_use(c)))
    return Plan(best.design.name, degraded, (chosen, *others), reason)


def utility_of(quality: str, direction: Direction = Direction.HIGHER_IS_BETTER) -> Utility:
    """Return the utility function that is the expected level of one quality attribute; 0 where none is expected."""

    def utility(design: Design) -> float:
        return -direction.sign * design.expected.get(quality, 0.0)

    return utility


def difference(first: Design, second: Design) -> float:
    """Return how big a change it is from one design to the other: components first, then expected levels."""
    components = len(first.components ^ second.components)
    shared = sorted(set(first.expected) & set(second.expected))
    return components + math.dist([first.expected[q] for q in shared], [second.expected[q] for q in shared])


def _judge(objective: Objective, design: Design, situation: Situation, utility: Utility) -> Candidate:
    levels = dict(design.expected)
    is_current = design.name == situation.current
    if is_current:
        levels.update(situation.observed)
    reasons, violation = [], 0.0
    missing = situation.unrealisable.get(design.name)
    if missing:
        reasons.append(f"requires {', '.join(sorted(missing))}, which does not work")
    if design.name in situation.tried:
        reasons.append(situation.tried[design.name])
    for quality, limit in sorted(objective.limits.items()):
        direction = situation.directions.get(quality, Direction.LOWER_IS_BETTER)
        level = levels.get(quality)
        if level is None:
            reasons.append(f"no {quality} is expected of it")
            violation = math.inf
        elif (excess := direction.excess(level, limit)) > 0:
            reasons.append(f"{quality} {level:g} {direction.passes} {limit:g}")
            violation += excess / (abs(limit) or 1.0)
    return Candidate(design, utility(design), violation, refused_because="; ".join(reasons))
