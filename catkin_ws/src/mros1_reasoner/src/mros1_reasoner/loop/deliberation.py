"""R3 for objectives that may require others: chooses the objective to change, and explains the decision."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

from metacontrol_bags.decision import ADVISED, DECIDED, FAILED, Cause, Decision

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Design, Objective
from mros1_reasoner.knowledge.scale import Correction
from mros1_reasoner.loop import lasting
from mros1_reasoner.loop.causes import chances, errors, heeds_chances, is_chance, is_drift, is_relief
from mros1_reasoner.loop.readable_state import Running
from mros1_reasoner.loop.state import AGAIN, UNEXPLAINED, UNLESS_GONE, VIOLATED, State
from mros1_reasoner.planning.planner import Distance, Plan, Situation, Utility, plan, without_makeshift
from mros1_reasoner.planning.repairing import Stakes, loss_of_change, loss_of_repair, worth_of_nothing

_NO_BOUND = 1e6  # the greatest correction where the model says which designs have the same strain


_Plans = dict[tuple[str, str], Plan]
"""What to deploy, by objective and function."""


@dataclass(frozen=True)
class Timing:
    """When and for how long the present step has analysed."""

    now: float
    analysed: float
    analyse_wall: float


class Deliberation:
    """Decides for one objective at a time, by what the state says."""

    def __init__(
        self,
        state: State,
        utility: Utility,
        distance: Distance,
        wall: Callable[[], float],
        stamp: Callable[[float], float],
        name: str,
    ) -> None:
        """Decide by what is known.

        Args:
            state: what is known; it keeps what is wanted, refused and known to fail.
            utility: of a design.
            distance: how big a change it is from one design to another.
            wall: wall clock that measures durations, s.
            stamp: ROS time, given that of the step.
            name: beginning of the decisions' ids.
        """
        self._state = state
        self._utility, self._distance = utility, distance
        self._wall, self._stamp, self._name = wall, stamp, name
        self._count = 0

    def decide(self, name: str, timing: Timing) -> Decision | None:
        """Return the decision for an objective: another design of its own or of one above it, or a refusal."""
        running = self._state.running[name]
        causes = self._causes(name, timing.now)
        if not causes:
            self._state.rest(name)
            return None
        lost = self._lost(name, causes, timing.now)
        if self._state.waits(name, timing.now) or (lost and all(map(self._state.repairs.is_under_way, lost))):
            return None
        self._state.use_chances(name)
        if all(is_drift(cause) for cause in causes) and not running.to_put_back:
            return self._leave(name, causes, timing)
        return self._deliberate(name, causes, lost, timing)

    def _deliberate(self, name: str, causes: list[Cause], lost: tuple[str, ...], timing: Timing) -> Decision | None:
        """Return the decision for an objective with causes for an adaptation, and components that can be repaired."""
        running = self._state.running[name]
        improves_only = all(is_chance(cause) for cause in causes)
        self._note_failure(name, timing.now)
        began = self._wall()
        level, outcome = self._choose(name, timing.now, climbs=not improves_only)
        if outcome.degraded and running.design and self._implausible(name, timing.now):
            self._state.note_in_vain(
                timing.now, running.design, name, UNEXPLAINED
            )  # others must not lead back to it soon
        stays = not self._is_change(level, outcome)
        if lost:
            repairs_first, outcome = self._compare_with_repair(level, outcome, lost, timing.now)
            if repairs_first:
                return self._repair(name, outcome, lost, causes, timing, began)
        is_enough = not improves_only or (not stays and self._improves(running, outcome))
        if not is_enough and (first := self._with_first_bindings(name, timing.now)):
            level, outcome, stays, is_enough = name, first, False, True
        if not is_enough:
            self._state.rest(name)
        if self._state.waits(level, timing.now) or not is_enough:
            return None
        if not stays:
            return self._adapt(name, level, outcome, causes, timing, began)
        return self._refuse(name, outcome, causes, timing, self._wall() - began)

    def repair_beside(self, timing: Timing) -> Decision | None:
        """Return the decision to repair something that what runs does not require; None where there is nothing."""
        if self._state.settings.dry_run:
            return None
        lacking = self._state.analysis.unrealisable
        for name in self._state.needed(self._state.deployments()):
            own = lacking.get(self._state.running[name].design or "", ())
            designs = self._state.kb.solving(self._state.objectives[name].function)
            blocked = ((design.name, c) for design in designs for c in lacking.get(design.name, ()) if c not in own)
            found = next(((d, c) for d, c in blocked if self._state.repairs.may_begin(c, timing.now)), None)
            if found and not self._state.waits(name, timing.now):
                return self._repair_for(name, *found, timing)
        return None

    def _repair_for(self, name: str, design: str, component: str, timing: Timing) -> Decision:
        """Return the decision to repair a component of a design that does not run."""
        known, running = self._state.components.get(component), self._state.running[name].design
        text = f"component {component}, which {design} requires, {known.failure if known else 'does not work'}"
        cause = Cause(known.stamp if known else timing.now, f"component:{component}", text)
        reason = f"{component} is repaired ({self._state.repairs.attempt(component)}) while {running or 'nothing'} runs"
        decision = self._decision(
            name, [cause], Plan(running, False, (), reason), timing, f"{name}: {text}: {reason}", 0.0
        )
        return replace(decision, state=DECIDED, to_configuration=running or "", repair=component)

    def _lost(self, name: str, causes: list[Cause], now: float) -> tuple[str, ...]:
        """Return the components whose loss is all that is wrong with what runs; none where one can't be repaired."""
        lost = self._state.analysis.unrealisable.get(self._state.running[name].design or "", ())
        wrong = {cause.trigger for cause in causes if not is_chance(cause)}
        repairs = self._state.repairs
        can_repair = all(repairs.is_under_way(c) or repairs.may_begin(c, now) for c in lost)
        return lost if can_repair and wrong == {f"component:{component}" for component in lost} else ()

    def _compare_with_repair(self, level: str, outcome: Plan, lost: tuple[str, ...], now: float) -> tuple[bool, Plan]:
        """Return whether to repair what is lost first, and the plan with the reason for that or against it.

        Args:
            level: the objective to find another design for.
            outcome: what could be done for it.
            lost: components whose loss is all that is wrong.
            now: present time.
        """
        designs = self._state.kb.designs
        running = designs[self._state.running[level].design or ""]
        is_other = self._is_change(level, outcome) and not outcome.is_makeshift and level not in self._state.locked
        other = self._utility(designs[outcome.choice or ""]) if is_other else None
        repaired = self._utility(running)
        stakes = Stakes(
            repaired=repaired,
            other=other,
            nothing=worth_of_nothing(map(self._utility, self._state.kb.solving(running.function))),
            change=self._state.change_duration,
            outlook=self._state.settings.outlook,
            returns=other is not None
            and heeds_chances(self._state, level)
            and repaired >= other + self._state.settings.improvement,
        )
        odds = self._state.repairs.odds(lost, now)
        repair, change = loss_of_repair(stakes, odds), loss_of_change(stakes, odds)
        names = " and ".join(lost)
        with_odds = f"{odds.duration:.3g} s, succeeds in {odds.success:.0%}"
        if repair < change:
            against = (
                f"against {change:.3g} of a change to {outcome.choice} ({stakes.change:.2g} s)" if is_other else ""
            )
            words = f"{names} is repaired first ({with_odds}): expected loss {repair:.3g} {against}".rstrip()
            words += "" if is_other else f", since {outcome.reason}"
            return True, replace(outcome, reason=words)
        words = f"{outcome.reason}; a repair of {names} first ({with_odds}) has an expected loss of {repair:.3g}"
        return False, replace(outcome, reason=f"{words}, a change of {change:.3g}")

    def _repair(
        self, name: str, outcome: Plan, lost: tuple[str, ...], causes: list[Cause], timing: Timing, began: float
    ) -> Decision | None:
        """Return the decision to repair the first component of those that are lost."""
        repairs, settings = self._state.repairs, self._state.settings
        component = next(c for c in lost if not repairs.is_under_way(c))
        running = self._state.running[name].design or ""
        gist = (*_gist(causes, outcome), component)
        if settings.dry_run and not self._state.is_news(name, gist):
            return None
        if not settings.dry_run:
            self._state.rest(name)
        rejected = (
            replace(c, chosen=False, lost_because=c.lost_because or "a repair is expected to lose less")
            for c in outcome.candidates
        )
        outcome = replace(outcome, candidates=tuple(rejected), degraded=False)
        words = f"{name}: {'; '.join(cause.text for cause in causes)}: {outcome.reason}; {repairs.attempt(component)}"
        decision = self._decision(name, causes, outcome, timing, words, self._wall() - began)
        state = ADVISED if settings.dry_run else DECIDED
        return replace(decision, state=state, to_configuration=running, repair=component)

    def _choose(self, name: str, now: float, *, climbs: bool) -> tuple[str, Plan]:
        """Return the objective to find another design for, and what to do for it.

        That is the given objective if one of its designs helps in full. Else it is the nearest objective above with a
        design that helps in full. Else it is the nearest objective with a design that helps in part.
        """
        outcomes: dict[str, Plan] = {}
        known: _Plans = {}
        queue = [name]
        while queue:
            objective = queue.pop(0)
            outcomes[objective] = outcome = self._plan(objective, now, known=known)
            if self._is_change(objective, outcome) and not outcome.is_makeshift:
                return objective, outcome
            if climbs:
                queue += [o for o in self._state.requirers(objective) if o not in outcomes and o not in queue]
        partly = (o for o, outcome in outcomes.items() if self._is_change(o, outcome))
        best = next(partly, name)
        return best, outcomes[best]

    def _is_change(self, name: str, outcome: Plan) -> bool:
        running = self._state.running[name]
        needs_work = running.is_broken or bool(running.failed_nodes or running.to_put_back)
        return outcome.choice is not None and (outcome.choice != running.design or needs_work)

    def _adapt(
        self, name: str, level: str, outcome: Plan, causes: list[Cause], timing: Timing, began: float
    ) -> Decision | None:
        """Return the decision for the first step towards an outcome: the deepest requirement comes first."""
        if level != name:
            climbed = {"component": "S6b"}
            causes = [replace(c, rules=f"{c.rules}, {climbed.get(c.trigger.split(':')[0], 'S6a')}") for c in causes]
        steps = self._missing(level, outcome, timing.now)
        objective, first = steps[0]
        designs = {o: plan.choice for o, plan in steps if plan.choice}
        releases = self._state.objectives.keys() - self._state.needed(
            {**self._state.deployments(), **self._state.wanted, **designs}
        )
        if self._state.locked & {name, *(o for o, _ in steps), *releases}:
            reason = f"locked by the operator; {outcome.choice} would be taken: {outcome.reason}"
            return self._refuse(name, replace(outcome, reason=reason), causes, timing, self._wall() - began)
        self._state.want(designs, name, causes)
        if any(self._state.waits(o, timing.now) for o, _ in steps if o in self._state.running):
            return None
        early = next((step for step in steps if self._state.retries_later(step[0], step[1].choice, timing.now)), None)
        if early:
            return self._postpone(name, *early, causes, timing, self._wall() - began)
        running = self._state.running.get(objective)
        if self._state.settings.dry_run and not self._state.is_news(name, _gist(causes, outcome)):
            return None
        design = running.design if running else None
        words = f"{name}: {'; '.join(cause.text for cause in causes)}: "
        if objective != name:
            words += f"{objective}: "
        words += f"{design or 'nothing'} -> {first.choice}"
        if running and running.failed_nodes and design == first.choice:
            words += f", with {', '.join(running.failed_nodes)} started anew"
        if running and running.to_put_back and design == first.choice:
            words += ", with its parameters put back"
        if objective != level:
            words += f", which {outcome.choice} of {level} requires: {first.reason}"
        words += f": {outcome.reason}"
        if running and running.brief and self._state.why_failed(objective, first.choice):
            words += f"; {lasting.words(running, self._state.why_failed(objective, first.choice))}"
        self._state.match_requirements()
        decision = self._decision(objective, causes, first, timing, words, self._wall() - began)
        if not self._state.settings.dry_run:
            self._state.note_blame(timing.now, name, causes, is_better=not self._is_rebinding(name, outcome))
        return replace(
            decision,
            state=ADVISED if self._state.settings.dry_run else DECIDED,
            to_configuration=first.choice or "",
            releases=tuple(sorted(releases & self._state.objectives.keys())) if objective == level else (),
        )

    def _refuse(
        self, name: str, outcome: Plan, causes: list[Cause], timing: Timing, plan_wall: float
    ) -> Decision | None:
        """Return the decision not to adapt; None if the last decision was the same."""
        running = self._state.running[name]
        if not self._state.refuse(name, _gist(causes, outcome)):
            return None
        text = "; ".join(cause.text for cause in causes)
        words = f"{name}: {text}: stays with {running.design or 'nothing'}: {outcome.reason}"
        return self._decision(name, causes, outcome, timing, words, plan_wall)

    def _postpone(
        self, name: str, objective: str, step: Plan, causes: list[Cause], timing: Timing, plan_wall: float
    ) -> Decision | None:
        """Return the decision to try a design again later that did not last; None if the last decision was the same."""
        running = self._state.running[objective]
        if not self._state.is_news(name, (*_gist(causes, step), running.brief)):
            return None
        why = lasting.words(running, self._state.why_failed(objective, step.choice))
        wait = f"{step.choice} is tried again in {running.retry_from - timing.now:.1f} s: {why}"
        words = f"{name}: {'; '.join(cause.text for cause in causes)}: {wait}"
        return self._decision(name, causes, step, timing, words, plan_wall)

    def _leave(self, name: str, causes: list[Cause], timing: Timing) -> Decision | None:
        """Return the decision to leave drifted parameters as they are; None if the last decision was the same."""
        why = "somebody sets them again and again, so they are left as they are: find out who does"
        outcome = Plan(self._state.running[name].design, False, (), why)
        if not self._state.is_news(name, _gist(causes, outcome)):
            return None
        words = f"{name}: {'; '.join(cause.text for cause in causes)}: {why}"
        return self._decision(name, causes, outcome, timing, words, 0.0)

    def _decision(
        self, objective: str, causes: list[Cause], outcome: Plan, timing: Timing, words: str, plan_wall: float
    ) -> Decision:
        """Return a refusal with everything that explains it."""
        self._count += 1
        running = self._state.running.get(objective)
        corrections = self._corrections(objective, timing.now)
        return Decision(
            id=f"{self._name}-{self._count}",
            state=FAILED,
            objective=objective,
            trigger=causes[0].trigger,
            causes=tuple(cause.text for cause in causes),
            from_configuration=(running.design if running else None) or "",
            to_configuration="",
            degraded=outcome.degraded,
            candidates=outcome.candidates,
            explanation="; ".join((words, *corrections)),
            stamp_monitored=causes[0].stamp,
            stamp_analysed=timing.analysed,
            stamp_planned=self._stamp(timing.now),
            analyse_wall_s=timing.analyse_wall,
            plan_wall_s=plan_wall,
            reasons=tuple(causes),
            corrections=corrections,
        )

    def _missing(self, name: str, outcome: Plan, now: float) -> list[tuple[str, Plan]]:
        """Return what to deploy for an outcome, the deepest requirement first and the objective itself last."""
        known: _Plans = {}
        below: dict[tuple[str, str], list[tuple[str, Plan]]] = {}  # by objective and function; many may require it

        def missing(objective: str, found: Plan) -> list[tuple[str, Plan]]:
            steps: dict[str, Plan] = {}
            for function in self._state.kb.designs[found.choice or ""].requires:
                provider = self._state.provider(function)
                if (provider, function) not in below:
                    below[provider, function] = required(provider, function)
                for step in below[provider, function]:
                    steps.setdefault(*step)
            return [*steps.items(), (objective, found)]

        def required(provider: str, function: str) -> list[tuple[str, Plan]]:
            if self._state.is_fine(provider):
                fine = Plan(self._state.running[provider].design, False, (), "")
                return missing(provider, fine)[:-1]
            found = self._plan(provider, now, function, known=known)
            return missing(provider, found) if found.choice else []

        return missing(name, outcome)

    def _note_failure(self, name: str, now: float) -> None:
        """Put the running design into the error log if it has failed."""
        running = self._state.running[name]
        if running.design and running.task_failure:
            reason = f"its task failed while it was deployed ({running.task_failure[1] or 'no reason given'})"
            self._state.note_in_vain(now, running.design, name, reason)
        elif running.design and self._keeps_not(name, now):
            self._state.note_in_vain(now, running.design, name, AGAIN if self._is_own_fault(name, now) else VIOLATED)
        found = v.IN_ERROR_COMPONENT if self._state.rule_finds(name, v.IN_ERROR_COMPONENT) else ""
        found = v.IN_ERROR_NFR if self._state.rule_counts(name, now) else found
        # A design that can't be deployed needs no entry, and may come back at once when it can.
        if running.design and found and running.design not in self._state.analysis.unrealisable:
            reason = f"{self._state.kb.rules_for(found)} found it in error"
            self._state.note_in_vain(now, running.design, name, reason)
        if running.is_broken and running.design:
            self._state.note_in_vain(now, running.design, name, running.ending or "did not run")
        restarts = [moment for moment in running.restarts if now - moment < self._state.settings.error_log_expiry]
        if running.failed_nodes and running.design and len(restarts) >= self._state.settings.restart_limit:
            reason = f"{', '.join(running.failed_nodes)} failed again after {len(restarts)} restarts"
            self._state.note_in_vain(now, running.design, name, reason)

    def _keeps_not(self, name: str, now: float) -> bool:
        """Return whether the running design does not keep a limit so that it counts, or a rule of the model says so."""
        if any(objective == name for objective, _ in self._state.violations(now)):
            return True
        result = self._state.analysis.objectives.get(name)
        if result is None or result.violated or self._state.rule_finds(name, v.IN_ERROR_NFR):
            return False
        key = self._state.running[name].design or "", name
        is_known = key in self._state.facts.tried and v.IN_ERROR_NFR not in result.causes
        return key in self._state.analysis.tried and not is_known

    def _is_own_fault(self, name: str, now: float) -> bool:
        """Return whether the running design itself is held to be the cause of a violation.

        Most of the last levels must pass the limit: that a level will soon do so is not sure enough.
        """
        running, limits = self._state.running[name], self._state.objectives[name].limits
        violated = [quality for other, quality in self._state.violations(now) if other == name and quality in limits]
        usual = {quality: self._state.levels.usual((name, quality)) for quality in violated}
        if not any(self._state.kb.qualities[q].violates(level, limits[q]) for q, level in usual.items()):
            return False
        is_again = self._state.is_relapse(name, now) and running.relapses + 1 >= self._state.settings.relapse_limit
        return is_again or self._state.was_at_fault(running.design or "", name)

    def _implausible(self, name: str, now: float) -> frozenset[str]:
        """Return qualities whose levels are further from the expected ones than a shared cause explains.

        Where the usual level is known, rare peaks may be as high as they like.
        """
        design = self._state.kb.designs.get(self._state.running[name].design or "")
        if design is None:
            return frozenset()
        found = set()
        for (quality, group), plausible in self.corrections(name, now).items():
            scale = self._state.scale(quality, self._state.objectives[name].limits[quality])
            seen = self._strain(now, name, quality, group)
            if seen and group == design.group(quality) and not self._state.kb.qualities[quality].typical:
                found |= {quality} if scale.is_relieved(seen, plausible, self._state.settings.relief) else set()
        return frozenset(found)

    def _causes(self, name: str, now: float) -> list[Cause]:
        """Return all causes for an adaptation of an objective itself: errors first, then chances."""
        found = errors(self._state, name, now)
        running = self._state.running[name]
        if running.design is None:
            return found
        heeds = heeds_chances(self._state, name)
        if heeds and not found and now < running.calm_until and not running.way:
            return []
        better = chances(self._state, name, now)
        if heeds and any(is_relief(cause) for cause in better):
            self._state.forgive(name)
        if not heeds and not found:
            self._state.use_chances(name)
            return []
        return [*found, *(better or running.way)]

    def _improves(self, running: Running, outcome: Plan) -> bool:
        if running.degraded and not outcome.is_makeshift:
            return True
        now = self._utility(self._state.kb.designs[running.design]) if running.design else -math.inf
        return not running.degraded and outcome.candidates[0].utility >= now + self._state.settings.improvement

    def _plan(
        self,
        name: str,
        now: float,
        function: str = "",
        only: tuple[Design, ...] = (),
        known: _Plans | None = None,
    ) -> Plan:
        """Return what to deploy for an objective, or for a function that none needs yet.

        Args:
            name: of the objective.
            now: present time.
            function: the function.
            only: the designs to choose from; none: all.
            known: what was returned before for objectives and functions, while nothing changes; it is added to.
        """
        known = {} if known is None else known
        if only:
            return self._plan_anew(name, now, function, only, known)
        if (name, function) not in known:
            known[name, function] = self._plan_anew(name, now, function, (), known)
        return known[name, function]

    def _plan_anew(self, name: str, now: float, function: str, only: tuple[Design, ...], known: _Plans) -> Plan:
        """Return what to deploy, by the plans for what designs require; see _plan."""
        objective = self._state.objectives.get(name) or self._state.objective_of(function)
        running = self._state.running.get(name) or Running()
        designs: tuple[Design, ...] = only or self._state.kb.solving(objective.function)
        unfulfilled: dict[str, list[str]] = {}
        strained: dict[str, list[str]] = {}
        for design in designs:
            for required in design.requires:
                provider = self._state.provider(required)
                outcome = None if self._state.is_fine(provider) else self._plan(provider, now, required, known=known)
                if outcome and (outcome.choice is None or outcome.is_makeshift):
                    kind = unfulfilled if outcome.choice is None else strained
                    kind.setdefault(design.name, []).append(required)
        is_tried = (running.design or "", name) in self._state.error_log
        situation = Situation(
            qualities=self._state.kb.qualities,
            unrealisable=self._state.analysis.unrealisable,
            unsuited={d.name: words for d in designs if (words := d.lacks(self._state.facts.surroundings))},
            unfulfilled=unfulfilled,
            strained=strained,
            tried={
                design: f"{reason}, not again for {expiry - now:.0f} s{UNLESS_GONE if reason == VIOLATED else ''}"
                for (design, tried_for), (expiry, reason) in self._state.error_log.items()
                if tried_for == name
            },
            rejected={design for design, rejected_for in self._state.rejections if rejected_for == name},
            current=None if running.is_broken or (running.failed_nodes and is_tried) else running.design,
            desired=self._state.settings.desired if running.design is None else "",
            observed=self._state.levels.high(now, name),
            corrections=self.corrections(name, now),
            implausible=self._implausible(name, now) if name in self._state.running else frozenset(),
            worth=self._state.settings.worth,
            relief=self._relief(name, now),
            indifference=self._state.settings.indifference,
        )
        is_lame = running.failed_nodes or running.to_put_back
        may_stay = not (is_tried and running.failed_nodes)
        if is_lame and may_stay and self._needs_only_a_restart(name, situation):
            same = plan(
                objective, [self._state.kb.designs[running.design or ""]], situation, self._utility, self._distance
            )
            again = replace(same, degraded=False, is_retry=False, reason=f"{running.design} is deployed again")
            return again if same.choice else same
        if other := self._with_other_bindings(name, objective, designs, situation):
            return other
        if self._state.settings.only_last_limit:
            objective = replace(objective, limits=dict(sorted(objective.limits.items())[-1:]))
        found = plan(objective, designs, situation, self._utility, self._distance)
        return found if self._state.settings.makeshift else without_makeshift(found)

    def _with_other_bindings(
        self, name: str, objective: Objective, designs: Collection[Design], situation: Situation
    ) -> Plan | None:
        """Return how the running design stays with spares, where nothing else is wrong; None if it can't."""
        running = self._state.kb.designs.get(situation.current or "")
        if running is None or situation.can_deploy(running.name) or self._has_other_error(name):
            return None
        rebound = [design for design in designs if design.root == running.root and design is not running]
        found = plan(objective, rebound, situation, self._utility, self._distance)
        if found.choice is None or found.is_makeshift:
            return None
        return replace(found, reason=_rebinding(self._state.kb.designs[found.choice], running))

    def _with_first_bindings(self, name: str, now: float) -> Plan | None:
        """Return how the running design gets its first bindings again in place of spares; None if it can't."""
        running = self._state.kb.designs.get(self._state.running[name].design or "")
        if running is None or not running.rebinds:
            return None
        first = self._state.kb.designs[running.rebinds]
        lost = self._utility(running) - self._utility(first)
        if lost > 0.0 and lost >= self._state.settings.improvement:
            return None  # else the next chance would bring the spare back
        found = self._plan(name, now, only=(first,))
        if found.choice is None or found.is_makeshift:
            return None
        return replace(found, reason=_rebinding(self._state.kb.designs[found.choice], running))

    def _is_rebinding(self, name: str, outcome: Plan) -> bool:
        """Return whether the running design stays but for its bindings."""
        designs, running = self._state.kb.designs, self._state.running[name].design
        if running is None or outcome.choice is None:
            return False
        return designs[running].root == designs[outcome.choice].root

    def _has_other_error(self, name: str) -> bool:
        """Return whether something is wrong with a running design beside its components."""
        running, result = self._state.running[name], self._state.analysis.objectives.get(name)
        return bool(running.is_broken or running.task_failure or (result and v.IN_ERROR_NFR in result.causes))

    def _needs_only_a_restart(self, name: str, situation: Situation) -> bool:
        """Return whether nothing is wrong with a running design but nodes that do not work, and drifted parameters."""
        return not self._has_other_error(name) and situation.can_deploy(self._state.running[name].design or "")

    def _relief(self, name: str, now: float) -> dict[str, float]:
        """Return by which distance another design should keep a limit that is violated, by quality.

        Where usual levels tell a lasting change, what is expected of other designs is sure enough: none.
        """
        objective = self._state.objectives.get(name)
        violated = [quality for other, quality in self._state.violations(now) if other == name]
        if objective is None or not self._state.settings.correct_expected:
            return {}
        share, limits = self._state.settings.relief, objective.limits
        shares = {q: 0.0 if self._state.kb.qualities[q].typical else share for q in violated}
        return {q: self._state.scale(q, limits[q]).margin(limits[q], found) for q, found in shares.items()}

    def corrections(self, name: str, now: float) -> dict[tuple[str, str], Correction]:
        """Return the corrections of the expected levels of qualities, by quality and group of designs.

        A correction never makes a level look better.
        """
        objective = self._state.objectives.get(name)
        if not self._state.settings.correct_expected or objective is None:
            return {}
        most = max(1.0, self._state.settings.correction_limit)
        found = {}
        for quality in objective.limits:
            for group in self._state.levels.groups((name, quality)):
                strain = self._strain(now, name, quality, group)
                if strain is not None and quality in self._state.kb.qualities:
                    scale = self._state.scale(quality, objective.limits[quality])
                    # That designs of a named group have the same strain, the model says itself.
                    found[quality, group] = scale.bounded(strain, _NO_BOUND if group else most)
        return found

    def _strain(self, now: float, name: str, quality: str, group: str) -> Correction | None:
        design = self._state.running[name].design
        is_observed = design is not None and self._state.kb.designs[design].group(quality) == group
        # A correction that holds for all designs is observed again whatever runs.
        return self._state.levels.strain(now, (name, quality), group, fades=bool(group) and not is_observed)

    def _corrections(self, name: str, now: float) -> tuple[str, ...]:
        limit = self._state.settings.correction_limit
        design = self._state.running[name].design if name in self._state.running else None
        return tuple(
            f"{quality} was {self._strain(now, name, quality, group)} what was expected of "
            f"{f'designs with {group}' if group else design}: {found} that (at most {limit:g} times) is expected of "
            f"{'these' if group else 'the others'}"
            for (quality, group), found in self.corrections(name, now).items()
            if found.tells
        )


def _gist(causes: list[Cause], outcome: Plan) -> tuple[object, ...]:
    """Return the part of an outcome that distinguishes it from another one."""
    wrong = tuple(cause.trigger for cause in causes if not is_chance(cause))
    return wrong, outcome.choice, outcome.degraded, outcome.is_retry


def _rebinding(design: Design, running: Design) -> str:
    """Return why a design takes the place of one that it is but for its bindings."""
    new = sorted((role, part) for role, part in design.bindings.items() if running.bindings.get(role) != part)
    return f"{design.root} stays: {' and '.join(f'{part} fills its role {role}' for role, part in new)} now"
