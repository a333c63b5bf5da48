"""The loop from facts to decisions, pure: R2 by a reasoner, R3 by the planner; time is an argument.

Facts come in by the `observe_` methods; `step` reasons when they have changed in a way that counts, and says what is to
be done; `report` takes in how it went. At most one decision is under way. Times are s of ROS time.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from mros1_reasoner import vocabulary as v
from mros1_reasoner.decision import ADVISED, DECIDED, EXECUTED, FAILED, PROPOSED, Cause, Decision
from mros1_reasoner.knowledge_base import KnowledgeBase
from mros1_reasoner.levels import Levels
from mros1_reasoner.model import Analysis, Design, Direction, Facts, Objective, Quality
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
        always_improve: adapt also when a clearly better design has become available, because a component works again
            or the operator has changed a limit; an objective may say otherwise.
        improvement: utility that such a design must have more.
        worth: where no design keeps every limit, another one must violate them by so much less, as a share of a limit.
        correct_expected: multiply expected levels by the ratio of observed to expected ones of the deployed design.
        correction_limit: that ratio at most, or one by it.
        correction_memory: time constant of the average of that ratio.
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
    worth: float = 0.1
    correct_expected: bool = True
    correction_limit: float = 2.5
    correction_memory: float = 30.0
    approval: bool = False
    dry_run: bool = False


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
    task_failure: tuple[float, str] | None = None  # when, and why
    calm_until: float = -math.inf  # no limit counts before
    not_before: float = -math.inf  # no request is made before
    attempts: int = 0
    degraded: bool = False
    refusal: tuple[object, ...] = ()  # the last refusal, so as to tell it once
    updatable: dict[str, tuple[float, str]] = field(default_factory=dict)  # trigger -> when, and in words

    @property
    def is_broken(self) -> bool:
        return self.state == FAILED or self.binding_error


@dataclass(frozen=True)
class _Timing:
    """When and for how long the present step has analysed."""

    now: float
    analysed: float
    analyse_wall: float


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
        self.settings = settings or Settings()
        named = self.settings.utility
        kind = knowledge_base.qualities.get(named, Quality(Direction.HIGHER_IS_BETTER))
        self._utility = utility or utility_of(named, kind.direction)
        self._distance = distance
        self._wall = wall
        self._clock = clock
        self._name = name
        self._count = 0
        self.objectives = {objective.name: objective for objective in objectives}
        self._roots = dict.fromkeys(self.objectives)
        self._running = {objective: _Running() for objective in self.objectives}
        self._active: dict[str, tuple[str, str]] = {}  # function -> configuration, state
        self._wanted: dict[str, str] = {}  # objective -> design that waits for the functions it requires
        self._components = {c: _Component(s, 0.0) for c, s in knowledge_base.component_statuses.items()}
        window, timeout = self.settings.violation_window, self.settings.level_timeout
        self._levels = Levels(window, timeout, self.settings.correction_memory)
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
            passed = limit is not None and self._kb.qualities[quality].violates(level, limit)
            design = self._kb.designs[self._running[name].design or ""]
            expected = design.expected.get(quality)
            self._levels.observe(now, (name, quality), level, passed=passed, stamp=stamp, expected=expected)

    def observe_stale(self, quality: str) -> None:
        """Take in that a quality can't be observed at present: its levels are no longer known."""
        self._levels.forget(quality=quality)

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

    def observe_task(self, now: float, name: str, failed: bool, stamp: float = 0.0, message: str = "") -> None:
        """Take in that the task of an objective has failed though nothing else is known to be wrong, or goes on.

        Args:
            now: present time.
            name: of the objective or of its function; empty where there is but one that nothing else requires.
            failed: whether it has failed; until the next adaptation, or until it is reported not to have.
            stamp: of the message that said so; 0 where it has none.
            message: why.

        Raises:
            MapeError: there is no such objective, or nothing is deployed for it.
        """
        names = [o.name for o in self.objectives.values() if name in (o.name, o.function)]
        if not name and len(self._roots) == 1:
            names = list(self._roots)
        if not names:
            raise MapeError(f"task of {name or 'an objective without a name'}: known: {', '.join(self.objectives)}")
        for objective in names:
            running = self._running[objective]
            if running.design is None and failed:
                raise MapeError(f"task of {objective} is said to have failed, but nothing is deployed for it: left out")
            if failed and running.task_failure is None:
                running.task_failure = stamp or now, message
            elif not failed:
                running.task_failure = None

    def observe_active(self, now: float, function: str, configuration: str, state: str) -> None:
        """Take in what runs for a function, as the manipulator says (ActiveConfiguration).

        Raises:
            MapeError: the model does not hold the configuration, or not for that function.
        """
        design = self._kb.designs.get(configuration)
        if design is None or design.function != function:
            raise MapeError(f"running configuration {configuration!r} is no FunctionDesign of {function} in the model")
        self._active[function] = configuration, state
        for name in [o.name for o in self.objectives.values() if o.function == function]:
            self._take_active(name, configuration, state, now)

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
        self._note_in_vain(now, decision.to_configuration, decision.objective, words)
        self._proposal, self._seen = None, None
        return replace(decision, state=FAILED, explanation=f"{decision.explanation}; {words}", stamp_executed=now)

    def add_objective(self, objective: Objective) -> None:
        """Ask for a function from now on.

        Raises:
            MapeError: the name is taken, or the model holds no such function or quality.
        """
        if objective.name in self._roots:
            raise MapeError(f"objective {objective.name} exists already: give another name")
        if objective.function not in self._kb.functions:
            known = ", ".join(self._kb.functions)
            raise MapeError(f"objective {objective.name}: no Function is called {objective.function!r}: known: {known}")
        for quality, limit in objective.limits.items():
            self._check_limit(quality, limit)
        self._roots[objective.name] = None
        self._add(objective)
        self._seen = None

    def remove_objective(self, name: str) -> None:
        """No longer ask for a function; objectives that only it required go with it.

        Raises:
            MapeError: there is no such objective, or a decision about it is being carried out.
        """
        if name not in self._roots:
            raise MapeError(f"no objective is called {name!r}: known: {', '.join(self._roots)}")
        if self._pending and (self._pending.objective == name or self._pending.objective not in self._roots):
            raise MapeError(f"objective {name} is being adapted: remove it afterwards")
        del self._roots[name]
        self._wanted.pop(name, None)
        self._drop(name)
        self._match_requirements()
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
        self._levels.forget(objective, quality)  # since when the limit is passed must be found anew
        words = (
            f"the operator {'has lifted the limit' if limit is None else f'wants a limit of {limit:g}'} of {quality}"
        )
        self._running[objective].updatable["operator"] = math.inf, words
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
        self._match_requirements()
        facts = self._facts(now)
        seen = self._what_counts(facts, now)
        if seen == self._seen and not (heartbeat and facts != self._analysed):
            return []
        began = self._wall()
        analysis = self._kb.analyse(facts, self._reasoner)
        timing = _Timing(now, self._stamp(now), self._wall() - began)
        self.facts, self.analysis = facts, analysis
        self._analysed, self._seen = facts, seen
        self._heed_recoveries()
        if self._paused:
            return []
        return self._decide_all(timing)

    def due(self, now: float) -> float | None:
        """Return the next time at which a step can bring something without a new fact, None where there is none."""
        times = [self._started + self.settings.start_grace] if self._started is not None else []
        times += self._levels.due({name: running.calm_until for name, running in self._running.items()})
        for running in self._running.values():
            times.append(running.not_before)
            if running.updatable:
                times.append(running.calm_until)
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
            self._active[self.objectives[decision.objective].function] = decision.to_configuration, STABLE
            running.calm_until = now + self.settings.cool_down
            running.attempts = 0
            running.degraded = decision.degraded
        else:
            if blame:
                reason = f"could not be deployed ({message})" if message else "could not be deployed"
                self._note_in_vain(now, decision.to_configuration, decision.objective, reason)
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

    # Objectives

    def _named(self, objective: str) -> set[str]:
        if objective and objective not in self.objectives:
            raise MapeError(f"no objective is called {objective!r}: known: {', '.join(self.objectives)}")
        return {objective} if objective else set(self.objectives)

    def _proposed(self, decision_id: str) -> Decision:
        if self._proposal is None or self._proposal.id != decision_id:
            raise MapeError(f"decision {decision_id} does not wait for approval")
        return self._proposal

    def _add(self, objective: Objective) -> None:
        self.objectives[objective.name] = objective
        self._running[objective.name] = _Running()
        active = self._active.get(objective.function)
        if active:
            self._take_active(objective.name, *active, now=-math.inf)

    def _drop(self, name: str) -> None:
        """Forget an objective and everything that is known of it."""
        if self._proposal and self._proposal.objective == name:
            self._proposal = None
        del self.objectives[name], self._running[name]
        self._locked.discard(name)
        self._levels.drop(name)
        self._error_log = {key: entry for key, entry in self._error_log.items() if key[1] != name}

    def _provider(self, function: str) -> str:
        """Return the name of the objective by which a function is provided to the designs that require it."""
        root = next((name for name in self._roots if self.objectives[name].function == function), None)
        if root:
            return root
        name = f"o_{function.removeprefix('f_')}"
        return name if name not in self._roots else f"o_{function}"

    def _required(self, design: str | None) -> tuple[str, ...]:
        """Return the objectives that a design requires."""
        return tuple(self._provider(f) for f in self._kb.designs[design].requires) if design else ()

    def _requirers(self, name: str) -> list[str]:
        """Return the objectives whose running design requires an objective."""
        return [o for o in self.objectives if name in self._required(self._running[o].design)]

    def _deployments(self) -> dict[str, str]:
        """Return the design that runs by objective."""
        return {name: running.design for name, running in self._running.items() if running.design}

    def _needed(self, *deployments: Mapping[str, str]) -> dict[str, str]:
        """Return the objectives that deployments need, with the function of each, from the roots down."""
        needed = {name: self.objectives[name].function for name in self._roots}
        queue = list(needed)
        while queue:
            name = queue.pop(0)
            for design in {deployment[name]: None for deployment in deployments if name in deployment}:
                for function in self._kb.designs[design].requires:
                    provider = self._provider(function)
                    if provider not in needed:
                        needed[provider] = function
                        queue.append(provider)
        return needed

    def _match_requirements(self) -> None:
        """Have an objective for every function that is required, and release those that no longer are."""
        while True:  # what runs for a new objective may require further ones
            needed = self._needed(self._deployments(), self._wanted)
            missing = {name: function for name, function in needed.items() if name not in self.objectives}
            if not missing:
                break
            for name, function in missing.items():
                self._add(Objective(name, function))
        for name in [name for name in self.objectives if name not in needed]:
            self._wanted.pop(name, None)
            self._drop(name)

    def _take_active(self, name: str, configuration: str, state: str, now: float) -> None:
        running = self._running[name]
        if state in _BUSY:
            running.busy_since = running.busy_since if running.state in _BUSY else now
        if state != running.state and state == FAILED:
            running.failed_stamp = now
        running.state = state
        if state != RECONFIGURING and running.design != configuration:
            self._deployed(name, configuration, now)  # while it reconfigures, it may be the old or the new one

    def _deployed(self, objective: str, design: str, now: float) -> None:
        """Note that a design runs: what was observed of the one before it says nothing of this one."""
        running = self._running[objective]
        if running.design is not None and running.design != design:
            running.calm_until = max(running.calm_until, now + self.settings.cool_down)
        running.design = design
        running.degraded = False
        running.binding_error = False
        running.task_failure = None
        running.refusal = ()
        if self._wanted.get(objective) == design:
            del self._wanted[objective]
        self._levels.forget(objective, now=now)

    # Facts

    def _stamp(self, now: float) -> float:
        return max(now, self._clock()) if self._clock else now

    def _check_limit(self, quality: str, limit: float) -> None:
        if quality not in self._kb.qualities:
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(limit):
            raise MapeError(f"limit of {quality} is {limit}, not a finite number: left as it is")

    def _observed_objectives(self, grounding: str) -> list[str]:
        grounded = [name for name, running in self._running.items() if running.design]
        named = [n for n in grounded if self._kb.grounding(n, self._running[n].design or "") == grounding]
        return named or grounded

    def _is_busy(self, running: _Running, now: float) -> bool:
        since = running.busy_since
        return running.state in _BUSY and since is not None and now - since < self.settings.busy_limit

    def _waits(self, name: str, now: float) -> bool:
        running = self._running[name]
        return self._is_busy(running, now) or now < running.not_before

    def _facts(self, now: float) -> Facts:
        grounded = {name: running for name, running in self._running.items() if running.design}
        return Facts(
            objectives=tuple(self.objectives.values()),
            groundings={name: running.design or "" for name, running in grounded.items()},
            levels=self._levels.counting(now, {name: running.calm_until for name, running in self._running.items()}),
            components={name: component.status for name, component in self._components.items()},
            broken=frozenset(name for name, running in grounded.items() if running.is_broken),
            failed=frozenset(name for name, running in grounded.items() if running.task_failure),
            requires={name: self._required(running.design) for name, running in grounded.items()},
        )

    def _what_counts(self, facts: Facts, now: float) -> tuple[object, ...]:
        passed = frozenset(
            (name, quality)
            for (name, quality), level in facts.levels.items()
            if quality in self.objectives[name].limits
            and self._kb.qualities[quality].violates(level, self.objectives[name].limits[quality])
        )
        waits = tuple((self._is_busy(r, now), now < r.not_before) for r in self._running.values())
        improves = tuple((tuple(r.updatable), now < r.calm_until) for r in self._running.values() if r.updatable)
        return (
            replace(facts, levels={}),
            frozenset(facts.levels),
            passed,
            waits,
            improves,
            self._has_waited(now),
            frozenset(self._error_log),
        )

    def _has_waited(self, now: float) -> bool:
        """Return whether the time is over in which a running configuration is waited for."""
        return self._started is not None and now - self._started >= self.settings.start_grace

    def _heed_recoveries(self) -> None:
        """A return counts once, for every objective; after that the component simply works."""
        for name, component in self._components.items():
            if component.status != v.RECOVERED or self.facts.components.get(name) != v.RECOVERED:
                continue
            for objective, result in self.analysis.objectives.items():
                if v.UPDATABLE in result.causes:
                    words = f"component {name} works again"
                    self._running[objective].updatable[f"component:{name}"] = component.stamp, words
            self._components[name] = _Component(v.WORKS, component.stamp)

    def _analysis_of_components(self) -> Analysis:
        """Return the last analysis, or a new one where components have changed since."""
        components = {name: component.status for name, component in self._components.items()}
        if self._analysed is not None and self._analysed.components == components:
            return self.analysis
        return self._kb.analyse(Facts(components=components), self._reasoner)

    # Decisions

    def _decide_all(self, timing: _Timing) -> list[Decision]:
        """Decide for every objective in trouble, from the roots down, until something is to be done."""
        decisions: list[Decision] = []
        chosen = None
        for name in self._needed(
            self._deployments()
        ):  # what a root's design requires is released where the root takes another one
            decision = self._decide(name, timing)
            if decision and decision.state == DECIDED:  # the others' turn comes after it
                chosen = decision
                break
            decisions += [decision] if decision else []
        found = decisions + self._put_forward(chosen, timing.now)
        self._match_requirements()
        return found

    def _put_forward(self, decision: Decision | None, now: float) -> list[Decision]:
        """Have a decision carried out, or approved first; a proposal that no longer holds is withdrawn."""
        former = self._proposal
        target = (decision.objective, decision.to_configuration) if decision else None
        if former and (former.objective, former.to_configuration) == target:
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

    def _decide(self, name: str, timing: _Timing) -> Decision | None:
        """Decide for an objective: another design of its own, else of one that requires it; else tell why not."""
        running = self._running[name]
        causes = self._causes(name, timing.now)
        if not causes:
            running.refusal = ()
            self._wanted.pop(name, None)
            return None
        if self._waits(name, timing.now):
            return None
        improves_only = all(cause.trigger in running.updatable for cause in causes)
        running.updatable.clear()
        self._note_failure(name, timing.now)
        began = self._wall()
        level, outcome = self._choose(name, timing.now, climbs=not improves_only)
        if self._waits(level, timing.now):
            return None
        stays = not self._is_change(level, outcome)
        if improves_only and (stays or not self._improves(running, outcome)):
            return None
        if not stays:
            return self._adapt(name, level, outcome, causes, timing, began)
        return self._refuse(name, outcome, causes, timing, self._wall() - began)

    def _choose(self, name: str, now: float, *, climbs: bool) -> tuple[str, Plan]:
        """Return the objective to find another design for, and what to do for it.

        It is the given one where a design of its own helps, else the nearest one above where one helps in full, else
        the nearest one where a design helps in part.
        """
        outcomes: dict[str, Plan] = {}
        queue = [name]
        while queue:
            objective = queue.pop(0)
            outcomes[objective] = outcome = self._plan(objective, now)
            if self._is_change(objective, outcome) and not outcome.degraded:
                return objective, outcome
            if climbs:
                queue += [o for o in self._requirers(objective) if o not in outcomes and o not in queue]
        partly = (o for o, outcome in outcomes.items() if self._is_change(o, outcome))
        best = next(partly, name)
        return best, outcomes[best]

    def _is_change(self, name: str, outcome: Plan) -> bool:
        running = self._running[name]
        return outcome.choice is not None and (outcome.choice != running.design or running.is_broken)

    def _adapt(
        self, name: str, level: str, outcome: Plan, causes: list[Cause], timing: _Timing, began: float
    ) -> Decision | None:
        """Return the decision for the first thing to be done towards an outcome: the deepest requirement first."""
        steps = self._missing(level, outcome, timing.now)
        objective, first = steps[0]
        locked = [o for o, _ in steps if o in self._locked]
        if locked:
            reason = f"locked by the operator; {outcome.choice} would be taken: {outcome.reason}"
            return self._refuse(name, replace(outcome, reason=reason), causes, timing, self._wall() - began)
        self._wanted.update({o: plan.choice for o, plan in steps if plan.choice})
        if any(self._waits(o, timing.now) for o, _ in steps if o in self._running):
            return None
        running = self._running.get(objective)
        if self.settings.dry_run and not self._is_news(self._running[name], causes, outcome):
            return None
        design = running.design if running else None
        words = f"{name}: {'; '.join(cause.text for cause in causes)}: "
        if objective != name:
            words += f"{objective}: "
        words += f"{design or 'nothing'} -> {first.choice}"
        if objective != level:
            words += f", which {outcome.choice} of {level} requires: {first.reason}"
        words += f": {outcome.reason}"
        self._match_requirements()
        releases = set(self.objectives) - set(self._needed({**self._deployments(), **self._wanted}))
        decision = self._decision(objective, causes, first, timing, words, self._wall() - began)
        return replace(
            decision,
            state=ADVISED if self.settings.dry_run else DECIDED,
            to_configuration=first.choice or "",
            releases=tuple(sorted(releases)) if objective == level else (),
        )

    def _refuse(
        self, name: str, outcome: Plan, causes: list[Cause], timing: _Timing, plan_wall: float
    ) -> Decision | None:
        """Return the decision to leave things as they are; it is told once."""
        running = self._running[name]
        self._wanted.pop(name, None)
        if not self._is_news(running, causes, outcome):
            return None
        running.degraded = True
        text = "; ".join(cause.text for cause in causes)
        words = f"{name}: {text}: stays with {running.design or 'nothing'}: {outcome.reason}"
        return self._decision(name, causes, outcome, timing, words, plan_wall)

    def _is_news(self, running: _Running, causes: list[Cause], outcome: Plan) -> bool:
        refusal = (tuple(cause.trigger for cause in causes), outcome.choice, outcome.degraded)
        is_news, running.refusal = refusal != running.refusal, refusal
        return is_news

    def _decision(
        self, objective: str, causes: list[Cause], outcome: Plan, timing: _Timing, words: str, plan_wall: float
    ) -> Decision:
        """Return a refusal with everything that explains it."""
        self._count += 1
        running = self._running.get(objective)
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
            wall_began=self._wall(),
        )

    def _missing(self, name: str, outcome: Plan, now: float) -> list[tuple[str, Plan]]:
        """Return what is to be deployed for an outcome, the deepest requirement first, the objective itself last."""
        steps: list[tuple[str, Plan]] = []
        for function in self._kb.designs[outcome.choice or ""].requires:
            provider = self._provider(function)
            if not self._is_fine(provider):
                found = self._plan(provider, now, function)
                if found.choice:
                    steps += [s for s in self._missing(provider, found, now) if s[0] not in {o for o, _ in steps}]
            else:
                below = self._running[provider].design
                fine = Plan(below, False, (), "")
                steps += [s for s in self._missing(provider, fine, now)[:-1] if s[0] not in {o for o, _ in steps}]
        return [*steps, (name, outcome)]

    def _is_fine(self, name: str) -> bool:
        """Return whether an objective is grounded and not in error."""
        running = self._running.get(name)
        if running is None or running.design is None or running.is_broken or running.task_failure:
            return False
        result = self.analysis.objectives.get(name)
        return running.design not in self.analysis.unrealisable and not (result and result.in_error)

    def _note_failure(self, name: str, now: float) -> None:
        """Put the running design into the error log where it is known not to do."""
        running = self._running[name]
        if (running.design or "", name) in self.analysis.tried:
            reason = "did not keep a limit while deployed"
            if running.task_failure:
                reason = f"its task failed while it was deployed ({running.task_failure[1] or 'no reason given'})"
            self._note_in_vain(now, running.design or "", name, reason)
        if running.is_broken and running.design:
            self._note_in_vain(now, running.design, name, "did not run")

    def _note_in_vain(self, now: float, design: str, objective: str, reason: str) -> None:
        self._error_log[design, objective] = now + self.settings.error_log_expiry, reason

    # Causes

    def _causes(self, name: str, now: float) -> list[Cause]:
        """Return everything that asks for an adaptation of an objective itself, the earliest first."""
        running, result = self._running[name], self.analysis.objectives.get(name)
        if running.design is None:
            requirers = self._requirers(name)
            if not self._has_waited(now) or (name not in self._roots and not requirers):
                return []
            words = f"no configuration runs{f', which {requirers[0]} requires' if requirers else ''}"
            return [Cause(now, "initial", words)]
        causes: list[Cause] = []
        if result and v.IN_ERROR_COMPONENT in result.causes:
            causes += self._component_causes(name, now)
        if result and v.IN_ERROR_NFR in result.causes:
            causes += [self._violation(self.objectives[name], quality, now) for quality in result.violated]
        if running.task_failure:
            stamp, why = running.task_failure
            words = f"the task failed{f': {why}' if why else ''}"
            causes.append(Cause(stamp, f"task:{name}", words, "S9"))
        always = self.objectives[name].always_improve
        if not causes and (running.degraded or (self.settings.always_improve if always is None else always)):
            if now >= running.calm_until:
                causes = [
                    Cause(min(stamp, now), trigger, words, "compRecov" if trigger != "operator" else "")
                    for trigger, (stamp, words) in running.updatable.items()
                ]
        else:
            running.updatable.clear()
        return sorted(causes, key=lambda cause: (cause.stamp, cause.trigger))

    def _component_causes(self, name: str, now: float) -> list[Cause]:
        running = self._running[name]
        causes = []
        for component in self.analysis.unrealisable.get(running.design or "", ()):
            known = self._components.get(component)
            words = f"component {component}, which {running.design} requires, does not work"
            stamp = known.stamp if known else now
            causes.append(Cause(stamp, f"component:{component}", words, "compError, compErrFG, S1a"))
        inherited = any(
            (result := self.analysis.objectives.get(o)) and result.in_error for o in self._required(running.design)
        )
        if running.is_broken or not (causes or inherited):
            words = f"configuration {running.design} does not run"
            causes.append(Cause(running.failed_stamp or now, f"component:{running.design}", words, "S1a"))
        return causes

    def _violation(self, objective: Objective, quality: str, now: float) -> Cause:
        level, limit = self._levels[objective.name, quality], objective.limits[quality]
        since = level.passed_since if level.passed_since is not None else now
        kind = self._kb.qualities[quality]
        return Cause(
            stamp=since,
            trigger=f"qa:{quality}",
            text=f"{quality} {level.value:.3g} {kind.operator} {limit:g} for {now - since:.1f} s",
            rules="QA, S9",
            quality=quality,
            level=level.value,
            limit=limit,
            excess=kind.excess(level.value, limit) / (abs(limit) or 1.0),
        )

    # Plans

    def _improves(self, running: _Running, outcome: Plan) -> bool:
        if running.degraded and not outcome.degraded:
            return True
        now = self._utility(self._kb.designs[running.design]) if running.design else -math.inf
        return not running.degraded and outcome.candidates[0].utility >= now + self.settings.improvement

    def _plan(self, name: str, now: float, function: str = "") -> Plan:
        """Return what to deploy for an objective, or for a function that none asks for yet."""
        objective = self.objectives.get(name) or Objective(name, function)
        running = self._running.get(name) or _Running()
        designs: tuple[Design, ...] = self._kb.solving(objective.function)
        unfulfilled: dict[str, list[str]] = {}
        strained: dict[str, list[str]] = {}
        for design in designs:
            for required in design.requires:
                provider = self._provider(required)
                outcome = None if self._is_fine(provider) else self._plan(provider, now, required)
                if outcome and (outcome.choice is None or outcome.degraded):
                    kind = unfulfilled if outcome.choice is None else strained
                    kind.setdefault(design.name, []).append(required)
        situation = Situation(
            qualities=self._kb.qualities,
            unrealisable=self.analysis.unrealisable,
            unfulfilled=unfulfilled,
            strained=strained,
            tried={
                design: f"{reason}, not again for {expiry - now:.0f} s"
                for (design, tried_for), (expiry, reason) in self._error_log.items()
                if tried_for == name
            },
            current=None if running.is_broken else running.design,
            observed=self._levels.latest(name),
            factors=self._factors(name, now),
            worth=self.settings.worth,
        )
        desired = self.settings.desired
        is_possible = situation.can_deploy(desired) and desired not in strained and desired not in situation.tried
        if running.design is None and is_possible:
            designs = tuple(design for design in designs if design.name == desired) or designs
        return plan(objective, designs, situation, self._utility, self._distance)

    def _factors(self, name: str, now: float) -> dict[str, float]:
        """Return by how much the expected levels of qualities are to be multiplied: never towards the better."""
        objective = self.objectives.get(name)
        if not self.settings.correct_expected or objective is None:
            return {}
        most = max(1.0, self.settings.correction_limit)
        found = {}
        for quality in objective.limits:
            ratio = self._levels.ratio(now, (name, quality))
            if ratio is not None and quality in self._kb.qualities:
                lower_is_better = self._kb.qualities[quality].direction is Direction.LOWER_IS_BETTER
                found[quality] = min(max(1.0, ratio), most) if lower_is_better else max(min(1.0, ratio), 1.0 / most)
        return found

    def _corrections(self, name: str, now: float) -> tuple[str, ...]:
        limit = self.settings.correction_limit
        return tuple(
            f"{quality} was {self._levels.ratio(now, (name, quality)) or 1.0:.3g} times what was expected of "
            f"{self._running[name].design}: {factor:.3g} times (at most {limit:g}) is expected of the others"
            for quality, factor in self._factors(name, now).items()
            if round(factor, 2) != 1.0
        )
