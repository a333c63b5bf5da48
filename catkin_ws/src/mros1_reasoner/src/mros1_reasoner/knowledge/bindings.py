"""Roles of designs and the components that fill them, as the models say."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.reasoner import Assertion
from mros1_reasoner.knowledge.triples import Graph, decimal_text, local_name


class BindingError(Exception):
    """Roles or bindings can't be used; says which individual, why, and what to do."""


@dataclass(frozen=True)
class Bindings:
    """All bindings, by IRI.

    Attributes:
        components: name of the component that each binding is of.
        roles: IRI of the role that it fills.
        of_designs: bindings that a design is deployed with, by the design's name.
    """

    components: Mapping[str, str]
    roles: Mapping[str, str]
    of_designs: Mapping[str, tuple[str, ...]]

    def filled(self, design: str) -> dict[str, str]:
        """Return the component that a design is deployed with, by the name of the role."""
        return {local_name(self.roles[b]): self.components[b] for b in self.of_designs.get(design, ())}

    def filling(self, role: str) -> list[str]:
        """Return the bindings that can fill a role, by its IRI.

        Where designs are deployed with bindings of the role, these are all that there are.
        """
        all_of_it = [binding for binding, filled in self.roles.items() if filled == role]
        bound = set(itertools.chain(*self.of_designs.values()))
        found = [binding for binding in all_of_it if binding in bound] or all_of_it
        return list({self.components[binding]: binding for binding in found}.values())


def read_bindings(graph: Graph, designs: Mapping[str, str], component_name: Mapping[str, str]) -> Bindings:
    """Return the bindings of a model that have a role and a component.

    Args:
        graph: the model.
        designs: IRI of each design by name.
        component_name: name of each component by IRI.

    Raises:
        BindingError: a design is deployed with two components for one role, or with a binding that lacks something.
    """
    components = {binding: component_name[component] for binding, component in graph.pairs(v.BINDING_COMPONENT)}
    roles = {binding: role for binding, role in sorted(graph.pairs(v.BINDING_ROLE)) if binding in components}
    of_designs: dict[str, tuple[str, ...]] = {}
    for name, iri in designs.items():
        own = sorted(graph.objects_of(iri, v.BINDS))
        filled = [roles.get(binding) for binding in own]
        for binding, role in zip(own, filled, strict=True):
            if role is None:
                raise BindingError(
                    f"{local_name(binding)}, which {name} binds, must have one binding_role and one binding_component"
                )
            if filled.count(role) > 1:
                raise BindingError(f"{name} binds several components to the role {local_name(role)}: give it one")
        if own:
            of_designs[name] = tuple(own)
    return Bindings({binding: components[binding] for binding in roles}, roles, of_designs)


def rebound(graph: Graph, designs: Mapping[str, str], functions: Mapping[str, str]) -> dict[str, str]:
    """Return the design that a design is with other bindings, by name.

    Args:
        graph: the model.
        designs: IRI of each design by name.
        functions: the function that each design solves, by name.

    Raises:
        BindingError: it is no design of the same function, or has other bindings itself.
    """
    names = {iri: name for name, iri in designs.items()}
    found = {names[iri]: names.get(other) for iri, other in sorted(graph.pairs(v.REBINDS)) if iri in names}
    result: dict[str, str] = {}
    for name, other in found.items():
        if other is None or functions[other] != functions[name] or other in found:
            wrong = "is no FunctionDesign" if other is None else "solves another function"
            wrong = f"rebinds {found[other]}, itself" if other in found else wrong
            raise BindingError(f"{name} rebinds {other or 'something'}, which {wrong}: name the design of the model")
        result[name] = other
    return result


def order(graph: Graph, bindings: Bindings) -> Iterator[Assertion]:
    """Yield how many components may fail of each role that a number of them fills, and an order of its bindings.

    The rules B1 to B4 count by them.

    Raises:
        BindingError: fewer components than a role needs can fill it.
    """
    least: dict[str, set[str]] = defaultdict(set)
    for role, text in graph.literals(v.ROLE_LEAST):
        least[role].add(text)
    for role, numbers in sorted(least.items()):
        found = bindings.filling(role)
        try:
            (needed,) = (Decimal(text) for text in numbers)
            fits = 0 < needed <= len(found) and needed == int(needed)
        except (ValueError, ArithmeticError):
            fits = False
        if not fits:
            says = ", ".join(sorted(numbers))
            raise BindingError(
                f"role {local_name(role)} has role_least {says}, and {len(found)} components can fill it: "
                "give it one whole number from 1 to that"
            )
        yield Assertion(role, v.ROLE_SPARES, decimal_text(float(len(found) - needed)), v.XSD + "decimal")
        yield Assertion(role, v.ROLE_LAST_BINDING, found[-1])
        for binding, following in itertools.pairwise(found):
            yield Assertion(binding, v.B_NEXT, following)
