"""R3: chooses the design to deploy for an objective, and says why it rejected each other one."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

from metacontrol_bags.decision import Candidate

from mros1_reasoner.knowledge.model import Design, Objective, Quality

Utility = Callable[[Design], float]
Distance = Callable[[Design, Design], float]


@dataclass(frozen=True)
class Plan:
    """What to deploy.

    Attributes:
        choice: name of the design, None when no design can be deployed.
        degraded: no design keeps every limit; the choice is the least violating one.
        candidates: all that were considered, best first.
        reason: why the choice was made, in words.
        is_retry: all designs that keep every limit have failed recently; the choice is one of them.
    """

    choice: str | None
    degraded: bool
    candidates: tuple[Candidate, ...]
    reason: str
    is_retry: bool = False

    @property
    def is_makeshift(self) -> bool:
        """Return whether the choice is only better than nothing."""
        return self.degraded or self.is_retry


@dataclass(frozen=True)
class Situation:
    """All that a plan depends on, except the designs.

    Attributes:
        qualities: how the levels of each quality attribute compare.
        unrealisable: components that are missing, by the name of the design that requires them.
        unfulfilled: functions that a design requires and that no design can be deployed for, by the design's name.
        strained: the same for functions that are provided, but not as they should be.
        tried: why a design failed a short while ago, by its name.
        current: name of the deployed design.
        observed: levels that were observed with the deployed design; they replace its expected levels.
        factors: by how much the expected levels of a quality are to be multiplied, for a group of designs.
        worth: by how much less another design must violate limits, as a share of a limit, when none keeps them all.
    """

    qualities: Mapping[str, Quality] = field(default_factory=dict)
    unrealisable: Mapping[str, Collection[str]] = field(default_factory=dict)
    unfulfilled: Mapping[str, Collection[str]] = field(default_factory=dict)
    strained: Mapping[str, Collection[str]] = field(default_factory=dict)
    tried: Mapping[str, str] = field(default_factory=dict)
    current: str | None = None
    observed: Mapping[str, float] = field(default_factory=dict)
    factors: Mapping[tuple[str, str], float] = field(default_factory=dict)
    worth: float = 0.0

    def factor(self, design: Design, quality: str) -> float | None:
        """Return by how much the level of a quality that is expected of a design is to be multiplied."""
        return self.factors.get((quality, design.group(quality)))

    def can_deploy(self, design: str) -> bool:
        """Return whether a design can be deployed, whatever its levels are."""
        return not self.unrealisable.get(design) and not self.unfulfilled.get(design)


def plan(
    objective: Objective,
    designs: Collection[Design],
    situation: Situation,
    utility: Utility,
    distance: Distance,
) -> Plan:
    """Choose a design that can be deployed, has not failed recently and keeps every limit.

    The highest utility wins; of equally useful designs, the smaller change wins. When no design keeps every limit, the
    least violating one is taken; the deployed design stays unless another one is worth the change. When all have
    failed, they are tried again.
    """
    running = next((design for design in designs if design.name == situation.current), None)
    candidates = [_judge(objective, design, situation, utility) for design in designs]

    def change(judged: _Judged) -> float:
        return distance(running, judged.design) if running else 0.0

    def by_use(judged: _Judged) -> tuple[float, float, str]:
        return -judged.utility, change(judged), judged.design.name

    def by_violation(judged: _Judged) -> tuple[float, float, float, str]:
        return judged.violation, *by_use(judged)

    fit = sorted((c for c in candidates if not c.refused_because), key=by_use)
    deployable = [c for c in candidates if situation.can_deploy(c.design.name)]
    fresh = [c for c in deployable if c.design.name not in situation.tried or c.design.name == situation.current]
    if fit:
        best = fit[0]
        reason = f"{best.design.name} has the highest utility ({best.utility:g}) of the {len(fit)} (out of "
        reason += f"{len(candidates)}) designs that can be deployed and keep every limit"
        if len(fit) > 1 and fit[1].utility == best.utility and running:
            reason += f", and is a smaller change than {fit[1].design.name}, which is as useful"
    elif deployable:
        best = min(fresh or deployable, key=by_violation)
        now = next((c for c in fresh if c.design.name == situation.current), None)
        stays = now is not None and (best is now or now.violation - best.violation < situation.worth)
        if best.keeps_limits:
            does = "stays" if stays else "is tried again"
            reason = "all designs that keep every limit have failed recently; "
            reason += f"{best.design.name} {does}: it is the most useful of them"
        elif now and stays and best is not now:
            reason = f"degraded: no design keeps every limit; {now.design.name} stays: "
            reason += f"{best.design.name} would violate them hardly less"
            best = now
        else:
            reason = f"degraded: no design keeps every limit; {best.design.name} {'stays' if stays else 'is taken'}: "
            reason += f"it is the least violating{'' if fresh else ', and all were tried before'}"
    else:
        ranked = sorted(candidates, key=by_violation)
        return Plan(None, False, tuple(c.lost(c.refused_because) for c in ranked), _nothing(situation))
    others = sorted((c for c in candidates if c is not best), key=lambda c: (bool(c.refused_because), *by_use(c)))
    degraded = not best.keeps_limits
    lost = (c.lost(_loss(c, best, degraded)) for c in others)
    return Plan(best.design.name, degraded, (best.chosen(), *lost), reason, is_retry=not fit and not degraded)


def without_makeshift(found: Plan) -> Plan:
    """Return a plan that does nothing rather than take a design that is only better than nothing."""
    if not found.is_makeshift:
        return found
    first, *others = found.candidates
    why = first.refused_because or "only a makeshift"
    rejected = (replace(first, chosen=False, lost_because=why), *others)
    return Plan(None, False, rejected, f"nothing is done: {first.name} would be a makeshift ({why})")


def feasible_designs(
    functions: Iterable[str], designs: Collection[Design], utility: Utility
) -> dict[str, tuple[str, ...]]:
    """Return by function the names of the designs that fulfil it, the most useful first.

    Args:
        functions: the functions.
        designs: those that can be realised; without those whose required functions none of them fulfils.
        utility: of a design.
    """
    found: dict[str, tuple[str, ...]] = {}

    def fulfilling(function: str) -> tuple[str, ...]:
        if function not in found:
            fit = [d for d in designs if d.function == function and all(fulfilling(name) for name in d.requires)]
            found[function] = tuple(d.name for d in sorted(fit, key=lambda d: (-utility(d), d.name)))
        return found[function]

    for function in functions:
        fulfilling(function)
    return found


def difference(first: Design, second: Design) -> float:
    """Return the size of the change from one design to another: components first, then expected levels."""
    components = len(first.components ^ second.components)
    shared = sorted(set(first.expected) & set(second.expected))
    return components + math.dist([first.expected[q] for q in shared], [second.expected[q] for q in shared])


@dataclass(frozen=True)
class _Judged:
    """A design with all that is needed to rank it.

    Attributes:
        design: the design.
        utility: how useful it is expected to be.
        violation: by how much its levels pass the objective's limits, as a sum of shares of the limits.
        refused_because: why it can't be taken; empty where it can.
        keeps_limits: whether it provides its function in full, and no level passes a limit.
        levels: the levels that were compared with the limits.
    """

    design: Design
    utility: float
    violation: float
    refused_because: str
    keeps_limits: bool
    levels: Mapping[str, float]

    def chosen(self) -> Candidate:
        """Return the design as the chosen candidate."""
        return Candidate(self.design.name, self.design.expected, self.levels, self.utility, chosen=True)

    def lost(self, because: str) -> Candidate:
        """Return the design as a rejected candidate."""
        return Candidate(
            self.design.name,
            self.design.expected,
            self.levels,
            self.utility,
            refused_because=self.refused_because,
            lost_because=because,
        )


def _judge(objective: Objective, design: Design, situation: Situation, utility: Utility) -> _Judged:
    name = design.name
    factors = {q: found for q in design.expected if (found := situation.factor(design, q)) is not None}
    expected = {q: level * factors.get(q, 1.0) for q, level in design.expected.items()}
    is_current = name == situation.current
    levels = {**expected, **situation.observed} if is_current else expected
    reasons, violation = [], 0.0
    for parts, words in (
        (situation.unrealisable, "which does not work"),
        (situation.unfulfilled, "which no design can provide now"),
        (situation.strained, "which no design provides as it should now"),
    ):
        if parts.get(name):
            reasons.append(f"requires {', '.join(sorted(parts[name]))}, {words}")
    violation += len(situation.strained.get(name, ()))
    if name in situation.tried:
        reasons.append(situation.tried[name])
    for quality, limit in sorted(objective.limits.items()):
        kind = situation.qualities.get(quality, Quality())
        level = levels.get(quality)
        if level is None:
            reasons.append(f"no {quality} is expected of it")
            violation = math.inf
            continue
        if kind.violates(level, limit):
            factor = "" if is_current else _factor(factors.get(quality, 1.0))
            reasons.append(f"{quality} {level:.4g}{factor} {kind.operator} {limit:g}")
        # A lucky or unlucky moment of the deployed design must not weigh more than what is expected of the others.
        lasting = kind.direction.better(level, expected.get(quality, level)) if quality in factors else level
        violation += max(0.0, kind.excess(lasting, limit)) / (abs(limit) or 1.0)
    keeps_limits = len(reasons) == int(name in situation.tried)
    return _Judged(design, utility(design), violation, "; ".join(reasons), keeps_limits, levels)


def _factor(factor: float) -> str:
    return "" if factor == 1.0 else f" (expected, times {factor:.3g})"


def _loss(candidate: _Judged, best: _Judged, degraded: bool) -> str:
    """Return why a candidate was rejected."""
    if candidate.refused_because:
        worse = f"; violates limits by {candidate.violation:.2g}, the choice by {best.violation:.2g}"
        tells = degraded and math.isfinite(candidate.violation) and candidate.violation > 0.0
        return candidate.refused_because + (worse if tells else "")
    if candidate.utility < best.utility:
        return f"utility {candidate.utility:.4g} is less than {best.utility:.4g}"
    return "as useful as the choice, but a bigger change"


def _nothing(situation: Situation) -> str:
    missing = sorted({c for components in situation.unrealisable.values() for c in components})
    functions = sorted({f for names in situation.unfulfilled.values() for f in names})
    without = " or ".join(", ".join(names) for names in (missing, functions) if names)
    return f"no design can be deployed without {without}" if without else "no design is known"
