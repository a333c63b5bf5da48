"""Checks that values and defaults fit their declared types."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.findings import Finding
from ros_model.language.metamodel import RosParameter
from ros_model.language.typed_values import misfit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.language.metamodel import (
        ParameterType,
        Position,
        TypedParameter,
    )


def misfits(parameter: TypedParameter) -> Iterator[Finding]:
    """Yield that a parameter's value, or a default of its type, is none of the type."""
    if parameter.type is None:
        return
    if parameter.value is not None and (text := misfit("value", parameter.value, parameter.name, parameter.type)):
        yield Finding(text, value_place(parameter), "value")
    for declared in _types_within(parameter.type):
        if declared.default is not None and (text := misfit("default", declared.default, parameter.name, declared)):
            yield Finding(text, first_known(declared.default_position, parameter.position), "value")


def _types_within(declared: ParameterType) -> Iterator[ParameterType]:
    """Yield a type, and the types of its elements and members."""
    yield declared
    for inner in (*declared.elements, *(member for _, member in declared.members)):
        yield from _types_within(inner)


def value_place(parameter: TypedParameter | RosParameter) -> Position:
    """Return where a parameter's value stands; where the parameter does, if its value comes from elsewhere."""
    return first_known(parameter.value_position, parameter.position)


def first_known(known: Position, other: Position) -> Position:
    """Return the first of two positions, or the other one where that is not known."""
    return known if known.line else other
