"""Causes of an adaptation: errors of an objective, and chances for a better design."""

from __future__ import annotations

import math
from collections.abc import Iterable

from metacontrol_bags.decision import RELIEF, Cause
from metacontrol_msgs.msg import DiagnosticWords as Words

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Design, Objective
from mros1_reasoner.loop.readable_state import Running, View

RECOVERY = "compRecov"
"""The rule by which the return of a component is a cause."""

OPERATOR = "operator"
"""Trigger of a cause that an operator gave."""

RETRY = "retry:"
"""Beginning of the trigger of a cause that lies in a design which failed, and may be tried again."""

RULE = "rule"
"""Trigger of a cause that only a rule of the model knows."""

_PARAMETER = "parameter:"


def is_chance(cause: Cause) -> bool:
    """Return whether nothing is wrong, but a better design may have become available."""
    return cause.rules in (RECOVERY, RELIEF) or _has_no_rule(cause.trigger)


def is_relief(cause: Cause) -> bool:
    """Return whether the cause of a violation is gone."""
    return cause.rules == RELIEF


def errors(view: View, name: str, now: float) -> list[Cause]:
    """Return the errors of an objective itself, the earliest first."""
    running, result = view.running[name], view.analysis.objectives.get(name)
    if running.design is None:
        return _nothing_runs(view, name, now)
    found: list[Cause] = []
    if result and v.IN_ERROR_COMPONENT in result.causes:
        found += _component_errors(view, name, now)
    violated = sorted(quality for objective, quality in view.violations(now) if objective == name)
    found += [_violation(view, view.objectives[name], quality, now) for quality in violated]
    found += [_drift(node, running) for node in running.drifts]
    if running.task_failure:
        stamp, why = running.task_failure
        found.append(Cause(stamp, f"task:{name}", f"the task failed{f': {why}' if why else ''}", "S9"))
    elif view.rule_counts(name, now):
        words = f"{view.kb.rules_for(v.IN_ERROR_NFR)} finds an error of quality"
        found.append(Cause(running.ruled_since or now, f"qa:{name}", words))
    return sorted(found, key=_by_time)


def is_drift(cause: Cause) -> bool:
    """Return whether parameters have drifted."""
    return cause.trigger.startswith(_PARAMETER)


def drifted_nodes(causes: Iterable[Cause]) -> list[str]:
    """Return the nodes whose parameters have drifted."""
    return [cause.trigger.removeprefix(_PARAMETER) for cause in causes if is_drift(cause)]


def heeds_chances(view: View, name: str) -> bool:
    """Return whether an objective takes a better design when nothing is wrong with the running one."""
    always = view.objectives[name].always_improve
    return view.running[name].degraded or (view.settings.always_improve if always is None else always)


def chances(view: View, name: str, now: float) -> list[Cause]:
    """Return the reasons why an objective may have a better design now, the earliest first."""
    found = [
        Cause(min(stamp, now), trigger, words, "" if _has_no_rule(trigger) else RECOVERY)
        for trigger, (stamp, words) in view.running[name].chances.items()
    ]
    if view.is_relieved(name, now):
        qualities = view.levels.blamed(name)
        since = view.levels.gone_since(now, name) or now
        words = f"what made {' and '.join(qualities)} violate the limit has been gone for {now - since:.1f} s"
        found.append(Cause(since, f"qa:{qualities[0]}", words, RELIEF, quality=qualities[0]))
    return sorted(found, key=_by_time)


def _has_no_rule(trigger: str) -> bool:
    return trigger in (OPERATOR, RULE) or trigger.startswith(RETRY)


def _nothing_runs(view: View, name: str, now: float) -> list[Cause]:
    requirers = view.requirers(name)
    if not view.has_waited(now) or (name not in view.roots and not requirers):
        return []
    return [Cause(now, "initial", f"no configuration runs{f', which {requirers[0]} requires' if requirers else ''}")]


def _inherits(view: View, running: Running) -> bool:
    """Return whether something that the running design requires is in error."""
    results = [view.analysis.objectives.get(o) for o in view.required(running.design)]
    return any(result and result.in_error for result in results)


def _component_errors(view: View, name: str, now: float) -> list[Cause]:
    running = view.running[name]
    design = running.design or ""
    found = []
    for component in view.analysis.unrealisable.get(design, ()):
        known = view.components.get(component)
        words = f"component {component}, which {running.design} requires, {known.failure if known else 'does not work'}"
        stamp = known.stamp if known else now
        found.append(Cause(stamp, f"component:{component}", words, _rules_of(view.kb.designs[design], component)))
    for need in view.kb.designs[design].needs:
        words = need.lack(view.facts.surroundings.get(need.attribute, math.nan))
        if words:
            stamp = view.surroundings.unmet.get(need, now)
            words = f"{words}, which {running.design} needs"
            found.append(Cause(stamp, f"environment:{need.attribute}", words, "E1, E2, E3, S1a"))
    for node in running.failed_nodes:
        words = f"node {node} of {running.design} {view.components[node].failure}"
        found.append(Cause(view.components[node].stamp, f"component:{node}", words, "S1a"))
    if not found and view.rule_finds(name, v.IN_ERROR_COMPONENT):
        words = f"{view.kb.rules_for(v.IN_ERROR_COMPONENT)} finds an error of a component"
        return [Cause(now, f"component:{running.design}", words)]
    if running.is_broken or not (found or _inherits(view, running)):
        words = f"configuration {running.design} does not run"
        found.append(Cause(running.failed_stamp or now, f"component:{running.design}", words, "S1a"))
    return found


def _rules_of(design: Design, component: str) -> str:
    """Return the rules by which a component that does not work is an error of a design."""
    if component in design.bindings.values():
        return "S2, S3, S1a"
    return "compError, compErrFG, S1a" if component in design.components else "S2, B1, B2, B3, B4, B6, S1a"


def _drift(node: str, running: Running) -> Cause:
    drift = running.drifts[node]
    whose = "the system" if node == Words.GRAPH else f"node {node} of {running.design}"
    again = f" again after they were put back {len(running.put_back.get(node, ()))} times" if drift.is_left else ""
    words = f"parameters of {whose} have drifted{again}: {drift.parameters}"
    return Cause(drift.since, f"{_PARAMETER}{node}", words)


def _violation(view: View, objective: Objective, quality: str, now: float) -> Cause:
    level, limit = view.levels[objective.name, quality], objective.limits[quality]
    since = level.passed_since if level.passed_since is not None else now
    kind = view.kb.qualities[quality]
    words = f"{quality} {level.value:.3g} {kind.operator} {limit:g} for {now - since:.1f} s"
    if not kind.violates(level.value, limit):
        words = f"{quality} {level.value:.3g}, of which {level.high:.3g} {kind.operator} {limit:g} follows"
    return Cause(
        stamp=since,
        trigger=f"qa:{quality}",
        text=words,
        rules="QA, S9",
        quality=quality,
        level=level.value,
        limit=limit,
        excess=kind.excess(level.high, limit) / (abs(limit) or 1.0),
    )


def _by_time(cause: Cause) -> tuple[float, str]:
    return cause.stamp, cause.trigger
