"""The loop from facts to decisions: R2 by a reasoner, R3 by the planner; time is an argument.

The `observe_` methods take facts. `step` analyses them when they have changed in a way that counts, and returns what to
do. `report` takes the outcome. At most one decision is under way. Times are s of ROS time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace

from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED, PROPOSED, Decision

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Analysis, Facts, Objective
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.loop.commands import Operator
from mros1_reasoner.loop.deliberation import Deliberation, Timing
from mros1_reasoner.loop.entries import BeforeFact, FailedFact, UnneededFact
from mros1_reasoner.loop.fulfilment import Fulfilment, fulfilment
from mros1_reasoner.loop.loop_time import LoopTime
from mros1_reasoner.loop.readable_state import MapeError, View
from mros1_reasoner.loop.repairs import UnderWay
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.loop.state import State
from mros1_reasoner.planning.planner import Distance, Utility, difference, feasible_designs
from mros1_reasoner.planning.utility import known_utility


class Mape:
    """The loop over every objective.

    Attributes:
        operator: takes in what an operator asks for.
    """

    def __init__(
        self,
        knowledge_base: KnowledgeBase,
        reasoner: Reasoner,
        objectives: Iterable[Objective],
        settings: Settings | None = None,
        *,
        utility: Utility | None = None,
        distance: Distance = difference,
        wall: Callable[[], float] = time.perf_counter,
        clock: Callable[[], float] | None = None,
        name: str = "decision",
    ) -> None:
        """Start with no function deployed.

        Args:
            knowledge_base: the models; the reasoner must have loaded its ontology.
            reasoner: what analyses.
            objectives: what is needed.
            settings: how to behave.
            utility: of a design; else as the settings say.
            distance: how big a change it is from one design to another.
            wall: wall clock that measures durations, s.
            clock: ROS time, for the stamps of what takes time within a step; without it, they are the step's.
            name: beginning of the decisions' ids.

        Raises:
            UtilityError: the utility function of the settings can't be made, or gives a design no utility.
        """
        settings = settings or Settings()
        self._kb, self._reasoner = knowledge_base, reasoner
        self._wall, self._clock, self._time = wall, clock, LoopTime()
        designs = knowledge_base.designs.values()
        self._utility = utility or known_utility(settings.utility, knowledge_base.qualities, designs)
        self._state = State(knowledge_base, objectives, settings, self._utility)
        self._deliberation = Deliberation(self._state, self._utility, distance, wall, self._stamp, name)
        self.operator = Operator(self._state, wall, self._time)

    @property
    def objectives(self) -> Mapping[str, Objective]:
        """Every objective by name, including those that designs require."""
        return self._state.objectives

    @property
    def roots(self) -> Collection[str]:
        """The names of the objectives that were asked for."""
        return self._state.roots.keys()

    @property
    def facts(self) -> Facts:
        """The facts of the last analysis."""
        return self._state.facts

    @property
    def known(self) -> Facts:
        """The facts of the last analysis, with the designs that have failed of late, and with the last decisions."""
        facts, state = self._state.facts, self._state
        return replace(facts, tried=frozenset(state.error_log), history=tuple(state.history))

    @property
    def analysis(self) -> Analysis:
        """The last analysis."""
        return self._state.analysis

    @property
    def view(self) -> View:
        """All that the loop knows, for reading only."""
        return self._state

    @property
    def proposal(self) -> Decision | None:
        """The decision that waits for approval."""
        return self._state.proposal

    @property
    def pending(self) -> Decision | None:
        """The decision that is under way."""
        return self._state.pending

    @property
    def active(self) -> Collection[str]:
        """The functions for which something runs, as the manipulator says."""
        return self._state.active.keys()

    @property
    def released(self) -> tuple[str, ...]:
        """The functions to release now, in this order: they run, and nothing needs them any longer.

        While a decision is under way, there is none.
        """
        return () if self._state.pending else tuple(self._state.released)

    def nodes_to_restart(self, decision: Decision) -> tuple[str, ...]:
        """Return the components that do not work and that a decision's configuration brings as nodes."""
        return self._state.failed_nodes_of(decision.to_configuration)

    def is_first(self, decision: Decision) -> bool:
        """Return whether a decision deploys something where nothing runs."""
        return not self._state.runs(decision.objective)

    # R1: facts

    def observe_level(self, now: float, quality: str, level: float, grounding: str = "", stamp: float = 0.0) -> None:
        """Take in an observed level of a quality, or a value of a property of the surroundings.

        Args:
            now: present time.
            quality: name of the quality attribute, or of the property.
            level: the level.
            grounding: name of the grounding that it was observed of; an unknown name means all groundings.
            stamp: of the diagnostic; 0 where it has none.

        Raises:
            MapeError: the quality is unknown, or the level is not finite.
        """
        now, stamp = self._time.take(now), self._time.of(stamp)
        if quality in self._kb.environment and math.isfinite(level):
            self._state.note_surroundings(now, quality, level, stamp)
            return
        if quality not in self._kb.qualities:
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(level):
            raise MapeError(f"level of {quality} is {level}, not a finite number: left out")
        for name in self._state.grounded_by(grounding):
            for limit in self._kb.limits_by(quality):
                if limit == quality or limit in self._state.objectives[name].limits:
                    self._state.note_level(now, name, limit, level, stamp)

    def is_in_reserve(self, quality: str) -> bool:
        """Return whether only objectives that are not pursued now have limits of a quality."""
        limits = set(self._kb.limits_by(quality))
        reserve, pursued = self._state.in_reserve.values(), self._state.objectives.values()
        return any(limits & set(o.limits) for o in reserve) and not any(limits & set(o.limits) for o in pursued)

    def observe_stale(self, quality: str) -> None:
        """Note that a quality can't be observed at present, and forget its levels."""
        for limit in self._kb.limits_by(quality):
            self._state.forget_levels(limit)

    def observe_component(self, now: float, component: str, status: str, stamp: float = 0.0, reason: str = "") -> None:
        """Take in the status of a component, and why it has failed; TRUE after FALSE counts as RECOVERED.

        Raises:
            MapeError: the component or the status is unknown.
        """
        now, stamp = self._time.take(now), self._time.of(stamp)
        if component not in self._kb.components:
            raise MapeError(f"component {component} is not in the model: its status is left out")
        if status not in v.COMPONENT_STATUSES:
            raise MapeError(f"component {component} has the unknown status {status!r}: expected TRUE, FALSE, RECOVERED")
        known = self._state.components.get(component)
        before = known.status if known else v.WORKS
        if self._state.had_failed_before(component) and status != v.FAILED:
            before = v.FAILED
        if status == v.WORKS and before in (v.FAILED, v.RECOVERED):
            status = v.RECOVERED
        elif status == v.RECOVERED and known and before == v.WORKS:
            status = v.WORKS  # it was not seen to fail, or its return has been heeded
        if status == v.RECOVERED and component in self._kb.own_nodes:
            status = v.WORKS  # no design waits for it
        if known is None or status != before:
            self._state.note_component(now, component, status, stamp or now, reason)
        elif reason:
            self._state.note_reason(component, reason)

    def observe_drift(
        self, now: float, node: str, parameters: str, configurations: Collection[str], stamp: float = 0.0
    ) -> None:
        """Take in that parameters of a node, named in one text, do not have the values of deployed configurations."""
        now, stamp = self._time.take(now), self._time.of(stamp)
        for objective, running in self._state.running.items():
            if running.design in configurations:
                self._state.note_drift(now, objective, node, parameters, stamp)

    def observe_binding(self, now: float, grounding: str, in_error: bool) -> None:
        """Note whether a binding of a grounding is in error.

        Raises:
            MapeError: no objective has this grounding.
        """
        now = self._time.take(now)
        for name, running in self._state.running.items():
            if running.design and self._kb.grounding(name, running.design) == grounding:
                self._state.note_binding(now, name, in_error)
                return
        raise MapeError(f"binding error of {grounding}: no objective is grounded so: left out")

    def observe_task(self, now: float, name: str, failed: bool, stamp: float = 0.0, message: str = "") -> None:
        """Take in that the task of an objective has failed, or continues.

        Args:
            now: present time.
            name: of the objective or of its function; empty: the only root objective.
            failed: whether it has failed; that holds until the next adaptation or the next report.
            stamp: of the message that said so; 0 where it has none.
            message: why.

        Raises:
            MapeError: there is no such objective, or nothing is deployed for it.
        """
        now, stamp = self._time.take(now), self._time.of(stamp)
        for objective in self._state.pursuing(name):
            running = self._state.running[objective]
            if running.design is None and failed:
                raise MapeError(f"task of {objective} was reported as failed, but nothing is deployed for it: left out")
            if failed and running.task_failure is None:
                self._state.note_task_failure(objective, (stamp or now, message))
            elif not failed:
                self._state.note_task_failure(objective, None)

    def observe_active(self, now: float, function: str, configuration: str, state: str) -> None:
        """Note what runs for a function, as the manipulator reports it (ActiveConfiguration).

        Args:
            now: present time.
            function: the function.
            configuration: what runs; empty: nothing.
            state: of the configuration.

        Raises:
            MapeError: the model does not hold the configuration, or not for that function.
        """
        now = self._time.take(now)
        if not configuration:
            self._state.note_inactive(now, function)
            return
        design = self._kb.designs.get(configuration)
        if design is None or design.function != function:
            raise MapeError(f"running configuration {configuration!r} is no FunctionDesign of {function} in the model")
        self._state.note_active(now, function, configuration, state)

    def observe_before(self, fact: BeforeFact) -> None:
        """Take in what a reasoner that has died had left, knew to have failed, or was to release.

        Raises:
            MapeError: the quality or the component is unknown.
        """
        if isinstance(fact, FailedFact):
            if fact.component not in self._kb.components:
                raise MapeError(f"component {fact.component}, which did not work, is not in the model: left out")
            self._state.note_failed_before(fact.component)
        elif isinstance(fact, UnneededFact):
            self._state.note_unneeded(fact.function)
        elif fact.quality and fact.quality not in self._kb.qualities:
            raise MapeError(f"a design was left for the quality {fact.quality!r}, which is not in the model: left out")
        else:
            self._state.note_left(fact)

    # R2, R3

    def step(self, now: float, *, heartbeat: bool = False) -> list[Decision]:
        """Reason if what counts has changed, and decide.

        A level counts when it crosses its limit.

        Args:
            now: present time.
            heartbeat: reason also when merely a level has changed, or the cause of a violation is gone but the
                last levels, by which other designs are judged, allowed no better design yet.

        Returns:
            Decisions to publish: those that are DECIDED are to be carried out and reported, at most one of them is no
            repair; one that is PROPOSED is to be approved or rejected first; the others are refusals, proposals that
            are withdrawn, and repairs that have ended. Where repairs have ended, the next step decides.

        Raises:
            ReasonerError: the analysis failed; the next step tries it again.
        """
        now = self._time.take(now)
        return [self._time.told(decision) for decision in self._step(now, heartbeat)]

    def _step(self, now: float, heartbeat: bool) -> list[Decision]:
        self._state.begin_step(now)
        ended = [self._outcome(now, repair, why) for repair, why in self._state.end_repairs(now)]
        if ended or self._state.pending:
            return ended
        self._state.forget_expired(now)
        self._state.note_retries(now)
        self._state.match_requirements()
        self._state.note_failed_nodes(now)
        facts = self._state.facts_at(now)
        seen = self._state.what_counts(facts, now)
        looks_again = heartbeat and (facts != self._state.facts or bool(self._state.relieved(now)))
        if seen == self._state.seen and not looks_again:
            return []
        began = self._wall()
        analysis = self._kb.analyse(facts, self._reasoner)
        timing = Timing(now, self._stamp(now), self._wall() - began)
        self._state.note_analysis(now, facts, analysis, seen)
        return [] if self._state.paused else self._decide_all(timing)

    def due(self, now: float) -> float | None:
        """Return when the next step is needed even without a new fact; None if none is."""
        moment = self._state.due(self._time.take(now))
        return None if moment is None else self._time.ros(moment)

    def fulfilment(self, objective: str, now: float) -> Fulfilment:
        """Return how an objective stands, by the last analysis."""
        return fulfilment(self._state, objective, self._time.take(now))

    def feasible(self) -> dict[str, tuple[str, ...]]:
        """Return the designs by which each function could be fulfilled now, the most useful first.

        A design is left out while a component that it requires does not work, no design fulfils a function that it
        requires, or the surroundings are not as it needs them.

        Raises:
            ReasonerError: the analysis failed.
        """
        components = {name: component.status for name, component in self._state.components.items()}
        surroundings = dict(self._state.surroundings.values)
        analysis, facts = self._state.analysis, self._state.facts
        if not self._state.has_analysed or (facts.components, facts.surroundings) != (components, surroundings):
            analysis = self._kb.analyse(Facts(components=components, surroundings=surroundings), self._reasoner)
        designs = [design for design in self._kb.designs.values() if design.name not in analysis.unrealisable]
        return feasible_designs(self._kb.functions, designs, self._utility)

    # R4

    def report(
        self, now: float, decision_id: str, ok: bool, message: str = "", *, blame: bool = True
    ) -> Decision | None:
        """Take in the outcome of the pending decision, or of one to repair something.

        Args:
            now: present time.
            decision_id: its id.
            ok: the wanted configuration runs.
            message: why not.
            blame: whether the configuration is to blame for the failure; then it goes into the error log.

        Returns:
            The decision, EXECUTED or FAILED, to publish; None where it is not known yet whether a repair has helped.

        Raises:
            MapeError: no decision of that id is pending.
        """
        now = self._time.take(now)
        if repair := self._state.repairs.begun_by(decision_id):
            if ok:
                return None
            self._state.repairs.fail(now, repair.decision.repair, counts=blame)
            self._state.reconsider()
            return self._time.told(self._outcome(now, repair, message or "no reason given"))
        decision, began = self._state.pending, self._state.pending_since
        if decision is None or decision.id != decision_id:
            raise MapeError(f"decision {decision_id} is not under way")
        if ok:
            self._state.succeed(now)
        else:
            why = f"could not be deployed{f' ({message})' if message else ''}"
            self._state.fail(now, why if blame else None)
        outcome = replace(
            decision,
            state=EXECUTED if ok else FAILED,
            explanation=decision.explanation + ("" if ok else f"; failed: {message or 'no reason given'}"),
            stamp_executed=now,
            execute_wall_s=self._wall() - began,
        )
        self._state.note_past(outcome)
        return self._time.told(outcome)

    def report_released(self, function: str) -> None:
        """Take in that a function was released."""
        self._state.note_released(function)

    # Parts

    def _stamp(self, now: float) -> float:
        return max(now, self._time.take(self._clock())) if self._clock else now

    def _decide_all(self, timing: Timing) -> list[Decision]:
        """Decide for every objective in error, from the roots down, until there is something to do."""
        decisions: list[Decision] = []
        chosen = None
        # What a root's design requires is released where the root takes another one.
        for name in self._state.needed(self._state.deployments()):
            decision = self._deliberation.decide(name, timing)
            if decision and decision.state == DECIDED:
                if not decision.repair or self._state.settings.approval:  # the others' turn comes after it
                    chosen = decision
                    break
                self._state.begin(decision, timing.now, self._wall())
            decisions += [decision] if decision else []
        if chosen is None and (beside := self._deliberation.repair_beside(timing)):
            chosen = beside
        found = decisions + self._put_forward(chosen, timing.now)
        self._state.match_requirements()
        return found

    def _put_forward(self, decision: Decision | None, now: float) -> list[Decision]:
        """Have a decision carried out, after approval if needed; withdraw a proposal that no longer holds."""
        former, waits = self._state.proposal, self._state.settings.approval
        target = _target(decision) if decision else None
        if former and _target(former) == target:
            return []
        found = []
        if former:
            words = f"{former.explanation}; withdrawn: what called for it has changed"
            found.append(replace(former, state=FAILED, explanation=words, stamp_executed=now))
        self._state.propose(decision if waits else None)
        if decision is None:
            return found
        if waits:
            return [*found, replace(decision, state=PROPOSED)]
        self._state.begin(decision, now, self._wall())
        return [*found, decision]

    def _outcome(self, now: float, repair: UnderWay, why: str) -> Decision:
        """Return the decision of a repair that has ended, EXECUTED, or FAILED for a reason."""
        decision = repair.decision
        words = f"failed: {why}" if why else f"{decision.repair} works again"
        outcome = replace(
            decision,
            state=FAILED if why else EXECUTED,
            explanation=f"{decision.explanation}; {words}",
            stamp_executed=now,
            execute_wall_s=self._wall() - repair.wall,
        )
        self._state.note_past(outcome)
        return outcome


def _target(decision: Decision) -> tuple[str, str, str]:
    return decision.objective, decision.to_configuration, decision.repair
