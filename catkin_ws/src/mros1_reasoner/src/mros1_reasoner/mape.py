"""The loop from facts to decisions, pure: R2 by a reasoner, R3 by the planner; time is an argument.

Facts come in by the `observe_` methods; `step` reasons when they have changed in a way that counts, and says what is to
be done; `report` takes in how it went. At most one decision is under way. Times are s of ROS time.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from mros1_reasoner import vocabulary as v
from mros1_reasoner.decision import ADVISED, DECIDED, EXECUTED, FAILED, PROPOSED, Cause, Decision
from mros1_reasoner.knowledge_base import KnowledgeBase
from mros1_reasoner.model import Analysis, Design, Facts, Objective, ObjectiveAnalysis
from mros1_reasoner.planner import Distance, Plan, Situation, Utility, difference, plan, utility_of
from mros1_reasoner.reasoner import Reasoner

_log = logging.getLogger(__name__)

STABLE, RECONFIGURING, RECOVERING = "STABLE", "RECONFIGURING", "RECOVERING"  # FunctionGrounding.msg, with FAILED
_BUSY = (RECONFIGURING, RECOVERING)


class MapeError(Exception):
    """A fact or a report does not fit; one line that says why."""


@dataclass(frozen=True)
class Settings:
    """How the loop behaves; times in s.

    Attributes:
        violation_window: a limit must be passed for so long before it counts.
        cool_down: so long after an adaptation no limit counts; component failures always do.
        level_timeout: a level older than this is no longer known.
        error_log_expiry: so long a design that was tried in vain is not tried again.
        backoff: wait after a failed reconfiguration; doubled with each further one.
        backoff_limit: the longest such wait.
        start_grace: so long after the first step the running configuration is waited for.
        busy_limit: so long a reconfiguration by somebody else is waited for.
        utility: quality attribute whose expected level is the utility.
        desired: configuration that is asked for where none runs.
        always_improve: adapt also when a recovered component makes a clearly better design possible.
        improvement: utility that such a design must have more.
        approval: a decision waits until an operator approves it.
        dry_run: what would be done is told once, as ADVISED, and not carried out.
    """

    violation_window: float = 2.0
    cool_down: float = 5.0
    level_timeout: float = 5.0
    error_log_expiry: float = 60.0
    backoff: float = 1.0
    backoff_limit: float = 30.0
    start_grace: float = 15.0
    busy_limit: float = 60.0
    utility: str = "performance"
    desired: str = ""
    always_improve: bool = False
    improvement: float = 0.05
    approval: bool = False
    dry_run: bool = False


@dataclass
class _Level:
    """The last level of a quality of an objective, and since when its limit has been passed without a break."""

    value: float
    stamp: float
    last_good: float | None = None
    passed_since: float | None = None


@dataclass
class _Component:
    status: str
    stamp: float  # of the diagnostic that reported the status first


@dataclass
class _Running:
    """What runs for an objective."""

    design: str | None = None
    state: str = ""
    busy_since: float | None = None
    failed_stamp: float = 0.0
    binding_error: bool = False
    calm_until: float = -math.inf  # no limit counts before
    not_before: float = -math.inf  # no request is made before
    attempts: int = 0
    degraded: bool = False
    refusal: tuple[object, ...] = ()  # the last refusal, so as to tell it once


class Mape:
    """The loop over every objective."""

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
            utility: of a design; else the expected level of the quality that the settings name.
            distance: how big a change it is from one design to another.
            wall: wall clock that measures durations, s.
            clock: ROS time, for the stamps of what takes time within a step; without it, they are the step's.
            name: beginning of the decisions' ids.
        """
        self._kb = knowledge_base
        self._reasoner = reasoner
        self.objectives = {objective.name: objective for objective in objectives}
        self.settings = settings or Settings()
        named = self.settings.utility
        self._utility = utility or utility_of(named, *([knowledge_base.qualities[named]] if self._knows(named) else []))
        self._distance = distance
        self._wall = wall
        self._clock = clock
        self._name = name
        self._count = 0
        self._running = {objective: _Running() for objective in self.objectives}
        self._components = {c: _Component(s, 0.0) for c, s in knowledge_base.component_statuses.items()}
        self._levels: dict[tuple[str, str], _Level] = {}
        self._error_log: dict[tuple[str, str], tuple[float, str]] = {}
        self._pending: Decision | None = None
        self._proposal: Decision | None = None
        self._paused = False
        self._locked: set[str] = set()
        self._started: float | None = None
        self._seen: tuple[object, ...] | None = None
        self._analysed: Facts | None = None
        self.facts = Facts()
        self.analysis = Analysis()

    # R1: facts

    def observe_level(self, now: float, quality: str, level: float, grounding: str = "", stamp: float = 0.0) -> None:
        """Take in an observed level.

        Args:
            now: present time.
            quality: name of the quality attribute.
            level: the level.
            grounding: name of the grounding that it was observed of; where none has that name, it is of all.
            stamp: of the diagnostic; 0 where it has none.

        Raises:
            MapeError: the quality is unknown, or the level is not finite.
        """
        if quality not in self._kb.qualities:
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(level):
            raise MapeError(f"level of {quality} is {level}, not a finite number: left out")
        for name in self._observed_objectives(grounding):
            limit = self.objectives[name].limits.get(quality)
            passed = limit is not None and self._kb.qualities[quality].excess(level, limit) > 0
            before = self._levels.get((name, quality))
            known = before if before and now - before.stamp <= self.settings.level_timeout else None
            since = known.passed_since if known else None
            self._levels[name, quality] = _Level(
                value=level,
                stamp=now,
                last_good=(known.last_good if known else None) if passed else level,
                passed_since=(since if since is not None else stamp or now) if passed else None,
            )

    def observe_stale(self, quality: str) -> None:
        """Take in that a quality can't be observed at present: its levels are no longer known."""
        for key in [key for key in self._levels if key[1] == quality]:
            del self._levels[key]

    def observe_component(self, now: float, component: str, status: str, stamp: float = 0.0) -> None:
        """Take in the status of a component; a return without RECOVERED is taken for one with it.

        Raises:
            MapeError: the component or the status is unknown.
        """
        if component not in self._kb.components:
            raise MapeError(f"component {component} is not in the model: its status is left out")
        if status not in v.COMPONENT_STATUSES:
            raise MapeError(f"component {component} has the unknown status {status!r}: expected TRUE, FALSE, RECOVERED")
        known = self._components.get(component)
        before = known.status if known else v.WORKS
        if status == v.WORKS and before in (v.FAILED, v.RECOVERED):
            status = v.RECOVERED
        elif status == v.RECOVERED and before == v.WORKS:
            status = v.WORKS  # it was never seen to fail, or its return has been heeded
        if known is None or status != before:
            self._components[component] = _Component(status, stamp or now)

    def observe_binding(self, now: float, grounding: str, in_error: bool) -> None:
        """Take in that a binding of a grounding is in error, or no longer is.

        Raises:
            MapeError: no objective is grounded so.
        """
        for name, running in self._running.items():
            if running.design and self._kb.grounding(name, running.design) == grounding:
                running.failed_stamp = running.failed_stamp if running.binding_error else now
                running.binding_error = in_error
                return
        raise MapeError(f"binding error of {grounding}: no objective is grounded so: left out")

    def observe_active(self, now: float, function: str, configuration: str, state: str) -> None:
        """Take in what runs for a function, as the manipulator says (ActiveConfiguration).

        Raises:
            MapeError: the model does not hold the configuration, or not for that function.
        """
        design = self._kb.designs.get(configuration)
        if design is None or design.function != function:
            raise MapeError(f"running configuration {configuration!r} is no FunctionDesign of {function} in the model")
        for name in [o.name for o in self.objectives.values() if o.function == function]:
            running = self._running[name]
            if state in _BUSY:
                running.busy_since = running.busy_since if running.state in _BUSY else now
            if state != running.state and state == FAILED:
                running.failed_stamp = now
            running.state = state
            if state == RECONFIGURING or running.design == configuration:
                continue  # while it reconfigures, the configuration may be the old or the new one
            self._deployed(name, configuration, now)

    # What an operator asks for

    @property
    def paused(self) -> bool:
        """Whether nothing is decided at present."""
        return self._paused

    @property
    def locked(self) -> frozenset[str]:
        """Objectives that keep the configuration they have."""
        return frozenset(self._locked)

    @property
    def proposal(self) -> Decision | None:
        """The decision that waits for approval."""
        return self._proposal

    def pause(self) -> None:
        """Decide nothing until `resume`; facts are taken in and analysed, and what is under way is finished."""
        self._paused = True

    def resume(self) -> None:
        """Decide again, by what holds then."""
        self._paused, self._seen = False, None

    def lock(self, objective: str = "") -> None:
        """Keep the configuration that an objective has, of all objectives where none is named.

        What would have been done is told as a refusal.

        Raises:
            MapeError: there is no such objective.
        """
        self._locked |= self._named(objective)
        self._seen = None

    def unlock(self, objective: str = "") -> None:
        """Take `lock` back.

        Raises:
            MapeError: there is no such objective.
        """
        self._locked -= self._named(objective)
        self._seen = None

    def approve(self, decision_id: str) -> Decision:
        """Approve the proposed decision; it is now DECIDED, to be published and carried out.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = replace(self._proposed(decision_id), state=DECIDED, wall_began=self._wall())
        self._proposal, self._pending = None, decision
        return decision

    def reject(self, decision_id: str, now: float, reason: str = "") -> Decision:
        """Reject the proposed decision; its design is not proposed again until the error log forgets it.

        Returns:
            The decision, FAILED, to publish.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = self._proposed(decision_id)
        words = f"rejected by the operator{f' ({reason})' if reason else ''}"
        expiry = now + self.settings.error_log_expiry
        self._error_log[decision.to_configuration, decision.objective] = expiry, words
        self._proposal, self._seen = None, None
        return replace(decision, state=FAILED, explanation=f"{decision.explanation}; {words}", stamp_executed=now)

    def add_objective(self, objective: Objective) -> None:
        """Ask for a function from now on.

        Raises:
            MapeError: the name is taken, or the model holds no such function or quality.
        """
        if objective.name in self.objectives:
            raise MapeError(f"objective {objective.name} exists already: give another name")
        if objective.function not in self._kb.functions:
            known = ", ".join(self._kb.functions)
            raise MapeError(f"objective {objective.name}: no Function is called {objective.function!r}: known: {known}")
        for quality, limit in objective.limits.items():
            self._check_limit(quality, limit)
        self.objectives[objective.name] = objective
        self._running[objective.name] = _Running()
        self._seen = None

    def remove_objective(self, name: str) -> None:
        """No longer ask for a function.

        Raises:
            MapeError: there is no such objective, or a decision about it is being carried out.
        """
        self._named(name)
        if self._pending and self._pending.objective == name:
            raise MapeError(f"objective {name} is being adapted: remove it afterwards")
        if self._proposal and self._proposal.objective == name:
            self._proposal = None
        del self.objectives[name], self._running[name]
        self._locked.discard(name)
        self._levels = {key: level for key, level in self._levels.items() if key[0] != name}
        self._error_log = {key: entry for key, entry in self._error_log.items() if key[1] != name}
        self._seen = None

    def set_nfr(self, objective: str, quality: str, limit: float | None) -> None:
        """Give an objective another limit of a quality; None takes the limit away.

        Raises:
            MapeError: there is no such objective or quality, or the limit is not finite.
        """
        self._named(objective)
        self._check_limit(quality, 0.0 if limit is None else limit)
        before = self.objectives[objective]
        limits = {q: value for q, value in before.limits.items() if q != quality}
        self.objectives[objective] = replace(before, limits=limits if limit is None else {**limits, quality: limit})
        for key in [key for key in self._levels if key[1] == quality and key[0] == objective]:
            del self._levels[key]  # since when the limit is passed must be found anew
        self._seen = None

    def feasible(self) -> dict[str, tuple[str, ...]]:
        """Return the designs by which each function could be fulfilled now, the most useful first.

        A design is left out while a component that it requires does not work, or no design fulfils a function that
        it requires.

        Raises:
            ReasonerError: the analysis failed.
        """
        unrealisable = self._analysis_of_components().unrealisable
        found: dict[str, tuple[str, ...]] = {}

        def fulfilling(function: str) -> tuple[str, ...]:
            if function not in found:
                designs = [d for d in self._kb.solving(function) if d.name not in unrealisable]
                fit = [d for d in designs if all(fulfilling(required) for required in d.requires)]
                fit.sort(key=lambda d: (-self._utility(d), d.name))
                found[function] = tuple(d.name for d in fit)
            return found[function]

        for function in self._kb.functions:
            fulfilling(function)
        return found

    def save(self, path: Path) -> None:
        """Write the knowledge base with the last facts and statuses as an OWL file that loads again as a model.

        Raises:
            MapeError: the file can't be written.
        """
        try:
            self._kb.save(path, self.facts, self.analysis)
        except OSError as error:
            raise MapeError(f"{path}: {error.strerror or error}: give another file") from error

    # R2, R3

    def step(self, now: float, *, heartbeat: bool = False) -> list[Decision]:
        """Reason if what counts has changed, and decide.

        Levels count by the side of the limit that they are on.

        Args:
            now: present time.
            heartbeat: reason also when merely a level has changed.

        Returns:
            Decisions to publish: at most one that is DECIDED, to be carried out and reported, or PROPOSED, to be
            approved or rejected first; the others are refusals, and proposals that are withdrawn.

        Raises:
            ReasonerError: the analysis failed; the next step tries it again.
        """
        if self._started is None:
            self._started = now
        if self._pending:
            return []
        self._error_log = {key: entry for key, entry in self._error_log.items() if entry[0] > now}
        facts = self._facts(now)
        seen = self._what_counts(facts, now)
        if seen == self._seen and not (heartbeat and facts != self._analysed):
            return []
        began = self._wall()
        analysis = self._kb.analyse(facts, self._reasoner)
        analyse_wall = self._wall() - began
        analysed = self._stamp(now)
        self.facts, self.analysis = facts, analysis
        self._analysed, self._seen = facts, seen
        if self._paused:
            return []
        decisions = []
        chosen = None
        for objective in tuple(self.objectives.values()):
            decision = self._decide(objective, now, analysed, analyse_wall)
            if decision is None:
                continue
            if decision.state == DECIDED:  # the others' turn comes after it
                chosen = decision
                break
            decisions.append(decision)
        else:
            self._heed_recoveries()
        return decisions + self._put_forward(chosen, now)

    def _put_forward(self, decision: Decision | None, now: float) -> list[Decision]:
        """Have a decision carried out, or approved first; a proposal that no longer holds is withdrawn."""
        former = self._proposal
        if (
            former
            and decision
            and (former.objective, former.to_configuration)
            == (
                decision.objective,
                decision.to_configuration,
            )
        ):
            return []
        found = []
        if former:
            words = f"{former.explanation}; withdrawn: what called for it has changed"
            found.append(replace(former, state=FAILED, explanation=words, stamp_executed=now))
        self._proposal = decision if self.settings.approval else None
        if decision is None:
            return found
        if self.settings.approval:
            return [*found, replace(decision, state=PROPOSED)]
        self._pending, self._seen = decision, None
        return [*found, decision]

    def due(self, now: float) -> float | None:
        """Return the next time at which a step can bring something without a new fact, None where there is none."""
        times = [self._started + self.settings.start_grace] if self._started is not None else []
        for (objective, _), level in self._levels.items():
            if level.passed_since is not None:
                window_ends = level.passed_since + self.settings.violation_window
                times.append(max(window_ends, self._running[objective].calm_until))
            times.append(level.stamp + self.settings.level_timeout)
        for running in self._running.values():
            times.append(running.not_before)
            if running.busy_since is not None:
                times.append(running.busy_since + self.settings.busy_limit)
        times += [expiry for expiry, _ in self._error_log.values()]
        return min((moment for moment in times if now < moment < math.inf), default=None)

    # R4

    @property
    def pending(self) -> Decision | None:
        """The decision that is under way."""
        return self._pending

    def report(self, now: float, decision_id: str, ok: bool, message: str = "", *, blame: bool = True) -> Decision:
        """Take in how the pending decision went.

        Args:
            now: present time.
            decision_id: its id.
            ok: the wanted configuration runs.
            message: why not.
            blame: a failure is the configuration's own, so that it goes into the error log.

        Returns:
            The decision, EXECUTED or FAILED, to publish.

        Raises:
            MapeError: no decision of that id is pending.
        """
        decision = self._pending
        if decision is None or decision.id != decision_id:
            raise MapeError(f"decision {decision_id} is not under way")
        self._pending = None
        self._seen = None
        running = self._running[decision.objective]
        if ok:
            if running.state in (*_BUSY, FAILED):
                running.state, running.busy_since = STABLE, None
            self._deployed(decision.objective, decision.to_configuration, now)
            running.calm_until = now + self.settings.cool_down
            running.attempts = 0
            running.degraded = decision.degraded
        else:
            if blame:
                expiry = now + self.settings.error_log_expiry
                reason = f"could not be deployed ({message})" if message else "could not be deployed"
                self._error_log[decision.to_configuration, decision.objective] = expiry, reason
            wait = min(self.settings.backoff * 2**running.attempts, self.settings.backoff_limit)
            running.not_before = now + wait
            running.attempts += 1
        return replace(
            decision,
            state=EXECUTED if ok else FAILED,
            explanation=decision.explanation + ("" if ok else f"; failed: {message or 'no reason given'}"),
            stamp_executed=now,
            execute_wall_s=self._wall() - decision.wall_began,
        )

    # Parts

    def _named(self, objective: str) -> set[str]:
        if objective and objective not in self.objectives:
            raise MapeError(f"no objective is called {objective!r}: known: {', '.join(self.objectives)}")
        return {objective} if objective else set(self.objectives)

    def _proposed(self, decision_id: str) -> Decision:
        if self._proposal is None or self._proposal.id != decision_id:
            raise MapeError(f"decision {decision_id} does not wait for approval")
        return self._proposal

    def _check_limit(self, quality: str, limit: float) -> None:
        if not self._knows(quality):
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(limit):
            raise MapeError(f"limit of {quality} is {limit}, not a finite number: left as it is")

    def _analysis_of_components(self) -> Analysis:
        """Return the last analysis, or a new one where components have changed since."""
        components = {name: component.status for name, component in self._components.items()}
        if self._analysed is not None and self._analysed.components == components:
            return self.analysis
        return self._kb.analyse(Facts(components=components), self._reasoner)

    def _stamp(self, now: float) -> float:
        return max(now, self._clock()) if self._clock else now

    def _knows(self, quality: str) -> bool:
        return quality in self._kb.qualities

    def _observed_objectives(self, grounding: str) -> list[str]:
        grounded = [name for name, running in self._running.items() if running.design]
        named = [n for n in grounded if self._kb.grounding(n, self._running[n].design or "") == grounding]
        return named or grounded

    def _deployed(self, objective: str, design: str, now: float) -> None:
        """Note that a design runs: what was observed of the one before it says nothing of this one."""
        running = self._running[objective]
        if running.design is not None and running.design != design:
            running.calm_until = max(running.calm_until, now + self.settings.cool_down)
        running.design = design
        running.degraded = False
        running.binding_error = False
        running.refusal = ()
        for key in [key for key in self._levels if key[0] == objective]:
            del self._levels[key]

    def _is_busy(self, running: _Running, now: float) -> bool:
        since = running.busy_since
        return running.state in _BUSY and since is not None and now - since < self.settings.busy_limit

    def _facts(self, now: float) -> Facts:
        levels = {}
        for (objective, quality), level in self._levels.items():
            if now - level.stamp > self.settings.level_timeout:
                continue
            since, calm_until = level.passed_since, self._running[objective].calm_until
            if since is None or (now - since >= self.settings.violation_window and now >= calm_until):
                levels[objective, quality] = level.value
            elif level.last_good is not None:
                levels[objective, quality] = level.last_good
        return Facts(
            objectives=tuple(self.objectives.values()),
            groundings={name: running.design for name, running in self._running.items() if running.design},
            levels=levels,
            components={name: component.status for name, component in self._components.items()},
            broken=frozenset(n for n, running in self._running.items() if running.design and _is_broken(running)),
        )

    def _what_counts(self, facts: Facts, now: float) -> tuple[object, ...]:
        passed = frozenset(
            (name, quality)
            for (name, quality), level in facts.levels.items()
            if quality in self.objectives[name].limits
            and self._kb.qualities[quality].excess(level, self.objectives[name].limits[quality]) > 0
        )
        waits = tuple((self._is_busy(running, now), now < running.not_before) for running in self._running.values())
        grace = self._started is not None and now - self._started < self.settings.start_grace
        return (
            facts.objectives,
            facts.groundings,
            facts.components,
            facts.broken,
            frozenset(facts.levels),
            passed,
            waits,
            grace,
            frozenset(self._error_log),
        )

    def _heed_recoveries(self) -> None:
        """A return counts once; after that the component simply works."""
        for name, component in self._components.items():
            if component.status == v.RECOVERED:
                self._components[name] = _Component(v.WORKS, component.stamp)

    def _decide(self, objective: Objective, now: float, analysed: float, analyse_wall: float) -> Decision | None:
        running = self._running[objective.name]
        result = self.analysis.objectives[objective.name]
        if self._is_busy(running, now) or now < running.not_before:
            return None
        causes = self._causes(objective, running, result, now)
        if not causes:
            running.refusal = ()
            return None
        for design, name in self.analysis.tried:
            if name == objective.name:
                reason = "did not keep a limit while deployed"
                self._error_log[design, name] = now + self.settings.error_log_expiry, reason
        broken = _is_broken(running)
        if broken and running.design:
            self._error_log[running.design, objective.name] = now + self.settings.error_log_expiry, "did not run"
        began = self._wall()
        outcome = self._plan(objective, running, now)
        plan_wall = self._wall() - began
        causes.sort(key=lambda cause: (cause.stamp, cause.trigger))
        trigger = causes[0].trigger
        words = tuple(cause.text for cause in causes)
        stays = outcome.choice is None or (outcome.choice == running.design and not broken)
        reason = outcome.reason
        if not stays and objective.name in self._locked:
            stays, reason = True, f"locked by the operator; {outcome.choice} would be taken: {outcome.reason}"
        if result.causes == {v.UPDATABLE} and (stays or not self._improves(running, outcome)):
            return None
        if stays or self.settings.dry_run:
            refusal = (tuple(c.trigger for c in causes), outcome.choice)
            if refusal == running.refusal:
                return None
            running.refusal = refusal
            running.degraded = running.degraded or stays
        self._count += 1
        target = "" if stays else outcome.choice or ""
        change = f"{running.design or 'nothing'} -> {target}" if target else f"stays with {running.design or 'nothing'}"
        return Decision(
            id=f"{self._name}-{self._count}",
            state=FAILED if stays else ADVISED if self.settings.dry_run else DECIDED,
            objective=objective.name,
            trigger=trigger,
            causes=words,
            from_configuration=running.design or "",
            to_configuration=target,
            degraded=outcome.degraded,
            candidates=outcome.candidates,
            explanation=f"{objective.name}: {'; '.join(words)}: {change}: {reason}",
            stamp_monitored=causes[0].stamp,
            stamp_analysed=analysed,
            stamp_planned=self._stamp(now),
            analyse_wall_s=analyse_wall,
            plan_wall_s=plan_wall,
            reasons=tuple(causes),
            wall_began=self._wall(),
        )

    def _causes(self, objective: Objective, running: _Running, result: ObjectiveAnalysis, now: float) -> list[Cause]:
        """Return everything that asks for an adaptation."""
        if running.design is None:
            waited = self._started is not None and now - self._started >= self.settings.start_grace
            return [Cause(now, "initial", "no configuration runs")] if waited else []
        causes = []
        if v.IN_ERROR_COMPONENT in result.causes:
            for name in self.analysis.unrealisable.get(running.design, ()):
                component = self._components.get(name)
                words = f"component {name}, which {running.design} requires, does not work"
                stamp = component.stamp if component else now
                causes.append(Cause(stamp, f"component:{name}", words, "compError, compErrFG, S1a"))
            if _is_broken(running) or not causes:
                words = f"configuration {running.design} does not run"
                causes.append(Cause(running.failed_stamp or now, f"component:{running.design}", words, "S1a"))
        if v.IN_ERROR_NFR in result.causes:
            causes += [self._violation(objective, quality, now) for quality in result.violated]
        if not causes and v.UPDATABLE in result.causes and (running.degraded or self.settings.always_improve):
            for name, component in self._components.items():
                if component.status == v.RECOVERED:
                    words = f"component {name} works again"
                    causes.append(Cause(component.stamp, f"component:{name}", words, "compRecov"))
        return causes

    def _violation(self, objective: Objective, quality: str, now: float) -> Cause:
        level, limit = self._levels[objective.name, quality], objective.limits[quality]
        since = level.passed_since if level.passed_since is not None else now
        kind = self._kb.qualities[quality]
        return Cause(
            stamp=since,
            trigger=f"qa:{quality}",
            text=f"{quality} {level.value:.3g} {kind.passes} {limit:g} for {now - since:.1f} s",
            rules="QA, S9",
            quality=quality,
            level=level.value,
            limit=limit,
            excess=kind.excess(level.value, limit) / (abs(limit) or 1.0),
        )

    def _improves(self, running: _Running, outcome: Plan) -> bool:
        if running.degraded:
            return not outcome.degraded
        now = self._utility(self._kb.designs[running.design]) if running.design else -math.inf
        return outcome.candidates[0].utility >= now + self.settings.improvement

    def _plan(self, objective: Objective, running: _Running, now: float) -> Plan:
        designs: tuple[Design, ...] = self._kb.solving(objective.function)
        desired = self.settings.desired
        if running.design is None and desired and not self._is_logged(desired, objective.name):
            designs = tuple(design for design in designs if design.name == desired) or designs
        tried: Mapping[str, str] = {
            design: f"{reason}, not again for {expiry - now:.0f} s"
            for (design, name), (expiry, reason) in self._error_log.items()
            if name == objective.name
        }
        situation = Situation(
            directions=self._kb.qualities,
            unrealisable=self.analysis.unrealisable,
            tried=tried,
            current=None if _is_broken(running) else running.design,
            observed={q: level.value for (name, q), level in self._levels.items() if name == objective.name},
        )
        return plan(objective, designs, situation, self._utility, self._distance)

    def _is_logged(self, design: str, objective: str) -> bool:
        return (design, objective) in self._error_log


def _is_broken(running: _Running) -> bool:
    return running.state == FAILED or running.binding_error
