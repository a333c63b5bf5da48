"""What the loop knows: objectives, what runs for each of them, facts, and what was tried in vain. Times in s."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from metacontrol_bags.decision import Decision
from metacontrol_msgs.msg import FunctionGrounding

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Analysis, Facts, Objective
from mros1_reasoner.loop.levels import Levels
from mros1_reasoner.loop.settings import Settings

BUSY = (FunctionGrounding.RECONFIGURING, FunctionGrounding.RECOVERING)


@dataclass
class Component:
    """The last status of a component."""

    status: str
    stamp: float  # of the diagnostic that reported the status first


@dataclass
class Running:
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
        """Whether the design is known not to run, or not as a whole."""
        return self.state == FunctionGrounding.FAILED or self.binding_error


class State:
    """What is known and asked for at this moment.

    Attributes:
        objectives: every objective by name, those included that designs require.
        roots: names of the objectives that were asked for.
        running: what runs, by objective.
        active: configuration and state of each function, as the manipulator says.
        wanted: by objective, the design that waits for what it requires.
        components: last status of components.
        levels: observed levels.
        error_log: until when a design is not tried again for an objective, and why.
        locked: objectives that keep their configuration.
        proposal: decision that waits for approval.
        started: time of the first step.
        facts: those of the last analysis.
        analysis: the last one.
    """

    def __init__(self, knowledge_base: KnowledgeBase, objectives: Iterable[Objective], settings: Settings) -> None:
        """Know the objectives, and that nothing runs."""
        self.kb, self.settings = knowledge_base, settings
        self.objectives = {objective.name: objective for objective in objectives}
        self.roots = dict.fromkeys(self.objectives)
        self.running = {objective: Running() for objective in self.objectives}
        self.active: dict[str, tuple[str, str]] = {}
        self.wanted: dict[str, str] = {}
        self.components = {c: Component(s, 0.0) for c, s in knowledge_base.component_statuses.items()}
        self.levels = Levels(settings.violation_window, settings.level_timeout, settings.correction_memory)
        self.error_log: dict[tuple[str, str], tuple[float, str]] = {}
        self.locked: set[str] = set()
        self.proposal: Decision | None = None
        self.started: float | None = None
        self.facts = Facts()
        self.analysis = Analysis()

    # Objectives, and those that designs require

    def add(self, objective: Objective) -> None:
        """Have one more objective; what runs for its function already is taken over."""
        self.objectives[objective.name] = objective
        self.running[objective.name] = Running()
        active = self.active.get(objective.function)
        if active:
            self.take_active(objective.name, *active, now=-math.inf)

    def drop(self, name: str) -> None:
        """Forget an objective and everything that is known of it."""
        if self.proposal and self.proposal.objective == name:
            self.proposal = None
        del self.objectives[name], self.running[name]
        self.locked.discard(name)
        self.levels.drop(name)
        self.error_log = {key: entry for key, entry in self.error_log.items() if key[1] != name}

    def provider(self, function: str) -> str:
        """Return the name of the objective by which a function is provided to the designs that require it."""
        root = next((name for name in self.roots if self.objectives[name].function == function), None)
        if root:
            return root
        name = f"o_{function.removeprefix('f_')}"
        return name if name not in self.roots else f"o_{function}"

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

    def match_requirements(self) -> None:
        """Have an objective for every function that is required, and release those that no longer are."""
        while True:  # what runs for a new objective may require further ones
            needed = self.needed(self.deployments(), self.wanted)
            missing = {name: function for name, function in needed.items() if name not in self.objectives}
            if not missing:
                break
            for name, function in missing.items():
                self.add(Objective(name, function))
        for name in [name for name in self.objectives if name not in needed]:
            self.wanted.pop(name, None)
            self.drop(name)

    def take_active(self, name: str, configuration: str, state: str, now: float) -> None:
        """Take in what runs for an objective, as the manipulator says."""
        running = self.running[name]
        if state in BUSY:
            running.busy_since = running.busy_since if running.state in BUSY else now
        if state != running.state and state == FunctionGrounding.FAILED:
            running.failed_stamp = max(now, 0.0)  # 0: before anything was asked for
        running.state = state
        if state != FunctionGrounding.RECONFIGURING and running.design != configuration:
            self.deployed(name, configuration, now)  # while it reconfigures, it may be the old or the new one

    def deployed(self, objective: str, design: str, now: float) -> None:
        """Note that a design runs: what was observed of the one before it says nothing of this one."""
        running = self.running[objective]
        if running.design is not None and running.design != design:
            running.calm_until = max(running.calm_until, now + self.settings.cool_down)
        running.design = design
        running.degraded = False
        running.binding_error = False
        running.task_failure = None
        running.refusal = ()
        if self.wanted.get(objective) == design:
            del self.wanted[objective]
        self.levels.forget(objective, now=now)

    # Facts

    def is_busy(self, running: Running, now: float) -> bool:
        """Return whether somebody is still reconfiguring it."""
        since = running.busy_since
        return running.state in BUSY and since is not None and now - since < self.settings.busy_limit

    def waits(self, name: str, now: float) -> bool:
        """Return whether nothing can be asked for an objective at this moment."""
        running = self.running[name]
        return self.is_busy(running, now) or now < running.not_before

    def facts_at(self, now: float) -> Facts:
        """Return what is known now, for an analysis."""
        grounded = {name: running for name, running in self.running.items() if running.design}
        return Facts(
            objectives=tuple(self.objectives.values()),
            groundings={name: running.design or "" for name, running in grounded.items()},
            levels=self.levels.counting(now, {name: running.calm_until for name, running in self.running.items()}),
            components={name: component.status for name, component in self.components.items()},
            broken=frozenset(name for name, running in grounded.items() if running.is_broken),
            failed=frozenset(name for name, running in grounded.items() if running.task_failure),
            requires={name: self.required(running.design) for name, running in grounded.items()},
        )

    def what_counts(self, facts: Facts, now: float) -> tuple[object, ...]:
        """Return what an analysis and a decision depend on: while it is the same, neither can bring anything new."""
        passed = frozenset(
            (name, quality)
            for (name, quality), level in facts.levels.items()
            if quality in self.objectives[name].limits
            and self.kb.qualities[quality].violates(level, self.objectives[name].limits[quality])
        )
        waits = tuple((self.is_busy(r, now), now < r.not_before) for r in self.running.values())
        improves = tuple((tuple(r.updatable), now < r.calm_until) for r in self.running.values() if r.updatable)
        return (
            replace(facts, levels={}),
            frozenset(facts.levels),
            passed,
            waits,
            improves,
            self.has_waited(now),
            frozenset(self.error_log),
        )

    def has_waited(self, now: float) -> bool:
        """Return whether the time is over in which a running configuration is waited for."""
        return self.started is not None and now - self.started >= self.settings.start_grace

    def heed_recoveries(self) -> None:
        """A return counts once, for every objective; after that the component simply works."""
        for name, component in self.components.items():
            if component.status != v.RECOVERED or self.facts.components.get(name) != v.RECOVERED:
                continue
            for objective, result in self.analysis.objectives.items():
                if v.UPDATABLE in result.causes:
                    words = f"component {name} works again"
                    self.running[objective].updatable[f"component:{name}"] = component.stamp, words
            self.components[name] = Component(v.WORKS, component.stamp)

    def is_fine(self, name: str) -> bool:
        """Return whether an objective is grounded and not in error."""
        running = self.running.get(name)
        if running is None or running.design is None or running.is_broken or running.task_failure:
            return False
        result = self.analysis.objectives.get(name)
        return running.design not in self.analysis.unrealisable and not (result and result.in_error)

    def note_in_vain(self, now: float, design: str, objective: str, reason: str) -> None:
        """Put a design into the error log, for an objective and for as long as the settings say."""
        self.error_log[design, objective] = now + self.settings.error_log_expiry, reason
