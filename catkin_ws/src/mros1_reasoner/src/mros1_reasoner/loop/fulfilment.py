"""How an objective stands: its statuses as they count, what runs for it, and why it is not fulfilled."""

from __future__ import annotations

from dataclasses import dataclass, field

from metacontrol_msgs.msg import FunctionGrounding

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.loop.causes import errors
from mros1_reasoner.loop.readable_state import View


@dataclass(frozen=True)
class Fulfilment:
    """How an objective stands. Two are equal if only numbers in their words differ.

    Attributes:
        objective: its name.
        statuses: every o_status that holds, the worst first; violated limits are heeded as soon as they count.
        configuration: what runs; empty: nothing.
        violated: the qualities whose limits are not kept, by observed levels, else by expected ones.
        stage: what is under way, in words; empty: nothing.
        is_fulfilled: whether a configuration runs without errors and keeps every limit.
        why: why it is not fulfilled, in one line.
    """

    objective: str
    statuses: tuple[str, ...]
    configuration: str = ""
    violated: tuple[str, ...] = ()
    stage: str = ""
    is_fulfilled: bool = False
    why: str = field(default="", compare=False)


def fulfilment(view: View, name: str, now: float) -> Fulfilment:
    """Return how an objective stands."""
    design, stage = view.running[name].design or "", _stage(view, name, now)
    violated = _violated(view, name, now)
    wrong = errors(view, name, now)
    is_fulfilled = bool(design) and not (stage or violated or wrong) and _is_sound(view, name, now)
    words = [stage, *(cause.text for cause in wrong), *_expectations(view, name, violated)]
    why = "" if is_fulfilled else "; ".join(filter(None, words)) or f"what {design or name} requires is not there"
    return Fulfilment(name, _statuses(view, name, now), design, violated, stage, is_fulfilled, why)


def _stage(view: View, name: str, now: float) -> str:
    """Return what is under way for an objective."""
    running, decision, proposal = view.running[name], view.pending, view.proposal
    if decision and decision.objective == name:
        return f"{decision.to_configuration} is being deployed"
    if proposal and proposal.objective == name:
        return f"{proposal.to_configuration} waits for approval"
    if view.is_busy(running, now):
        return f"{running.design} is {running.state}"
    if view.objectives[name] not in view.facts.objectives:
        return "it is about to be analysed"
    return _why_nothing_is_done(view, now) if running.design is None else ""


def _why_nothing_is_done(view: View, now: float) -> str:
    if view.paused:
        return "the reasoner is paused"
    return "" if view.has_waited(now) else "the reasoner waits for what runs already"


def _violated(view: View, name: str, now: float) -> tuple[str, ...]:
    counting = {quality for objective, quality in view.violations(now) if objective == name}
    return tuple(sorted(counting.union(view.beyond(view.objectives[name]))))


def _with_required(view: View, name: str) -> list[str]:
    """Return an objective and all that it requires, be it by what runs for others that it requires; each one once."""
    found, waiting = {name: None}, [name]
    while waiting:
        running = view.running.get(waiting.pop())
        new = [o for o in view.required(running.design if running else None) if o not in found]
        found.update(dict.fromkeys(new))
        waiting += new
    return list(found)


def _is_sound(view: View, name: str, now: float) -> bool:
    """Return whether what runs has no error, and what it requires is fulfilled."""
    required = _with_required(view, name)[1:]
    return _is_whole(view, name) and all(_is_fulfilled_itself(view, o, now) for o in required)


def _is_fulfilled_itself(view: View, name: str, now: float) -> bool:
    """Return whether an objective is fulfilled, apart from what it requires."""
    if name not in view.running or not view.running[name].design:
        return False
    is_well = not (_stage(view, name, now) or _violated(view, name, now) or errors(view, name, now))
    return is_well and _is_whole(view, name)


def _is_whole(view: View, name: str) -> bool:
    running, result = view.running[name], view.analysis.objectives.get(name)
    if running.design is None or result is None or running.state == FunctionGrounding.FAILED:
        return False
    return not (running.is_broken or running.failed_nodes) and v.IN_ERROR_COMPONENT not in result.causes


def _statuses(view: View, name: str, now: float) -> tuple[str, ...]:
    running, result = view.running[name], view.analysis.objectives.get(name)
    causes = set(result.causes) if result else set()
    if v.IN_ERROR_NFR in causes and not _counts(view, name, now):
        causes.remove(v.IN_ERROR_NFR)
    if running.design is None:
        causes |= {v.UNGROUNDED, *([v.UNREACHABLE] if running.refusal else [])}
    known = [status for status in _ORDER if status in causes]
    return (*known, *sorted(causes.difference(known))) or (v.IN_PROGRESS,)


def _counts(view: View, name: str, now: float) -> bool:
    """Return whether an error of quality counts, of an objective or of one that it requires."""
    violating = {objective for objective, _ in view.violations(now)}
    known = (o for o in _with_required(view, name) if o in view.running)
    return any(o in violating or view.rule_counts(o, now) or view.running[o].task_failure is not None for o in known)


def _expectations(view: View, name: str, violated: tuple[str, ...]) -> list[str]:
    """Return in words which limits what runs is only expected not to keep."""
    design, limits = view.running[name].design or "", view.objectives[name].limits
    observed = {quality for objective, quality in view.facts.levels if objective == name}
    found = []
    for quality in violated:
        if quality not in observed and quality in view.kb.designs[design].expected:
            passes = view.kb.qualities[quality].operator
            level = view.kb.designs[design].expected[quality]
            found.append(f"{quality} of {design} is expected to be {level:.3g} {passes} {limits[quality]:g}")
    return found


_ORDER = (v.UNREACHABLE, v.UNGROUNDED, v.IN_ERROR_COMPONENT, v.IN_ERROR_NFR, v.UPDATABLE, v.IN_PROGRESS)
