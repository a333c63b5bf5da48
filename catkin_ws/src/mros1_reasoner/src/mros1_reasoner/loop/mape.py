"""The loop from facts to decisions, pure: R2 by a reasoner, R3 by the planner; time is an argument.

Facts come in by the `observe_` methods; `step` reasons when they have changed in a way that counts, and says what is to
be done; `report` takes in how it went. At most one decision is under way. Times are s of ROS time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from metacontrol_bags.decision import DECIDED, EXECUTED, FAILED, PROPOSED, Decision
from metacontrol_msgs.msg import FunctionGrounding

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Analysis, Facts, Objective
from mros1_reasoner.knowledge.reasoner import Reasoner
from mros1_reasoner.loop.causes import OPERATOR
from mros1_reasoner.loop.deliberation import Deliberation, Timing
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.loop.state import BUSY, Component, State
from mros1_reasoner.planning.planner import Distance, Utility, difference
from mros1_reasoner.planning.utility import make_utility


class MapeError(Exception):
    """A fact, a report or a wish does not fit; one line that says why."""


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
            utility: of a design; else as the settings say.
            distance: how big a change it is from one design to another.
            wall: wall clock that measures durations, s.
            clock: ROS time, for the stamps of what takes time within a step; without it, they are the step's.
            name: beginning of the decisions' ids.

        Raises:
            UtilityError: the utility function of the settings can't be made.
        """
        self._kb = knowledge_base
        self._reasoner = reasoner
        self.settings = settings or Settings()
        self._state = State(knowledge_base, objectives, self.settings)
        self._utility = utility or make_utility(self.settings.utility, knowledge_base.qualities)
        self._deliberation = Deliberation(self._state, self._utility, distance, wall, self._stamp, name)
        self._wall = wall
        self._clock = clock
        self._pending: Decision | None = None
        self._began = 0.0  # wall time at which the pending decision was put forward
        self._paused = False
        self._seen: tuple[object, ...] | None = None
        self._analysed: Facts | None = None

    @property
    def objectives(self) -> dict[str, Objective]:
        """Every objective by name, those included that designs require."""
        return self._state.objectives

    @property
    def facts(self) -> Facts:
        """The facts of the last analysis."""
        return self._state.facts

    @property
    def analysis(self) -> Analysis:
        """The last analysis."""
        return self._state.analysis

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
            design = self._kb.designs[self._state.running[name].design or ""]
            expected = design.expected.get(quality)
            self._state.levels.observe(now, (name, quality), level, passed=passed, stamp=stamp, expected=expected)

    def observe_stale(self, quality: str) -> None:
        """Take in that a quality can't be observed at present: its levels are no longer known."""
        self._state.levels.forget(quality=quality)

    def observe_component(self, now: float, component: str, status: str, stamp: float = 0.0) -> None:
        """Take in the status of a component; a return without RECOVERED is taken for one with it.

        Raises:
            MapeError: the component or the status is unknown.
        """
        if component not in self._kb.components:
            raise MapeError(f"component {component} is not in the model: its status is left out")
        if status not in v.COMPONENT_STATUSES:
            raise MapeError(f"component {component} has the unknown status {status!r}: expected TRUE, FALSE, RECOVERED")
        known = self._state.components.get(component)
        before = known.status if known else v.WORKS
        if status == v.WORKS and before in (v.FAILED, v.RECOVERED):
            status = v.RECOVERED
        elif status == v.RECOVERED and before == v.WORKS:
            status = v.WORKS  # it was never seen to fail, or its return has been heeded
        if known is None or status != before:
            self._state.components[component] = Component(status, stamp or now)

    def observe_binding(self, now: float, grounding: str, in_error: bool) -> None:
        """Take in that a binding of a grounding is in error, or no longer is.

        Raises:
            MapeError: no objective is grounded so.
        """
        for name, running in self._state.running.items():
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
        if not name and len(self._state.roots) == 1:
            names = list(self._state.roots)
        if not names:
            raise MapeError(f"task of {name or 'an objective without a name'}: known: {', '.join(self.objectives)}")
        for objective in names:
            running = self._state.running[objective]
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
        self._state.active[function] = configuration, state
        for name in [o.name for o in self.objectives.values() if o.function == function]:
            self._state.take_active(name, configuration, state, now)

    # What an operator asks for

    @property
    def proposal(self) -> Decision | None:
        """The decision that waits for approval."""
        return self._state.proposal

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
        self._state.locked |= self._named(objective)
        self._seen = None

    def unlock(self, objective: str = "") -> None:
        """Take `lock` back.

        Raises:
            MapeError: there is no such objective.
        """
        self._state.locked -= self._named(objective)
        self._seen = None

    def approve(self, decision_id: str) -> Decision:
        """Approve the proposed decision; it is now DECIDED, to be published and carried out.

        Raises:
            MapeError: no decision of that id waits for approval.
        """
        decision = replace(self._proposed(decision_id), state=DECIDED)
        self._state.proposal, self._pending, self._began = None, decision, self._wall()
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
        self._state.note_in_vain(now, decision.to_configuration, decision.objective, words)
        self._state.proposal, self._seen = None, None
        return replace(decision, state=FAILED, explanation=f"{decision.explanation}; {words}", stamp_executed=now)

    def add_objective(self, objective: Objective) -> None:
        """Ask for a function from now on.

        Raises:
            MapeError: the name is taken, or the model holds no such function or quality.
        """
        if objective.name in self._state.roots:
            raise MapeError(f"objective {objective.name} exists already: give another name")
        if objective.function not in self._kb.functions:
            known = ", ".join(self._kb.functions)
            raise MapeError(f"objective {objective.name}: no Function is called {objective.function!r}: known: {known}")
        for quality, limit in objective.limits.items():
            self._check_limit(quality, limit)
        self._state.roots[objective.name] = None
        self._state.add(objective)
        self._seen = None

    def remove_objective(self, name: str) -> None:
        """No longer ask for a function; objectives that only it required go with it.

        Raises:
            MapeError: there is no such objective, or a decision about it is being carried out.
        """
        if name not in self._state.roots:
            raise MapeError(f"no objective is called {name!r}: known: {', '.join(self._state.roots)}")
        if self._pending and (self._pending.objective == name or self._pending.objective not in self._state.roots):
            raise MapeError(f"objective {name} is being adapted: remove it afterwards")
        del self._state.roots[name]
        self._state.wanted.pop(name, None)
        self._state.drop(name)
        self._state.match_requirements()
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
        self._state.levels.forget(objective, quality)  # since when the limit is passed must be found anew
        words = (
            f"the operator {'has lifted the limit' if limit is None else f'wants a limit of {limit:g}'} of {quality}"
        )
        self._state.running[objective].updatable[OPERATOR] = math.inf, words
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
            self._kb.save(path, self._state.facts, self._state.analysis)
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
        if self._state.started is None:
            self._state.started = now
        if self._pending:
            return []
        self._state.error_log = {key: entry for key, entry in self._state.error_log.items() if entry[0] > now}
        self._state.match_requirements()
        facts = self._state.facts_at(now)
        seen = self._state.what_counts(facts, now)
        if seen == self._seen and not (heartbeat and facts != self._analysed):
            return []
        began = self._wall()
        analysis = self._kb.analyse(facts, self._reasoner)
        timing = Timing(now, self._stamp(now), self._wall() - began)
        self._state.facts, self._state.analysis = facts, analysis
        self._analysed, self._seen = facts, seen
        self._state.heed_recoveries()
        if self._paused:
            return []
        return self._decide_all(timing)

    def due(self, now: float) -> float | None:
        """Return the next time at which a step can bring something without a new fact, None where there is none."""
        times = [self._state.started + self.settings.start_grace] if self._state.started is not None else []
        times += self._state.levels.due({name: running.calm_until for name, running in self._state.running.items()})
        for running in self._state.running.values():
            times.append(running.not_before)
            if running.updatable:
                times.append(running.calm_until)
            if running.busy_since is not None:
                times.append(running.busy_since + self.settings.busy_limit)
        times += [expiry for expiry, _ in self._state.error_log.values()]
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
        running = self._state.running[decision.objective]
        if ok:
            if running.state in (*BUSY, FunctionGrounding.FAILED):
                running.state, running.busy_since = FunctionGrounding.STABLE, None
            self._state.deployed(decision.objective, decision.to_configuration, now)
            self._state.active[self.objectives[decision.objective].function] = (
                decision.to_configuration,
                FunctionGrounding.STABLE,
            )
            running.calm_until = now + self.settings.cool_down
            running.attempts = 0
            running.degraded = decision.degraded
        else:
            if blame:
                reason = f"could not be deployed ({message})" if message else "could not be deployed"
                self._state.note_in_vain(now, decision.to_configuration, decision.objective, reason)
            wait = min(self.settings.backoff * 2**running.attempts, self.settings.backoff_limit)
            running.not_before = now + wait
            running.attempts += 1
        return replace(
            decision,
            state=EXECUTED if ok else FAILED,
            explanation=decision.explanation + ("" if ok else f"; failed: {message or 'no reason given'}"),
            stamp_executed=now,
            execute_wall_s=self._wall() - self._began,
        )

    # Parts

    def _named(self, objective: str) -> set[str]:
        if objective and objective not in self.objectives:
            raise MapeError(f"no objective is called {objective!r}: known: {', '.join(self.objectives)}")
        return {objective} if objective else set(self.objectives)

    def _proposed(self, decision_id: str) -> Decision:
        if self._state.proposal is None or self._state.proposal.id != decision_id:
            raise MapeError(f"decision {decision_id} does not wait for approval")
        return self._state.proposal

    def _stamp(self, now: float) -> float:
        return max(now, self._clock()) if self._clock else now

    def _check_limit(self, quality: str, limit: float) -> None:
        if quality not in self._kb.qualities:
            raise MapeError(f"Unsupported QA TYPE received: {quality}")
        if not math.isfinite(limit):
            raise MapeError(f"limit of {quality} is {limit}, not a finite number: left as it is")

    def _observed_objectives(self, grounding: str) -> list[str]:
        grounded = [name for name, running in self._state.running.items() if running.design]
        named = [n for n in grounded if self._kb.grounding(n, self._state.running[n].design or "") == grounding]
        return named or grounded

    def _analysis_of_components(self) -> Analysis:
        """Return the last analysis, or a new one where components have changed since."""
        components = {name: component.status for name, component in self._state.components.items()}
        if self._analysed is not None and self._analysed.components == components:
            return self._state.analysis
        return self._kb.analyse(Facts(components=components), self._reasoner)

    def _decide_all(self, timing: Timing) -> list[Decision]:
        """Decide for every objective in trouble, from the roots down, until something is to be done."""
        decisions: list[Decision] = []
        chosen = None
        for name in self._state.needed(
            self._state.deployments()
        ):  # what a root's design requires is released where the root takes another one
            decision = self._deliberation.decide(name, timing)
            if decision and decision.state == DECIDED:  # the others' turn comes after it
                chosen = decision
                break
            decisions += [decision] if decision else []
        found = decisions + self._put_forward(chosen, timing.now)
        self._state.match_requirements()
        return found

    def _put_forward(self, decision: Decision | None, now: float) -> list[Decision]:
        """Have a decision carried out, or approved first; a proposal that no longer holds is withdrawn."""
        former = self._state.proposal
        target = (decision.objective, decision.to_configuration) if decision else None
        if former and (former.objective, former.to_configuration) == target:
            return []
        found = []
        if former:
            words = f"{former.explanation}; withdrawn: what called for it has changed"
            found.append(replace(former, state=FAILED, explanation=words, stamp_executed=now))
        self._state.proposal = decision if self.settings.approval else None
        if decision is None:
            return found
        if self.settings.approval:
            return [*found, replace(decision, state=PROPOSED)]
        self._pending, self._began, self._seen = decision, self._wall(), None
        return [*found, decision]
