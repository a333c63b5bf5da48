"""What can be fulfilled now, as a problem in PDDL, the planning domain definition language (McDermott et al. 1998)."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence


def problem(functions: Mapping[str, Sequence[str]], name: str = "now") -> str:
    """Return a PDDL problem without a goal, for a planner's own domain `mros` with the types function and design.

    Its initial state has `(fulfillable FUNCTION)` for each function with a design that can be deployed, `(solves DESIGN
    FUNCTION)` for each such design, and `(best DESIGN FUNCTION)` for the most useful one. A name that is none in PDDL
    has `_` in place of its special characters.

    Args:
        functions: the designs by which each function can be fulfilled, the most useful first; none if it can't.
        name: of the problem.
    """
    designs = [design for found in functions.values() for design in found]
    names = _names([*functions, *designs])
    facts = []
    for function, found in functions.items():
        if found:
            facts += [f"(fulfillable {names[function]})", f"(best {names[found[0]]} {names[function]})"]
        facts += [f"(solves {names[design]} {names[function]})" for design in found]
    objects = [f"{names[function]} - function" for function in functions]
    objects += [f"{names[design]} - design" for design in designs]
    lines = [f"(define (problem {name})", "  (:domain mros)"]
    lines += _section("objects", objects) + _section("init", facts)
    return "\n".join(lines) + "\n)\n"


def _section(keyword: str, parts: Iterable[str]) -> list[str]:
    return [f"  (:{keyword}", *(f"    {part}" for part in parts), "  )"]


def _names(names: Iterable[str]) -> dict[str, str]:
    """Return names of PDDL, which has no capitals: each one stands for one name."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        text = re.sub(r"[^a-z0-9_-]", "_", name.lower())
        text = text if text[:1].isalpha() else f"x{text}"
        numbered = (f"{text}-{number}" for number in itertools.count(2))
        found[name] = next(candidate for candidate in itertools.chain([text], numbered) if candidate not in taken)
        taken.add(found[name])
    return found
