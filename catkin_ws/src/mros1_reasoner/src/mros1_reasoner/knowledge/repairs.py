"""How components are repaired, as the models say."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Repair
from mros1_reasoner.knowledge.triples import Graph, Triple, iri_of, local_name

PROPERTIES = (v.REPAIRS, v.REPAIR_DURATION, v.REPAIR_SUCCESS, v.REPAIR_ATTEMPTS)
_ANNOTATIONS = (v.RDFS_LABEL, v.RDFS_COMMENT)
_CLASSES = (v.REPAIR, v.OWL_NAMED_INDIVIDUAL)


class RepairError(Exception):
    """A repair can't be used; says which individual, why, and what to do."""


def read_repairs(graph: Graph, component_name: Mapping[str, str]) -> dict[str, Repair]:
    """Return how components are repaired, by the component's name.

    Args:
        graph: the model.
        component_name: name of each component by IRI.

    Raises:
        RepairError: a Repair lacks something, has a value that can't be, or repairs what another one repairs.
    """
    names: dict[str, str] = {}
    found: dict[str, Repair] = {}
    for iri in sorted(_individuals(graph)):
        name, repair = local_name(iri), _read(graph, iri, component_name)
        if repair.component in found:
            raise RepairError(
                f"{names[repair.component]} and {name} both repair {repair.component}: leave one of them out"
            )
        found[repair.component], names[repair.component] = repair, name
    return found


def about_repairs(graph: Graph) -> list[Triple]:
    """Return the statements of a model that say nothing but how components are repaired."""
    repairs = _individuals(graph)

    def is_about(triple: Triple) -> bool:
        predicate = iri_of(triple[1])
        is_plain = predicate in PROPERTIES or predicate in _ANNOTATIONS
        return is_plain or (predicate == v.RDF_TYPE and iri_of(triple[2]) in _CLASSES)

    return [triple for triple in graph.triples if iri_of(triple[0]) in repairs and is_about(triple)]


def _individuals(graph: Graph) -> set[str]:
    return graph.instances(v.REPAIR).union(*(graph.subjects(name) for name in PROPERTIES))


def _read(graph: Graph, iri: str, component_name: Mapping[str, str]) -> Repair:
    name, components = local_name(iri), graph.objects_of(iri, v.REPAIRS)
    if len(components) != 1:
        raise RepairError(f"Repair {name} must have one repairs: name the component")
    component = components.pop()
    if component not in component_name:
        raise RepairError(f"{name} repairs {local_name(component)}, which is no Component: name one of the model")
    duration = _number(graph, iri, v.REPAIR_DURATION, lambda s: s > 0, "one number > 0, in s")
    success = _number(graph, iri, v.REPAIR_SUCCESS, lambda share: 0 <= share <= 1, "one number from 0 to 1")
    attempts = _number(graph, iri, v.REPAIR_ATTEMPTS, lambda n: n >= 1 and n == int(n), "one whole number from 1")
    if duration is None:
        raise RepairError(f"Repair {name} has no repair_duration: give it one number > 0, in s")
    return Repair(
        component_name[component],
        duration,
        Repair.success if success is None else success,
        Repair.attempts if attempts is None else int(attempts),
    )


def _number(graph: Graph, iri: str, predicate: str, fits: Callable[[float], bool], wanted: str) -> float | None:
    """Return the number that an individual has by a property; None: it has none."""
    texts = {*graph.literals_of(iri, predicate), *map(local_name, graph.objects_of(iri, predicate))}
    if not texts:
        return None
    numbers = {_as_number(text) for text in texts}
    number = numbers.pop() if len(numbers) == 1 else math.nan
    if math.isfinite(number) and fits(number):
        return number
    says = ", ".join(sorted(text.removesuffix(".0") for text in texts))
    raise RepairError(f"{local_name(predicate)} of {local_name(iri)} is {says}: give it {wanted}")


def _as_number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
