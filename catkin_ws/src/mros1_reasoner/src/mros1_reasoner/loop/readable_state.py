"""The loop's knowledge, for reading only: objectives, running designs, facts, and failed attempts.

Only `state.State` changes it. Times are s of ROS time.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace

from metacontrol_bags.decision import Cause, Decision
from metacontrol_msgs.msg import FunctionGrounding

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Analysis, Facts, Objective, Past
from mros1_reasoner.knowledge.scale import Scale
from mros1_reasoner.loop.levels import Levels
from mros1_reasoner.loop.repairs import Repairs
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.loop.surroundings import Surroundings

BUSY = (FunctionGrounding.RECONFIGURING, FunctionGrounding.RECOVERING)

_RELAPSE = 5.0  # times the calm after which a better design was taken again: a violation then is a new one


class MapeError(Exception):
    """A fact, a report or a command does not fit; one line that says why."""


@dataclass(frozen=True)
class Component:
    """The last status of a component, the stamp of the diagnostic that reported it first, and why it has failed."""

    status: str
    stamp: float
    reason: str = ""

    @property
    def failure(self) -> str:
        """That it does not work, in words, and why, if that is known."""
        return f"does not work ({self.reason})" if self.reason else "does not work"


@dataclass(frozen=True)
class Drift:
    """Parameters of a node that do not have the values of the deployed design.

    Attributes:
        parameters: their names.
        since: stamp of the diagnostic that reported it first.
        seen: when it was reported last.
        is_left: whether they are left as they are, because they drift again and again.
    """

    parameters: str
    since: float
    seen: float
    is_left: bool = False


@dataclass(frozen=True)
class Running:
    """What runs for an objective.

    Attributes:
        design: the deployed design; None while there is none.
        state: of the grounding, as the manipulator says.
        busy_since: when the present reconfiguration began.
        failed_stamp: when the grounding was first known not to run.
        binding_error: whether a binding of it is in error.
        failed_nodes: nodes of the design that do not work.
        deployed_at: when the design was deployed last.
        restarts: when the design was deployed again because nodes of it did not work.
        drifts: drifted parameters, by node.
        drifts_from: reports of drifted parameters are old ones before this moment.
        put_back: when the parameters of a node were put back, by node.
        task_failure: when the task of the objective has failed, and why.
        calm_until: no limit counts before.
        not_before: no request is made before.
        attempts: failed requests in a row.
        replaced: the design in whose place the deployed one was requested.
        brief: deployments in a row that did not last.
        retry_from: a design that has failed is not tried again before.
        vanished: the design that ran until nothing did; empty: one runs, or another one was wanted since.
        ending: how the design has ended soon after it was deployed; empty: it has not.
        degraded: whether the design was taken although it does not keep every limit.
        refusal: the last refusal, so that it is told once.
        chances: why a better design may have become available: trigger -> when, and in words.
        way: why a better design was chosen that waits for what it requires.
        returned_at: when a better design was taken again because the cause of a violation was gone.
        relapses: how often in a row a limit was violated again soon after that.
        ruled_since: since when a rule of the model finds its quality in error; None: none does.
    """

    design: str | None = None
    state: str = ""
    busy_since: float | None = None
    failed_stamp: float = 0.0
    binding_error: bool = False
    failed_nodes: tuple[str, ...] = ()
    deployed_at: float = -math.inf
    restarts: tuple[float, ...] = ()
    drifts: Mapping[str, Drift] = field(default_factory=dict)
    drifts_from: float = -math.inf
    put_back: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    task_failure: tuple[float, str] | None = None
    calm_until: float = -math.inf
    not_before: float = -math.inf
    attempts: int = 0
    replaced: str | None = None
    brief: int = 0
    retry_from: float = -math.inf
    vanished: str = ""
    ending: str = ""
    degraded: bool = False
    refusal: tuple[object, ...] = ()
    chances: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    way: tuple[Cause, ...] = ()
    returned_at: float = -math.inf
    relapses: int = 0
    ruled_since: float | None = None

    @property
    def is_broken(self) -> bool:
        """Whether the design is known not to run, or not as a whole."""
        return self.state == FunctionGrounding.FAILED or self.binding_error

    @property
    def to_put_back(self) -> tuple[str, ...]:
        """Nodes whose parameters have drifted and are to be put back."""
        return tuple(sorted(node for node, drift in self.drifts.items() if not drift.is_left))


class View:
    """All facts and objectives at this moment.

    Attributes:
        kb: the models.
        settings: how the loop behaves.
        objectives: every objective by name, those included that designs require.
        roots: names of the objectives that were asked for.
        in_reserve: objectives of the models that are pursued only while a design requires their function, by function.
        running: what runs, by objective.
        active: configuration and state of each function, as the manipulator says.
        wanted: by objective, the design that waits for what it requires.
        released: functions that nothing needs any longer although they run, in the order in which to release them.
        unneeded: functions that a reasoner before this one was to release, in that order; not all need run.
        components: last status of components.
        failed_before: components that did not work when a reasoner before this one died, and are not heard of yet.
        levels: observed levels.
        surroundings: what is known of them.
        repairs: what is known of the repairs of components.
        change_duration: how long a change takes, by the last ones, s.
        error_log: until when a design is not tried again for an objective, and why.
        rejections: until when a design is not proposed again for an objective, because an operator has rejected it.
        history: the last decisions that have been carried out or have failed.
        retries: from when on a design that failed may replace a working one of an objective, and why it failed.
        makeshifts: designs that did not keep every limit for a reasoner before this one, until one is deployed.
        locked: objectives that keep their configuration; some may come into being later.
        paused: whether nothing is decided.
        proposal: decision that waits for approval.
        pending: decision that is under way.
        pending_since: wall time at which it was put forward, s.
        started: time of the first step; None before.
        has_analysed: whether there was an analysis.
        facts: those of the last analysis.
        analysis: the last one.
        seen: what counted at the last analysis; None where the next step analyses anyway.
    """

    kb: KnowledgeBase
    settings: Settings
    objectives: Mapping[str, Objective]
    roots: Collection[str]
    in_reserve: Mapping[str, Objective]
    running: Mapping[str, Running]
    active: Mapping[str, tuple[str, str]]
    wanted: Mapping[str, str]
    released: Collection[str]
    unneeded: Collection[str]
    components: Mapping[str, Component]
    failed_before: Set[str]
    levels: Levels
    surroundings: Surroundings
    repairs: Repairs
    error_log: Mapping[tuple[str, str], tuple[float, str]]
    rejections: Mapping[tuple[str, str], float]
    history: Sequence[Past]
    retries: Mapping[tuple[str, str], tuple[float, str]]
    makeshifts: Mapping[str, str]
    locked: Set[str]
    paused: bool
    proposal: Decision | None
    pending: Decision | None
    pending_since: float
    started: float | None
    has_analysed: bool
    facts: Facts
    analysis: Analysis
    seen: tuple[object, ...] | None

    # Objectives, and those that designs require

    def named(self, objective: str) -> set[str]:
        """Return the objective of a name; all objectives if the name is empty.

        Raises:
            MapeError: there is no such objective.
        """
        if objective and objective not in self.objectives:
            raise MapeError(f"no objective is called {objective!r}: known: {', '.join(self.objectives)}")
        return {objective} if objective else set(self.objectives)

    def pursuing(self, name: str) -> list[str]:
        """Return the objectives of that name or function; without a name, the only root objective.

        Raises:
            MapeError: there is none.
        """
        names = [o.name for o in self.objectives.values() if name in (o.name, o.function)]
        if not name and len(self.roots) == 1:
            names = list(self.roots)
        if not names:
            raise MapeError(f"task of {name or 'an objective without a name'}: known: {', '.join(self.objectives)}")
        return names

    def grounded_by(self, grounding: str) -> list[str]:
        """Return the objectives with a grounding of that name; if there is none, all grounded objectives."""
        grounded = [name for name, running in self.running.items() if running.design]
        named = [n for n in grounded if self.kb.grounding(n, self.running[n].design or "") == grounding]
        return named or grounded

    def provider(self, function: str) -> str:
        """Return the name of the objective that provides a function to the designs that require it."""
        root = next((name for name in self.roots if self.objectives[name].function == function), None)
        if root:
            return root
        reserve = self.in_reserve.get(function)
        name = reserve.name if reserve else f"o_{function.removeprefix('f_')}"
        return name if name not in self.roots else f"o_{function}"

    def foreseen(self) -> dict[str, str]:
        """Return the objectives that designs may require, with the function of each."""
        functions = {function for design in self.kb.designs.values() for function in design.requires}
        return {self.provider(function): function for function in sorted(functions)}

    def objective_of(self, function: str) -> Objective:
        """Return the objective that provides a function to the designs that require it, as it is at its start."""
        name = self.provider(function)
        known = self.objectives.get(name)
        return known or replace(self.in_reserve.get(function) or Objective(name, function), name=name)

    def limits_of(self, name: str) -> Mapping[str, float]:
        """Return the limits of an objective, or those that it will have when a design requires it."""
        known = self.objectives.get(name)
        return (known or self.objective_of(self.foreseen()[name])).limits

    def required(self, design: str | None) -> tuple[str, ...]:
        """Return the objectives that a design requires."""
        return tuple(self.provider(f) for f in self.kb.designs[design].requires) if design else ()

    def requirers(self, name: str) -> list[str]:
        """Return the objectives whose running design requires an objective."""
        return [o for o in self.objectives if name in self.required(self.running[o].design)]

    def deployments(self) -> dict[str, str]:
        """Return the design that runs by objective."""
        return {name: running.design for name, running in self.running.items() if running.design}

    def needed(self, *deployments: Mapping[str, str]) -> dict[str, str]:
        """Return the objectives that deployments need, with the function of each, from the roots down."""
        needed = {name: self.objectives[name].function for name in self.roots}
        queue = list(needed)
        while queue:
            name = queue.pop(0)
            for design in {deployment[name]: None for deployment in deployments if name in deployment}:
                for function in self.kb.designs[design].requires:
                    provider = self.provider(function)
                    if provider not in needed:
                        needed[provider] = function
                        queue.append(provider)
        return needed

    def failed_nodes_of(self, design: str | None) -> tuple[str, ...]:
        """Return the nodes of a design that do not work, as far as is known."""
        nodes = self.kb.designs[design].nodes if design else ()
        known = ((node, self.components.get(node)) for node in sorted(nodes))
        return tuple(node for node, component in known if component and component.status == v.FAILED)

    @property
    def change_duration(self) -> float:
        """How long a change takes, s."""
        raise NotImplementedError

    def runs(self, name: str) -> bool:
        """Return whether a design runs for an objective, be it with errors."""
        running = self.running.get(name)
        return running is not None and running.design is not None and running.state != FunctionGrounding.FAILED

    # Facts

    def is_busy(self, running: Running, now: float) -> bool:
        """Return whether a reconfiguration is still going on."""
        since = running.busy_since
        return running.state in BUSY and since is not None and now - since < self.settings.busy_limit

    def waits(self, name: str, now: float) -> bool:
        """Return whether an objective can't be adapted at this moment."""
        running = self.running[name]
        return self.is_busy(running, now) or now < running.not_before

    def why_failed(self, name: str, design: str | None) -> str:
        """Return why a design has failed for an objective a short while ago; empty where it has not."""
        return self.error_log.get((design or "", name), (0.0, ""))[1]

    def retries_later(self, name: str, design: str | None, now: float) -> bool:
        """Return whether a design can't be tried yet, because it has failed and the last deployments did not last."""
        return name in self.running and now < self.running[name].retry_from and bool(self.why_failed(name, design))

    def facts_at(self, now: float) -> Facts:
        """Return the present facts, for an analysis."""
        grounded = {name: running for name, running in self.running.items() if running.design}
        return Facts(
            objectives=tuple(self.objectives.values()),
            groundings={name: running.design or "" for name, running in grounded.items()},
            levels=self.levels.present(now),
            components={
                name: component.status for name, component in self.components.items() if name not in self.kb.unread
            },
            broken=frozenset(name for name, running in grounded.items() if running.is_broken or running.failed_nodes),
            failed=frozenset(name for name, running in grounded.items() if running.task_failure),
            requires={name: self.required(running.design) for name, running in grounded.items()},
            tried=frozenset(self.error_log) if self.kb.reads_error_log else frozenset(),
            history=tuple(self.history) if self.kb.reads_history else (),
            surroundings=dict(self.surroundings.values),
        )

    def what_counts(self, facts: Facts, now: float) -> tuple[object, ...]:
        """Return all that an analysis and a decision depend on: while it stays the same, so do both results."""
        passed = frozenset(
            (name, quality)
            for (name, quality), level in facts.levels.items()
            if quality in self.objectives[name].limits
            and self.kb.qualities[quality].violates(level, self.objectives[name].limits[quality])
        )
        waits = tuple((self.is_busy(r, now), now < r.not_before, now < r.retry_from) for r in self.running.values())
        improves = tuple((tuple(r.chances), now < r.calm_until) for r in self.running.values() if r.chances)
        levels = {key: level for key, level in facts.levels.items() if key[1] in self.kb.levels_read}
        return (
            replace(facts, levels=levels, surroundings=facts.surroundings if self.kb.reads_environment else {}),
            frozenset(self.surroundings.unmet),
            frozenset(facts.levels),
            passed,
            self.violations(now),
            self.relieved(now),
            frozenset(name for name in self.running if self.rule_counts(name, now)),
            tuple(running.failed_nodes for running in self.running.values()),
            tuple((n, d.parameters, d.is_left) for r in self.running.values() for n, d in r.drifts.items()),
            waits,
            improves,
            self.has_waited(now),
            self.repairs.what_counts(now),
            frozenset(self.error_log),
            frozenset(self.rejections),
        )

    def scale(self, quality: str, limit: float | None = None) -> Scale:
        """Return how levels of a quality are compared."""
        found = self.kb.scale(quality)
        return found if limit is None or limit > 0.0 else replace(found, is_ratio=False)

    def violations(self, now: float) -> frozenset[tuple[str, str]]:
        """Return the objectives and qualities whose limits are violated so that it counts."""
        return self.levels.violations(now, self._calm_until())

    def rule_finds(self, name: str, status: str) -> bool:
        """Return whether a rule of the model finds what runs for an objective in error, and nothing else does.

        Args:
            name: of the objective.
            status: the error, of quality or of a component.
        """
        running, result = self.running[name], self.analysis.objectives.get(name)
        below = [self.analysis.objectives.get(required) for required in self.required(running.design)]
        if result is None or any(found and status in found.causes for found in below):
            return False
        if status == v.IN_ERROR_NFR:
            is_known = bool(result.violated) or name in self.facts.failed
            return status in result.grounding_causes or (status in result.causes and not is_known)
        is_known = name in self.facts.broken or bool(self.analysis.unrealisable.get(running.design or ""))
        is_known |= bool(running.design and self.kb.designs[running.design].lacks(self.facts.surroundings))
        return status in result.causes and not is_known

    def rule_counts(self, name: str, now: float) -> bool:
        """Return whether a rule of the model finds the quality of what runs in error, for long enough to count."""
        running = self.running[name]
        since = running.ruled_since
        return since is not None and now >= max(since + self.settings.violation_window, running.calm_until)

    def is_relieved(self, name: str, now: float) -> bool:
        """Return whether the causes for which designs of an objective were left have been gone for long enough."""
        gone = self.levels.gone_since(now, name)
        return gone is not None and now - gone >= self.calm(name)

    def relieved(self, now: float) -> frozenset[str]:
        """Return the objectives of which that holds."""
        return frozenset(name for name in self.running if self.is_relieved(name, now))

    def is_relapse(self, name: str, now: float) -> bool:
        """Return whether a violation now comes soon after the return to a better design."""
        return now - self.running[name].returned_at <= _RELAPSE * self.calm(name)

    def calm(self, name: str) -> float:
        """Return how long those causes must be gone, s."""
        return self.settings.calm_after(self.running[name].relapses)

    def _calm_until(self) -> dict[str, float]:
        return {name: running.calm_until for name, running in self.running.items()}

    def beyond(self, objective: Objective) -> tuple[str, ...]:
        """Return the limits that what runs for an objective does not keep, by observed levels, else by expected ones.

        Args:
            objective: what the limits are of; one of its name is pursued.
        """
        design = self.running[objective.name].design
        if design is None:
            return ()
        known = {**self.kb.designs[design].expected, **self.levels.high(math.inf, objective.name)}
        limits = {quality: limit for quality, limit in sorted(objective.limits.items()) if quality in known}
        return tuple(q for q, limit in limits.items() if self.kb.qualities[q].violates(known[q], limit))

    def has_waited(self, now: float) -> bool:
        """Return whether the loop has waited long enough for a running configuration."""
        return self.started is not None and now - self.started >= self.settings.start_grace

    def is_fine(self, name: str) -> bool:
        """Return whether an objective is grounded and not in error."""
        running = self.running.get(name)
        if running is None or running.design is None or running.task_failure:
            return False
        if running.is_broken or running.failed_nodes:
            return False
        result = self.analysis.objectives.get(name)
        return running.design not in self.analysis.unrealisable and not (result and result.in_error)

    def due(self, now: float) -> float | None:
        """Return when the next step is needed even without a new fact; None where none is."""
        times = [self.started + self.settings.start_grace] if self.started is not None else []
        times += self.levels.due(self._calm_until())
        times += self.repairs.due()
        for name, running in self.running.items():
            gone = self.levels.gone_since(now, name)
            if gone is not None:
                times.append(gone + self.calm(name))
            times += [running.not_before, running.retry_from]
            if running.chances:
                times.append(running.calm_until)
            if running.ruled_since is not None:
                times += [running.ruled_since + self.settings.violation_window, running.calm_until]
            if running.busy_since is not None:
                times.append(running.busy_since + self.settings.busy_limit)
            times += [drift.seen + self.settings.level_timeout for drift in running.drifts.values()]
            if self.failed_nodes_of(running.design):
                times.append(running.deployed_at + self.settings.restart_grace)
        times += [moment for entries in (self.error_log, self.retries) for moment, _ in entries.values()]
        times += self.rejections.values()
        return min((moment for moment in times if now < moment < math.inf), default=None)
