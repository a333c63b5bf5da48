"""R3: chooses the design to deploy for an objective, and says why it rejected each other one."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from metacontrol_bags.decision import Candidate

from mros1_reasoner.knowledge.model import Design, Objective, Quality
from mros1_reasoner.knowledge.scale import Correction

_AS_EXPECTED = Correction()
_AS_GOOD = 0.05  # designs are as far from the nearest limit if they differ by less, as a share of a limit

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
        unrealisable: designs that can't be deployed, each with the components that are missing, if any are.
        unsuited: why the surroundings do not fit designs that can't be deployed.
        unfulfilled: functions that a design requires and that no design can be deployed for, by the design's name.
        strained: the same for functions that are provided, but not as they should be.
        tried: why a design failed a short while ago, by its name.
        rejected: designs that an operator does not want for a while; of these, none is tried again sooner.
        current: name of the deployed design.
        desired: name of the design that is taken first, if it keeps every limit, or if no design does.
        observed: levels that were observed with the deployed design; they replace its expected levels.
        corrections: of the expected levels of a quality, for a group of designs.
        implausible: qualities of which levels of the deployed design are further from the expected ones than the
            greatest correction explains.
        worth: by how much better another design must keep a limit, or less violate limits, as a share of a limit; less
            is no difference.
        relief: distance by which another design is to keep the limit of a quality, if one does: the limit is violated,
            and another design must be better by `worth`.
        indifference: by how much less useful than the most useful one a design may be to count as being as useful.
    """

    qualities: Mapping[str, Quality] = field(default_factory=dict)
    unrealisable: Mapping[str, Collection[str]] = field(default_factory=dict)
    unsuited: Mapping[str, Collection[str]] = field(default_factory=dict)
    unfulfilled: Mapping[str, Collection[str]] = field(default_factory=dict)
    strained: Mapping[str, Collection[str]] = field(default_factory=dict)
    tried: Mapping[str, str] = field(default_factory=dict)
    rejected: Collection[str] = ()
    current: str | None = None
    desired: str = ""
    observed: Mapping[str, float] = field(default_factory=dict)
    corrections: Mapping[tuple[str, str], Correction] = field(default_factory=dict)
    implausible: Collection[str] = ()
    worth: float = 0.0
    relief: Mapping[str, float] = field(default_factory=dict)
    indifference: float = 0.0

    def correction(self, design: Design, quality: str) -> Correction | None:
        """Return how the level of a quality that is expected of a design is to be corrected."""
        return self.corrections.get((quality, design.group(quality)))

    def can_deploy(self, design: str) -> bool:
        """Return whether a design can be deployed, whatever its levels are."""
        return design not in self.unrealisable and not self.unfulfilled.get(design)


