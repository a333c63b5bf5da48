"""What the reasoner knows, as viewers see it: functions, designs, objectives, limits, who blocks what. Pure."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from mros1_reasoner.loop.causes import errors
from mros1_reasoner.loop.fulfilment import fulfilment

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mros1_reasoner.loop.readable_state import View

SECTIONS = ("objective", "design", "limit", "part_of", "operator")

Sections = dict[str, dict[str, Any]]


def knowledge_entries(view: View, now: float, remarks: Sequence[str] = ()) -> Sections:
    """Return the entries of each of SECTIONS.

    - `objective`: function, limits, what runs, statuses, causes with the rules that conclude them.
    - `design`: function, expected levels, what it requires, what keeps it from being deployed, and whether it failed.
    - `limit`: of each quality the comparison that violates it, and by objective the limit and the expected level.
    - `part_of`: of each component the designs that require it, and how it is repaired.
    - `operator`: what an operator has set: paused, locked, and what waits.

    Args:
        view: of the reasoner.
        now: present ROS time, s.
        remarks: why the view may not be what the reasoner knows.
    """
    return {
        "objective": {name: _objective(view, name, now) for name in view.objectives},
        "design": _designs(view),
        "limit": _limits(view),
        "part_of": _components(view),
        "operator": {
            "state": {
                "paused": view.paused,
                "locked": sorted(view.locked),
                "proposal": view.proposal.id if view.proposal else "",
                "pending": view.pending.id if view.pending else "",
                "approval": view.settings.approval,
                "dry_run": view.settings.dry_run,
                "remarks": list(remarks),
            }
        },
    }


def _objective(view: View, name: str, now: float) -> dict[str, Any]:
    objective, running = view.objectives[name], view.running[name]
    stands = fulfilment(view, name, now)
    result = view.analysis.objectives.get(name)
    causes = [asdict(cause) for cause in errors(view, name, now)] if view.has_analysed else []
    for cause in causes:
        cause["stamp"] = round(cause["stamp"], 1)
    return {
        "function": objective.function,
        "limits": dict(objective.limits),
        "design": running.design or "",
        "state": running.state,
        "statuses": list(stands.statuses),
        "grounding": sorted(result.grounding_causes) if result else [],
        "fulfilled": stands.is_fulfilled,
        "why": stands.why,
        "causes": causes,
        "root": name in view.roots,
        "locked": name in view.locked,
        "degraded": running.degraded,
    }


def _designs(view: View) -> dict[str, Any]:
    failed = {design: why for (design, _), (_, why) in view.error_log.items()}
    tried = {design for design, _ in view.analysis.tried}
    running = {r.design for r in view.running.values()}
    found = {}
    for name, design in view.kb.designs.items():
        blocked = view.analysis.unrealisable.get(name)
        lacks = design.lacks(view.facts.surroundings)
        found[name] = {
            "function": design.function,
            "expected": dict(design.expected),
            "components": sorted(design.components),
            "nodes": sorted(design.nodes),
            "requires": list(design.requires),
            "blocked": blocked is not None,
            "blocked_by": sorted(blocked or ()),
            "lacks": lacks,
            "failed": failed.get(name, "it violates a limit while it is deployed" if name in tried else ""),
            "runs": name in running,
        }
    return found


def _limits(view: View) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, quality in view.kb.qualities.items():
        by_objective = {}
        for objective, needed in view.objectives.items():
            design = view.kb.designs.get(view.running[objective].design or "")
            expected = design.expected.get(name) if design else None
            if name in needed.limits or expected is not None:
                by_objective[objective] = {"limit": needed.limits.get(name), "expected": expected}
        low_better = quality.direction.sign > 0
        found[name] = {"operator": quality.operator, "low_is_better": low_better, "of": by_objective}
    return found


def _components(view: View) -> dict[str, Any]:
    required: dict[str, list[str]] = {name: [] for name in view.kb.components}
    for name, design in view.kb.designs.items():
        for component in design.components:
            required.setdefault(component, []).append(name)
    found: dict[str, Any] = {}
    for component, designs in required.items():
        repair = view.kb.repairs.get(component)
        known = view.components.get(component)
        found[component] = {
            "required_by": sorted(designs),
            "node_of_designs": component in view.kb.own_nodes,
            "repair": asdict(repair) if repair else None,
            "status": known.status if known else "",
            "reason": known.reason if known else "",
        }
    return found


def upper_limits(view: View) -> dict[str, float]:
    """Return the limits that levels may not exceed, by quality, as the timeline compares them."""
    found: dict[str, float] = {}
    for objective in view.objectives.values():
        for name, limit in objective.limits.items():
            quality = view.kb.qualities.get(name)
            if quality is not None and quality.direction.sign > 0:
                found[name] = min(limit, found.get(name, limit))
    return found
