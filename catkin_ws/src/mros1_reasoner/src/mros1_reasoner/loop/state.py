"""The loop's knowledge, with every way to change it; modules that only read take a `View`. Times are s of ROS time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any

from metacontrol_bags.decision import Cause, Decision
from metacontrol_msgs.msg import FunctionGrounding

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Analysis, Design, Facts, Objective, ObjectiveAnalysis, Past
from mros1_reasoner.knowledge.scale import Correction
from mros1_reasoner.loop import drifts, lasting
from mros1_reasoner.loop.causes import OPERATOR, RETRY, RULE, drifted_nodes, is_chance, is_drift, is_relief
from mros1_reasoner.loop.entries import LeftFact
from mros1_reasoner.loop.levels import Expectation, Judging, Levels
from mros1_reasoner.loop.readable_state import BUSY, Component, Running, View
from mros1_reasoner.loop.repairs import Repairs, UnderWay
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.loop.surroundings import Surroundings
from mros1_reasoner.planning.planner import Utility

_HISTORY = 100  # decisions that are kept
_CHANGES = 10  # of which the durations are kept
VIOLATED = "did not keep a limit while deployed"
"""Why a design is not tried again that was left because of a quality."""
AGAIN = "did not keep a limit, and did so again soon after it had come back: it is itself the cause"
UNEXPLAINED = "did not keep a limit, by more than a cause outside of it explains"
AT_FAULT = (AGAIN, UNEXPLAINED)
"""Why a design is not tried again that is held to be the cause itself."""
UNLESS_GONE = " unless the cause of that is gone before"
"""What ends that earlier than the time that is told."""


class State(View):
    """What is known and asked for at this moment; the attributes are those of View."""

    def __init__(
        self, knowledge_base: KnowledgeBase, objectives: Iterable[Objective], settings: Settings, utility: Utility
    ) -> None:
        """Know the objectives, and that nothing runs."""
        self.kb, self.settings, self._utility = knowledge_base, settings, utility
        self._better: dict[tuple[str, str], float | None] = {}
        objectives = tuple(objectives)
        self.objectives: dict[str, Objective] = {o.name: o for o in objectives if not o.when_required}
        self.in_reserve: dict[str, Objective] = {o.function: o for o in objectives if o.when_required}
        self.roots: dict[str, None] = dict.fromkeys(self.objectives)
        self.running: dict[str, Running] = {objective: Running() for objective in self.objectives}
        self.active: dict[str, tuple[str, str]] = {}
        self._busy_since: dict[str, float] = {}  # of functions whose state is a busy one
        self.wanted: dict[str, str] = {}
        self.released: dict[str, None] = {}
        self.unneeded: dict[str, None] = {}
        self.components: dict[str, Component] = {
            c: Component(status, 0.0) for c, status in knowledge_base.component_statuses.items()
        }
        self.levels = Levels(
            Judging(
                history=int(settings.history),
                confidence=settings.confidence,
                horizon=settings.horizon,
                window=settings.violation_window,
                timeout=settings.level_timeout,
                memory=settings.correction_memory,
                relief=settings.relief,
                most=max(1.0, settings.correction_limit),
            )
        )
        needs = (need for design in knowledge_base.designs.values() for need in design.needs)
        self.surroundings = Surroundings(needs, int(settings.history), settings.relief)
        self.repairs = Repairs(knowledge_base.repairs, settings)
        self._durations: deque[float] = deque(maxlen=_CHANGES)
        self.error_log: dict[tuple[str, str], tuple[float, str]] = {}
        self.rejections: dict[tuple[str, str], float] = {}
        self.history: deque[Past] = deque(maxlen=_HISTORY)
        self.retries: dict[tuple[str, str], tuple[float, str]] = {}
        self._failures: dict[tuple[str, str], int] = {}  # in a row, by design and objective
        self._at_fault: set[tuple[str, str]] = set()  # these failures were violations of their own making
        self.failed_before: set[str] = set()
        self.makeshifts: dict[str, str] = {}
        self.locked: set[str] = set()
        self.paused = False
        self.proposal: Decision | None = None
        self.pending: Decision | None = None
        self.pending_since = 0.0
        self._has_arrived = False  # the manipulator has told of what is pending that it runs
        self.started: float | None = None
        self.has_analysed = False
        self.facts = Facts()
        self.analysis = Analysis()
        self.seen: tuple[object, ...] | None = None

    # Facts

    def note_level(self, now: float, name: str, quality: str, level: float, stamp: float) -> None:
        """Note an observed level of an objective, with the stamp of the diagnostic."""
        limit = self.objectives[name].limits.get(quality)
        kind = self.kb.qualities[quality]
        design = self.kb.designs[self.running[name].design or ""]
        scale = self.scale(quality, limit)
        typical = design.expected.get(kind.typical) if self.settings.correct_expected else None
        against = Expectation(
            scale=scale,
            limit=limit,
            reaching_violates=kind.reaching_violates,
            expected=design.expected.get(quality),
            typical=typical if typical is not None and scale.can_compare_with(typical) else None,
            better=self._best_of_more_useful(design, quality),
            group=design.group(quality),
            low=-math.inf if kind.low is None else kind.low,
            high=math.inf if kind.high is None else kind.high,
        )
        self.levels.observe(now, (name, quality), level, against, stamp=stamp)

    def _best_of_more_useful(self, design: Design, quality: str) -> float | None:
        """Return the best level of a quality that is expected of any design that is more useful than the given one."""
        if (design.name, quality) not in self._better:
            least = self._utility(design) + self.settings.improvement
            others = (d for d in self.kb.solving(design.function) if self._utility(d) >= least)
            levels = [d.expected[quality] for d in others if quality in d.expected]
            best = self.kb.qualities[quality].direction.better(*levels) if levels else None
            self._better[design.name, quality] = best
        return self._better[design.name, quality]

    def note_surroundings(self, now: float, attribute: str, value: float, stamp: float) -> None:
        """Note an observed value of a property of the surroundings."""
        self.surroundings.observe(stamp or now, attribute, value)

    def forget_levels(self, quality: str) -> None:
        """Forget the levels of a quality."""
        self.levels.forget(quality=quality)

    def note_component(self, now: float, name: str, status: str, stamp: float, reason: str = "") -> None:
        """Note another status of a component, and why it has failed."""
        known = self.components.get(name)
        if known and known.status == v.FAILED != status:
            self._mute_what_requires(now, name)
        self.components[name] = Component(status, stamp, reason)
        self.repairs.note(now, name, works=status != v.FAILED)

    def _mute_what_requires(self, now: float, component: str) -> None:
        """Forget levels of what runs with a component that did not work; while it comes back, they tell nothing."""
        for name, running in self.running.items():
            design = self.kb.designs.get(running.design or "")
            if design and component in {*design.components, *design.nodes, *design.bindings.values()}:
                self._run(name, calm_until=max(running.calm_until, now + self.settings.cool_down))
                self.levels.forget(name)

    def note_failed_before(self, component: str) -> None:
        """Note that a component did not work when a reasoner before this one died."""
        self.failed_before.add(component)

    def had_failed_before(self, component: str) -> bool:
        """Return, once, whether that holds."""
        known = component in self.failed_before
        self.failed_before.discard(component)
        return known

    def note_reason(self, name: str, reason: str) -> None:
        """Note another reason why a component has failed, whose status stays as it is."""
        self.components[name] = replace(self.components[name], reason=reason)

    def note_drift(self, now: float, name: str, node: str, parameters: str, stamp: float) -> None:
        """Note that parameters of what runs for an objective have drifted; while it changes, that tells nothing."""
        if not self.is_busy(self.running[name], now):
            self.running[name] = drifts.noted(self.running[name], node, parameters, stamp, now)

    def note_binding(self, now: float, name: str, in_error: bool) -> None:
        """Note whether a binding of what runs for an objective is in error."""
        running = self.running[name]
        if in_error and not running.is_broken:
            self._end_of(name, now)
        self._run(name, failed_stamp=running.failed_stamp if running.binding_error else now, binding_error=in_error)

    def note_task_failure(self, name: str, failure: tuple[float, str] | None) -> None:
        """Note when the task of an objective has failed, and why; None: the task continues."""
        self._run(name, task_failure=failure)

    def note_inactive(self, now: float, function: str) -> None:
        """Note that nothing runs for a function any more, as the manipulator reports it."""
        self.active.pop(function, None)
        self._keep(function)
        for name, running in self.running.items():
            if self.objectives[name].function == function and (running.design is not None or running.state):
                if running.design is not None:
                    self.levels.forget(name)
                    self.wanted.setdefault(name, running.design)  # what it requires is still needed
                    self._run(name, vanished=running.design)
                self._run(name, design=None, state="", busy_since=None, binding_error=False, task_failure=None)
                self._run(name, drifts={})
                # It may be about to come back: a manipulator starts anew.
                self._run(name, not_before=max(running.not_before, now + self.settings.backoff))

    def note_failed_nodes(self, now: float) -> None:
        """Note which nodes of the running designs do not work."""
        for name, running in self.running.items():
            counts = now >= running.deployed_at + self.settings.restart_grace and not self.is_busy(running, now)
            self._run(name, failed_nodes=self.failed_nodes_of(running.design) if counts else ())

    def note_active(self, now: float, function: str, configuration: str, state: str) -> None:
        """Note what runs for a function, as the manipulator reports it."""
        if state in BUSY and self.active.get(function, ("", ""))[1] not in BUSY:
            self._busy_since[function] = now
        self.active[function] = configuration, state
        for name in [o.name for o in self.objectives.values() if o.function == function]:
            self._take_active(name, configuration, state, now)
        pursued = {objective.function for objective in self.objectives.values()}
        unneeded = [other for other in self.unneeded if other in self.active and other not in pursued]
        self.released = {**dict.fromkeys(unneeded), **self.released}

    def _take_active(self, name: str, configuration: str, state: str, now: float) -> None:
        running = self.running[name]
        asked = self.pending if self.pending and self.pending.objective == name else None
        if asked and configuration == asked.to_configuration and state == FunctionGrounding.STABLE:
            self._has_arrived |= running.design != configuration or running.state in BUSY
        if state in BUSY:
            self._run(name, busy_since=running.busy_since if running.state in BUSY else now, drifts={})
        elif running.state in BUSY:
            self._run(name, drifts_from=now + self.settings.restart_grace)
            if running.state == FunctionGrounding.RECOVERING:  # levels of a design without its nodes tell nothing of it
                self._run(name, calm_until=max(running.calm_until, now + self.settings.cool_down))
                self.levels.forget(name)
        if state != running.state and state == FunctionGrounding.FAILED:
            self._run(name, failed_stamp=max(now, 0.0))  # 0: before anything was asked for
            if running.design == configuration and not running.is_broken:
                self._end_of(name, now)
        # While it reconfigures, it may be the old or the new one.
        is_another = state != FunctionGrounding.RECONFIGURING and running.design != configuration
        if is_another and not asked and lasting.is_taken_back(running, configuration, self.settings, now):
            self._end_of(name, now, "was taken back")
            self.note_in_vain(now, running.design or "", name, self.running[name].ending)
        self._run(name, state=state)
        if is_another:
            self._deploy(name, configuration, now)

    def _deploy(self, name: str, design: str, now: float) -> None:
        """Note that a design runs, and forget what was observed of the design before it."""
        running = self.running[name]
        if running.design is not None and running.design != design:
            self._run(name, calm_until=max(running.calm_until, now + self.settings.cool_down))
        if running.design != design:
            self._run(name, restarts=(), put_back={})
        if lasting.has_lasted(running, self.settings, now):
            self._run(name, brief=0)
            if (running.design, name) not in self.error_log:  # it has not ended by a failure
                self._failures.pop((running.design or "", name), None)
                self._at_fault.discard((running.design or "", name))
        self._run(name, way=() if self.wanted.get(name, design) == design else running.way)
        is_makeshift = self.makeshifts.pop(name, None) == design
        self._run(name, design=design, degraded=is_makeshift, binding_error=False, task_failure=None, refusal=())
        self._run(name, replaced=None, ending="", ruled_since=None, vanished="")
        self.rejections.pop((design, name), None)
        self._run(name, deployed_at=now, failed_nodes=(), drifts={}, drifts_from=now + self.settings.restart_grace)
        if self.wanted.get(name) == design:
            del self.wanted[name]
        self.levels.forget(name)

    # Objectives

    def ask_for(self, objective: Objective) -> None:
        """Add a root objective."""
        self.roots[objective.name] = None
        self._add(objective)
        self.reconsider()

    def ask_no_longer(self, name: str) -> None:
        """Remove a root objective, and the objectives that only it required, with their locks."""
        before = set(self.objectives)
        del self.roots[name]
        self.error_log = {key: entry for key, entry in self.error_log.items() if key[1] != name}
        self.retries = {key: entry for key, entry in self.retries.items() if key[1] != name}
        self.rejections = {key: expiry for key, expiry in self.rejections.items() if key[1] != name}
        self._drop(name)
        self.match_requirements()
        self.locked -= {name, *(before - self.objectives.keys())}
        self.reconsider()

    def ask_anew(self, objective: Objective) -> None:
        """Ask for an objective with other limits; a design that is expected not to keep them is a makeshift now."""
        is_makeshift = bool(self.beyond(objective))
        if not objective.limits.keys() >= set(self.levels.blamed(objective.name)):  # that cause is never gone
            self.levels.acquit(objective.name)
        self.replace_limits(objective, f"{objective.name} is asked for with other limits")
        self._run(objective.name, degraded=is_makeshift, refusal=())

    def set_limit(self, name: str, quality: str, limit: float, why: str) -> None:
        """Give an objective another limit of a quality, which may make another design the better one."""
        function = self.foreseen().get(name)
        if function is not None and name not in self.roots:  # it has it whenever a design requires it
            reserve = self.in_reserve.get(function) or Objective(name, function, when_required=True)
            self.in_reserve[function] = replace(reserve, limits={**reserve.limits, quality: limit})
        if name in self.objectives:
            before = self.objectives[name]
            self.replace_limits(replace(before, limits={**before.limits, quality: limit}), why)

    def replace_limits(self, objective: Objective, why: str) -> None:
        """Give an objective other limits, which may make another design the better one.

        Args:
            objective: what takes the place of the one of its name.
            why: in words.
        """
        name, before = objective.name, self.objectives[objective.name]
        self.forgive(name, (VIOLATED, *AT_FAULT))
        self.objectives[name] = objective
        for quality in {**before.limits, **objective.limits}:
            if before.limits.get(quality) != objective.limits.get(quality):
                self.levels.forget(name, quality)  # since when the limit is passed must be found anew
        self._run(name, chances={**self.running[name].chances, OPERATOR: (math.inf, why)})
        self.reconsider()

    def match_requirements(self) -> None:
        """Add an objective for every function that is required, and remove those that no longer are."""
        while True:  # what runs for a new objective may require further ones
            needed = self.needed(self.deployments(), self.wanted)
            missing = {name: function for name, function in needed.items() if name not in self.objectives}
            if not missing:
                break
            for function in missing.values():
                self._add(self.objective_of(function))
        for name in self._from_the_top([name for name in self.objectives if name not in needed]):
            self._drop(name)

    def _from_the_top(self, names: list[str]) -> list[str]:
        """Return objectives in an order in which each one comes before those that its design requires."""
        found: list[str] = []
        while names:
            below = {required for name in names for required in self.required(self.running[name].design)}
            found += [name for name in names if name not in below]
            names = [name for name in names if name in below]
        return found

    def _add(self, objective: Objective) -> None:
        """Add an objective; what runs for its function already runs for it."""
        self._keep(objective.function)
        self.objectives[objective.name] = objective
        self.running[objective.name] = Running()
        active = self.active.get(objective.function)
        if active:
            self._take_active(objective.name, *active, now=-math.inf)
            if active[1] in BUSY:
                self._run(objective.name, busy_since=self._busy_since[objective.function])

    def _drop(self, name: str) -> None:
        """Forget an objective and everything that is known of it; a lock stays where a design may require it again."""
        self.wanted.pop(name, None)
        function, design = self.objectives[name].function, self.running[name].design
        del self.objectives[name], self.running[name]
        if design is not None and function not in {objective.function for objective in self.objectives.values()}:
            self.released[function] = None
        self.locked -= {name} - self.foreseen().keys()
        self.levels.drop(name)

    # Steps and analyses

    def begin_step(self, now: float) -> None:
        """Note the time of the first step; what runs must be known after a while, with all that is to be released."""
        if self.started is None:
            self.started = now
        if self.active and self.has_waited(now):
            self.unneeded = {}

    def forget_expired(self, now: float) -> None:
        """Drop old failures and rejections, and drifted parameters that are reported no more."""
        self.error_log = {key: entry for key, entry in self.error_log.items() if entry[0] > now}
        self.rejections = {key: expiry for key, expiry in self.rejections.items() if expiry > now}
        for name, running in self.running.items():
            self.running[name] = drifts.judged(running, self.settings, now)

    def note_retries(self, now: float) -> None:
        """Take designs that failed, and may be tried again now, for chances of a better design."""
        for (design, name), (moment, reason) in list(self.retries.items()):
            if moment > now:
                continue
            del self.retries[design, name]
            chance = {f"{RETRY}{design}": (moment, f"{design} may be tried again, which failed ({reason})")}
            for objective in self._improved_by(design, name):
                self._run(objective, chances={**self.running[objective].chances, **chance})

    def _improved_by(self, design: str, name: str) -> list[str]:
        """Return the objectives for which a design that an objective has, or had, may lead to a better one."""
        found = []
        for objective, running in self.running.items():
            others = [d for d in self.kb.solving(self.objectives[objective].function) if d.name != running.design]
            is_own = objective == name and running.design != design
            if running.design is not None and (is_own or any(self._builds_on(d, name) for d in others)):
                found.append(objective)
        return found

    def _builds_on(self, design: Design, name: str) -> bool:
        """Return whether a design requires an objective, be it by designs of what it requires."""
        found, waiting = set(design.requires), list(design.requires)
        while waiting:
            function = waiting.pop()
            if self.provider(function) == name:
                return True
            new = {below for other in self.kb.solving(function) for below in other.requires} - found
            found |= new
            waiting += new
        return False

    def note_analysis(self, now: float, facts: Facts, analysis: Analysis, seen: tuple[object, ...]) -> None:
        """Keep an analysis. A RECOVERED component is a chance for every objective once; then it counts as working."""
        before = self.analysis
        self.has_analysed, self.facts, self.analysis, self.seen = True, facts, analysis, seen
        for name, running in self.running.items():
            since = running.ruled_since if running.ruled_since is not None else now
            self._run(name, ruled_since=since if self.rule_finds(name, v.IN_ERROR_NFR) else None)
        if v.RECOVERED not in facts.components.values():  # else the chance is of the component
            self._note_chances_by_rules(now, before)
        for name, component in self.components.items():
            if component.status != v.RECOVERED or facts.components.get(name) != v.RECOVERED:
                continue
            for objective, result in analysis.objectives.items():
                if v.UPDATABLE in result.causes:
                    chance = {f"component:{name}": (component.stamp, f"component {name} works again")}
                    self._run(objective, chances={**self.running[objective].chances, **chance})
            self.components[name] = Component(v.WORKS, component.stamp)

    def _note_chances_by_rules(self, now: float, before: Analysis) -> None:
        """Note what rules of the models have just begun to say of better designs, or ceased to say against them."""
        chances: dict[str, str] = {}
        for design in sorted(before.unrealisable.keys() - self.analysis.unrealisable.keys()):
            function = self.kb.designs[design].function
            owners = {o.name for o in self.objectives.values() if o.function == function} | {self.provider(function)}
            helped = {name for owner in owners for name in self._improved_by(design, owner)}
            chances |= dict.fromkeys(helped, f"{design} can be deployed again")
        for name, result in self.analysis.objectives.items():
            known = before.objectives.get(name, ObjectiveAnalysis("")).causes
            if v.UPDATABLE in result.causes and v.UPDATABLE not in known:
                chances[name] = f"{self.kb.rules_for(v.UPDATABLE)} says that there may be a better design"
        for name, words in chances.items():
            self._run(name, chances={**self.running[name].chances, RULE: (now, words)})

    def reconsider(self) -> None:
        """Have the next step analyse and decide in any case."""
        self.seen = None

    def pause(self) -> None:
        """Decide nothing."""
        self.paused = True

    def resume(self) -> None:
        """Decide again."""
        self.paused = False
        self.reconsider()

    def lock(self, names: Iterable[str]) -> None:
        """Make objectives keep their configuration, or the one they have when they come into being."""
        self.locked |= set(names)
        self.reconsider()

    def unlock(self, names: Iterable[str]) -> None:
        """Have objectives no longer keep their configuration; what they have missed is a chance now."""
        names = set(names)
        for name in self.locked & names & self.running.keys():
            chance = math.inf, "it may take another design again"
            self._run(name, chances={**self.running[name].chances, OPERATOR: chance})
        self.locked -= names
        self.reconsider()

    # Decisions

    def rest(self, name: str) -> None:
        """Forget refusals and wanted designs of an objective, because it needs no adaptation."""
        self._run(name, refusal=(), way=())
        self._want_no_longer(name)

    def want(self, designs: Mapping[str, str], name: str, causes: Iterable[Cause]) -> None:
        """Want designs for objectives until they are deployed; that of one objective for these causes."""
        self.wanted.update(designs)
        for other, design in designs.items():
            if other in self.running and design != self.running[other].vanished:
                self._run(other, vanished="")
        causes = tuple(causes)
        if all(map(is_chance, causes)) and not self.settings.dry_run:
            self._run(name, way=causes)

    def is_news(self, name: str, outcome: tuple[object, ...]) -> bool:
        """Keep the outcome of a deliberation that leads to no adaptation; return whether it is a new one."""
        is_news = outcome != self.running[name].refusal
        self._run(name, refusal=outcome)
        return is_news

    def refuse(self, name: str, outcome: tuple[object, ...]) -> bool:
        """Keep the outcome of a deliberation that refuses to adapt; return whether it is a new one."""
        self._want_no_longer(name)
        is_news = self.is_news(name, outcome)
        if is_news:
            self._run(name, degraded=True)
        return is_news

    def _want_no_longer(self, name: str) -> None:
        """Forget the design that is wanted for an objective, unless it has run and vanished: its parts run on."""
        if self.wanted.get(name) != self.running[name].vanished:
            self.wanted.pop(name, None)

    def use_chances(self, name: str) -> None:
        """Forget the chances of an objective: they have been considered."""
        self._run(name, chances={})

    def note_in_vain(self, now: float, design: str, objective: str, reason: str) -> None:
        """Put a design that failed for an objective into the error log."""
        key, expiry = (design, objective), now + self.settings.error_log_expiry
        if reason != VIOLATED:  # that may be tried again when the cause is gone
            running = self.running.get(objective, Running())
            has_lasted = running.design == design and not lasting.is_brief(running, self.settings, now)
            before = 0 if has_lasted else self._failures.get(key, 0)
            # As long as an entry is there, it is the same failure.
            failures = self._failures[key] = max(before + (key not in self.error_log), 1)
            self.retries[key] = now + self.settings.retry_after(failures - 1), reason
        if reason in AT_FAULT:
            self._at_fault.add(key)
            expiry = self.retries[key][0]  # no other design's violation is a reason to try it sooner
        self.error_log[key] = expiry, reason

    def note_rejection(self, now: float, design: str, objective: str, words: str) -> None:
        """Note that an operator does not want a design for an objective now."""
        self.note_in_vain(now, design, objective, words)
        self.rejections[design, objective] = now + self.settings.error_log_expiry

    def forgive(self, name: str, reasons: Collection[str] = (VIOLATED,)) -> None:
        """Let designs of an objective be tried again that did not keep a limit: its cause is gone, or the limit is."""
        kept = {key for key, (_, reason) in self.error_log.items() if key[1] != name or reason not in reasons}
        self._at_fault -= self.error_log.keys() - kept
        self.retries = {key: entry for key, entry in self.retries.items() if key in kept or key not in self.error_log}
        self.error_log = {key: entry for key, entry in self.error_log.items() if key in kept}

    def note_blame(self, now: float, name: str, causes: Iterable[Cause], *, is_better: bool) -> None:
        """Note for which qualities the design of an objective is left, or that it is left because their cause is gone.

        Args:
            now: present time.
            name: the objective.
            causes: why its design is left.
            is_better: whether what comes is a better design; else a better one is still looked for.
        """
        running, causes = self.running.get(name), tuple(causes)
        if running is None:
            return
        violated = [cause.quality for cause in causes if cause.quality and not is_chance(cause)]
        for quality in violated:
            self.levels.blame(now, (name, quality))
        if any(is_relief(cause) for cause in causes) and not violated:
            if is_better:
                self.levels.acquit(name)
            self._run(name, returned_at=now)
        elif violated:
            relapses = running.relapses + 1 if self.is_relapse(name, now) else 0
            self._run(name, relapses=relapses, returned_at=-math.inf)
        elif not all(is_chance(cause) for cause in causes):  # what runs next is not what it returned to
            self._run(name, returned_at=-math.inf)

    def note_left(self, fact: LeftFact) -> None:
        """Note that a better design was left by a reasoner before this one."""
        if fact.quality:
            strain = Correction(fact.factor, fact.difference)
            self.levels.restore((fact.objective, fact.quality), strain, fact.group)
        if fact.degraded:
            self.makeshifts[fact.objective] = fact.design
            if (running := self.running.get(fact.objective)) and running.design == fact.design:
                self._run(fact.objective, degraded=True)

    def note_unneeded(self, function: str) -> None:
        """Note that a reasoner before this one was to release a function."""
        self.unneeded[function] = None

    def was_at_fault(self, design: str, objective: str) -> bool:
        """Return whether a design has violated limits of its own making, and has not kept them for long since."""
        return (design, objective) in self._at_fault

    def propose(self, decision: Decision | None) -> None:
        """Have a decision wait for approval; None: have none wait."""
        self.proposal = decision

    def begin(self, decision: Decision, now: float, wall: float) -> None:
        """Have a decision carried out from this time and wall time on."""
        self.proposal = None
        if decision.repair:
            self.repairs.begin(now, decision, wall)
        else:
            self.pending, self.pending_since, self._has_arrived = decision, wall, False
        self.reconsider()

    def end_repairs(self, now: float) -> list[tuple[UnderWay, str]]:
        """End the repairs whose components work, and those that take too long; return why these have failed."""
        failed = {name for name, component in self.components.items() if component.status == v.FAILED}
        ended = self.repairs.ended(now, failed)
        if ended:
            self.reconsider()
        return ended

    def succeed(self, now: float) -> None:
        """Note that the pending decision was carried out."""
        decision = self._end()
        name, design = decision.objective, decision.to_configuration
        before = self.running[name]
        if decision.from_configuration not in ("", design):
            self._durations.append(max(0.0, now - decision.stamp_planned))
        if before.state in (*BUSY, FunctionGrounding.FAILED):
            self._run(name, state=FunctionGrounding.STABLE, busy_since=None)
        restarts = () if lasting.has_lasted(before, self.settings, now) else before.restarts
        self._deploy(name, design, now)
        self._run(name, replaced=decision.from_configuration if decision.from_configuration != design else None)
        function = self.objectives[name].function
        told = self.active.get(function)
        self.active[function] = design, FunctionGrounding.STABLE
        self._run(name, calm_until=now + self.settings.cool_down, attempts=0, degraded=decision.degraded)
        if before.failed_nodes and before.design == design:
            self._run(name, restarts=(*restarts, now), degraded=decision.degraded or before.degraded)
            self._run(name, not_before=now + self.settings.wait_after(len(restarts)))
        if before.design == design:
            self._note_put_back(now, name, drifted_nodes(decision.reasons))
        if OPERATOR in before.chances and self.beyond(self.objectives[name]):  # the limits have changed meanwhile
            self._run(name, degraded=True)
        for node in self.failed_nodes_of(design):
            self.components[node] = Component(v.WORKS, now)
        if self._has_arrived and told:  # what the manipulator has told since is newer than its answer
            self.note_active(now, function, *told)
        elif self._has_arrived:
            self.note_inactive(now, function)

    @property
    def change_duration(self) -> float:
        """How long a change takes: the mean of the last ones, or as the settings say, s."""
        return sum(self._durations) / len(self._durations) if self._durations else self.settings.change_duration

    def _note_put_back(self, now: float, name: str, nodes: Collection[str]) -> None:
        """Note that drifted parameters of nodes have been put back; other functions may have the same nodes."""
        for other, running in self.running.items():
            if nodes and (other == name or not running.drifts.keys().isdisjoint(nodes)):
                self.running[other] = drifts.put_back(running, nodes, self.settings, now)

    def fail(self, now: float, why: str | None) -> None:
        """Note that the pending decision was not carried out, and why; None: the configuration is not to blame."""
        decision = self._end()
        running = self.running[decision.objective]
        if all(is_drift(cause) for cause in decision.reasons):  # the design runs on as it did
            self._note_put_back(now, decision.objective, drifted_nodes(decision.reasons))
        elif why is not None:
            self.note_in_vain(now, decision.to_configuration, decision.objective, why)
        wait = self.settings.wait_after(running.attempts)
        self._run(decision.objective, not_before=now + wait, attempts=running.attempts + 1)

    def note_past(self, decision: Decision) -> None:
        """Keep a decision that has been carried out or has failed."""
        causes = tuple(dict.fromkeys(cause.trigger for cause in decision.reasons))
        names = decision.from_configuration, decision.to_configuration
        self.history.append(
            Past(decision.id, decision.objective, *names, decision.state, decision.stamp_executed, causes)
        )

    def note_released(self, function: str) -> None:
        """Note that a function has been released."""
        if function in self.released:
            self._keep(function)
            self.active.pop(function, None)

    def _keep(self, function: str) -> None:
        """Have a function released no longer."""
        self.released.pop(function, None)
        self.unneeded.pop(function, None)

    def _end_of(self, name: str, now: float, how: str = "ended") -> None:
        """Note that the deployed design of an objective has ended."""
        self.running[name] = lasting.ended(self.running[name], self.settings, now, how)

    def _end(self) -> Decision:
        assert self.pending is not None  # noqa: S101 - who reports has asked
        decision, self.pending = self.pending, None
        self.reconsider()
        return decision

    def _run(self, name: str, **changes: Any) -> None:
        self.running[name] = replace(self.running[name], **changes)