def plan(
    objective: Objective,
    designs: Collection[Design],
    situation: Situation,
    utility: Utility,
    distance: Distance,
) -> Plan:
    """Choose a design that can be deployed, has not failed recently and keeps every limit.

    Where a limit is violated, designs that keep it by the relief come before others that keep it barely. Then the
    highest utility wins; of equally useful designs, the smaller change wins. With an indifference, of the designs that
    are as useful within it, those count that keep the nearest limit best, then all limits; then components and utility
    decide. The desired design comes before all of these. When no design keeps every limit, the desired one is taken,
    else the least violating one; the deployed design stays unless another one is worth the change. When all have
    failed, they are tried again, but for those that an operator has rejected.
    """
    running = next((design for design in designs if design.name == situation.current), None)
    candidates = [_judge(objective, design, situation, utility) for design in designs]

    def change(judged: _Judged) -> float:
        size = distance(running, judged.design) if running else 0.0
        return math.inf if math.isnan(size) else size

    def by_use(judged: _Judged) -> tuple[float, float, bool, float, str]:
        size, is_spare = change(judged), bool(judged.design.rebinds)
        return -judged.utility, _whole(size), is_spare, size, judged.design.name

    def by_violation(judged: _Judged) -> tuple[float, float, float, bool, float, str]:
        return judged.violation, *by_use(judged)

    fit = sorted((c for c in candidates if not c.refused_because), key=lambda c: (not c.relieves, *by_use(c)))
    accepted = (c for c in candidates if c.design.name not in situation.rejected)
    deployable = [c for c in accepted if situation.can_deploy(c.design.name)]
    kept: list[_Judged] = []
    wanted = next((c for c in candidates if c.design.name == situation.desired), None)
    fresh = [c for c in deployable if c.design.name not in situation.tried or c.design.name == situation.current]
    if wanted in fit:
        best = wanted
        reason = f"{best.design.name} is the desired configuration, and keeps every limit"
    elif fit:
        best, kept, reason = _most_useful(fit, len(candidates), situation, change)
        if wanted:
            reason += f"; {wanted.design.name}, the desired configuration, is not taken: {wanted.refused_because}"
    elif wanted in fresh and not situation.strained.get(situation.desired):
        best = wanted
        reason = f"degraded: no design keeps every limit; {best.design.name} is the desired configuration"
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
        return Plan(None, False, tuple(c.lost(c.refused_because) for c in ranked), _nothing(designs, situation))
    others = sorted((c for c in candidates if c is not best), key=lambda c: (bool(c.refused_because), *by_use(c)))
    degraded = not best.keeps_limits
    useful = fit[0].utility - situation.indifference if fit else math.inf
    lost = (c.lost(_loss(c, best, degraded, kept, useful, is_desired=best is wanted)) for c in others)
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
        designs: those that can be realised.
        utility: of a design.
    """
    ranked = sorted(designs, key=lambda design: (-utility(design), design.name))
    return {function: tuple(d.name for d in ranked if d.function == function) for function in functions}


def difference(first: Design, second: Design) -> float:
    """Return the size of the change from one design to another.

    Its whole part is the number of components that only one of them has, its fraction tells by how much the expected
    levels differ.
    """
    components = len(first.components ^ second.components)
    shared = sorted(set(first.expected) & set(second.expected))
    levels = math.dist([first.expected[q] for q in shared], [second.expected[q] for q in shared])
    return components + (levels / (1.0 + levels) if math.isfinite(levels) else 1.0)


@dataclass(frozen=True)
class _Judged:
    """A design with all that is needed to rank it.

    Attributes:
        design: the design.
        utility: how useful it is expected to be.
        violation: by how much its levels pass the objective's limits, as a sum of shares of the limits.
        refused_because: why it can't be taken; empty where it can.
        keeps_limits: whether it provides its function in full, and no level passes a limit.
        relieves: whether it keeps limits that are violated now by the relief.
        excesses: by how much its levels pass limits, as shares of the limits; negative where they keep them.
        levels: the levels that were compared with the limits.
    """

    design: Design
    utility: float
    violation: float
    refused_because: str
    keeps_limits: bool
    relieves: bool
    excesses: Sequence[float]
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
    corrections = {q: found for q in design.expected if (found := situation.correction(design, q)) is not None}
    expected = {q: corrections.get(q, _AS_EXPECTED).apply(level) for q, level in design.expected.items()}
    is_current = name == situation.current
    levels = {**expected, **situation.observed} if is_current else expected
    reasons, violation, relieves, excesses = [], 0.0, True, []
    for parts, words in (
        (situation.unrealisable, "which does not work"),
        (situation.unfulfilled, "which no design can provide now"),
        (situation.strained, "which no design provides as it should now"),
    ):
        if parts.get(name):
            reasons.append(f"requires {', '.join(sorted(parts[name]))}, {words}")
    reasons += situation.unsuited.get(name, ())
    if name in situation.unrealisable and not reasons:
        reasons.append("a rule of the model says that it can't be deployed")
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
            corrected = "" if is_current else _corrected(corrections.get(quality, _AS_EXPECTED))
            reasons.append(f"{quality} {level:.4g}{corrected} {kind.operator} {limit:g}")
        elif quality in situation.relief and quality in situation.observed and not is_current:
            gain = kind.excess(situation.observed[quality], limit) - kind.excess(level, limit)
            if gain < situation.worth * (abs(limit) or 1.0):
                reasons.append(
                    f"{quality} {level:.4g} is hardly better than the present {situation.observed[quality]:.4g}"
                )
        excesses.append(kind.excess(level, limit) / (abs(limit) or 1.0))
        relieves &= kind.excess(level, limit) <= -situation.relief.get(quality, -math.inf)
        # A lucky or unlucky moment of the deployed design must not weigh more than what is expected of the others.
        is_lasting = quality not in corrections or quality in situation.implausible
        lasting = level if is_lasting else kind.direction.better(level, expected.get(quality, level))
        violation += max(0.0, kind.excess(lasting, limit)) / (abs(limit) or 1.0)
    keeps_limits = len(reasons) == int(name in situation.tried)
    return _Judged(design, utility(design), violation, "; ".join(reasons), keeps_limits, relieves, excesses, levels)


def _most_useful(
    fit: Sequence[_Judged], count: int, situation: Situation, change: Callable[[_Judged], float]
) -> tuple[_Judged, list[_Judged], str]:
    """Return the best of the designs that keep every limit, those that keep them as well as it, and why it is the best.

    Args:
        fit: these designs: those that relieve first, then the most useful first.
        count: of all designs.
        situation: of the plan.
        change: how much changes from the deployed design to another.
    """
    fit = [c for c in fit if c.relieves == fit[0].relieves]
    useful = [c for c in fit if c.utility >= fit[0].utility - situation.indifference]
    best, kept = fit[0], list[_Judged]()
    if situation.indifference > 0.0:
        kept = _least_strained(useful, situation.worth)
        best = min(
            kept, key=lambda c: (_whole(change(c)), -c.utility, bool(c.design.rebinds), change(c), c.design.name)
        )
    has_highest = best is fit[0]
    reason = f"{best.design.name} {'has the highest utility' if has_highest else 'is as useful as any'} "
    reason += f"({best.utility:g}) of the {len(fit)} (out of {count}) designs that can be deployed and keep every limit"
    reason += " clearly" if situation.relief and best.relieves else ""
    if not has_highest:
        reason += f", and keeps them best of the {len(useful)} within {situation.indifference:g} of the highest utility"
    elif len(fit) > 1 and fit[1].utility == best.utility and situation.current:
        reason += f", and is a smaller change than {fit[1].design.name}, which is as useful"
    return best, kept, reason


def _least_strained(designs: Collection[_Judged], worth: float) -> list[_Judged]:
    """Return those that keep the nearest limit best, and of these those that keep all limits best."""

    def nearest(judged: _Judged) -> float:
        return max(judged.excesses, default=0.0)

    def total(judged: _Judged) -> float:
        found = sum(judged.excesses)
        return math.inf if math.isnan(found) else found  # levels beyond what floating-point numbers can tell

    least = min(map(nearest, designs))
    far = [judged for judged in designs if nearest(judged) <= least + _AS_GOOD]
    lowest = min(map(total, far))
    return [judged for judged in far if total(judged) <= lowest + worth]


def _whole(size: float) -> float:
    """Return the whole part of the size of a change, which may be infinite."""
    return math.floor(size) if math.isfinite(size) else size


def _corrected(correction: Correction) -> str:
    return "" if correction == _AS_EXPECTED else f" ({correction} what was expected)"


def _loss(
    candidate: _Judged,
    best: _Judged,
    degraded: bool,
    kept: Collection[_Judged],
    useful: float,
    *,
    is_desired: bool,
) -> str:
    """Return why a candidate was rejected.

    Args:
        candidate: it.
        best: the choice.
        degraded: whether the choice violates limits.
        kept: those that keep the limits as well as the choice; empty: nobody has compared that.
        useful: utility from which on a design counts as being as useful as any.
        is_desired: whether the choice is the desired configuration.
    """
    if candidate.refused_because:
        worse = f"; violates limits by {candidate.violation:.2g}, the choice by {best.violation:.2g}"
        tells = degraded and math.isfinite(candidate.violation) and candidate.violation > 0.0
        return candidate.refused_because + (worse if tells else "")
    if is_desired:
        return f"{best.design.name} is the desired configuration"
    if best.relieves and not candidate.relieves:
        return "it would keep the violated limit barely"
    keeps_worse = bool(kept) and candidate not in kept
    if keeps_worse and candidate.utility >= useful:
        return "as useful as the choice, but nearer to a limit"
    if candidate.utility < best.utility:
        return f"utility {candidate.utility:.4g} is less than {best.utility:.4g}"
    return "as useful as the choice, but a bigger change"


def _nothing(designs: Collection[Design], situation: Situation) -> str:
    names = [design.name for design in designs]  # other functions may lack something else
    missing = sorted({component for name in names for component in situation.unrealisable.get(name, ())})
    functions = sorted({function for name in names for function in situation.unfulfilled.get(name, ())})
    without = " or ".join(", ".join(lacking) for lacking in (missing, functions) if lacking)
    unsuited = sorted({words for name in names for words in situation.unsuited.get(name, ())})
    causes = [f"without {without}"] if without else []
    causes += [f"where {' and '.join(unsuited)}"] if unsuited else []
    rejected = sorted(name for name in names if name in situation.rejected)
    said = f"no design can be deployed {' or '.join(causes)}" if causes else ""
    said = said or ("no other design is left" if rejected else "no design is known")
    return f"{said}; the operator has rejected {' and '.join(rejected)}" if rejected else said
