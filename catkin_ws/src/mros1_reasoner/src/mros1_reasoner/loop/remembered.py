"""What a reasoner leaves for the one that takes its place, which can't see it again.

That is what failed, what was left, and what is to be released. Without it, the return of a component, or the end of
what made a design violate a limit, would be no news to a reasoner that was started in between, and the robot would stay
with the lesser design. What nothing needs would run for ever.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.loop.entries import BeforeFact, FailedFact, LeftFact, UnneededFact
from mros1_reasoner.loop.entry_text import kind_of, read_entry, values_of
from mros1_reasoner.loop.readable_state import Running, View

_LEFT = kind_of(LeftFact("", "", ""))


def to_remember(view: View, goals: Mapping[str, str]) -> dict[str, Any]:
    """Return what is to be remembered now, as a value of a parameter.

    Args:
        view: what the loop knows.
        goals: ids of the tasks' goals that are at work, by objective.
    """
    failed = {name for name, component in view.components.items() if component.status == v.FAILED}
    return {
        "failed": sorted(failed | view.failed_before),
        "left": [list(values_of(fact)) for fact in _left(view)],
        "unneeded": list({**dict.fromkeys(view.unneeded), **dict.fromkeys(view.released)}),
        "goals": [list(pair) for pair in sorted(goals.items())],
    }


def remembered(value: object) -> list[BeforeFact]:
    """Return the facts that a parameter has; what can't be read is left out."""
    known = value if isinstance(value, Mapping) else {}
    facts: list[BeforeFact] = [FailedFact(name) for name in _list(known.get("failed")) if isinstance(name, str)]
    facts += [UnneededFact(name) for name in _list(known.get("unneeded")) if isinstance(name, str)]
    for values in _list(known.get("left")):
        try:
            content = read_entry(0.0, _LEFT, [str(part) for part in _list(values)]).content
        except ValueError:
            continue
        if isinstance(content, LeftFact):
            facts.append(content)
    return facts


def remembered_goals(value: object) -> dict[str, str]:
    """Return the goals that a parameter has, by objective; what can't be read is left out."""
    known = value if isinstance(value, Mapping) else {}
    pairs = [pair for pair in _list(known.get("goals")) if isinstance(pair, list) and len(pair) == 2]
    return {name: goal for name, goal in pairs if isinstance(name, str) and isinstance(goal, str)}


def _left(view: View) -> list[LeftFact]:
    found = []
    for name in {**view.running, **view.makeshifts, **dict.fromkeys(view.levels.with_blames())}:
        running = view.running.get(name, Running())
        waits = running.design is None and name in view.makeshifts
        design = view.makeshifts[name] if waits else running.design or ""
        degraded = running.degraded or waits
        blames = view.levels.blames(name)
        found += [
            LeftFact(name, design, quality, strain.factor, strain.difference, group, degraded)
            for quality, (strain, group) in blames.items()
        ]
        if degraded and not blames:
            found.append(LeftFact(name, design, degraded=True))
    return found


def _list(value: object) -> Sequence[Any]:
    return value if isinstance(value, list) else ()
