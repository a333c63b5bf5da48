"""Checks that compare the variants of one family."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

from ros_model.findings import Finding

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from ros_model.language.metamodel import (
        RosSystem,
    )


def check_family(variants: Sequence[RosSystem]) -> Iterator[Finding]:
    """Yield where a variant lacks the value of a quality attribute that another variant of the family has."""
    known = {name for variant in variants for name in _qualities(variant)}
    for variant in variants:
        missing = known - _qualities(variant)
        for name in sorted(missing):
            siblings = [sibling.name for sibling in variants if name in _qualities(sibling)]
            text = f"variant '{variant.name}' has no value for '{name}', as {_listed(siblings)}: add one"
            yield Finding(text, variant.position, "missing-quality")


def families(systems: Iterable[RosSystem]) -> list[list[RosSystem]]:
    """Return the systems that are variants of one another: they have the same components and parameters of these."""
    found: dict[object, list[RosSystem]] = defaultdict(list)
    for system in systems:
        if system.components:
            found[
                tuple(
                    (component.graph_name, str(component.executable), frozenset(p.key for p in component.parameters))
                    for component in sorted(system.components, key=lambda component: component.graph_name)
                )
            ].append(system)
    return [variants for variants in found.values() if len(variants) > 1]


def _qualities(system: RosSystem) -> set[str]:
    return {p.name for p in system.parameters if p.name.startswith("qa_") and p.value is not None}


def _listed(names: Sequence[str], most: int = 3) -> str:
    shown = ", ".join(f"'{name}'" for name in names[:most])
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{shown}{more} {'has' if len(names) == 1 else 'have'}"
