"""Checks whether values have their declared types, and words the errors."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from ros_model.errors import short
from ros_model.language.library import hint
from ros_model.language.notation import type_text

if TYPE_CHECKING:
    from ros_model.language.metamodel import ParameterType, Value
    from ros_model.language.packages import ParameterDeclaration

_FITTING: dict[str, tuple[type, ...]] = {
    "Integer": (int,),
    "Double": (int, float),
    "String": (str,),
    "Boolean": (bool,),
    "Base64": (str,),
    "Date": (str,),
    "List": (list,),
    "Array": (list,),
    "Struct": (dict,),
}
_COMPOUND = ("List", "Array", "Struct")
_BINARY = re.compile(r"0[bB]([01]+)")  # how the published grammar writes Base64
_DATE = re.compile(r"\d{4}-?\d{1,2}-?\d{1,2}T\d{1,2}:\d{1,2}:\d{1,2}")  # ISO 8601, as the grammar and XML-RPC write it


def fault(value: Value, declared: ParameterType) -> str | None:
    """Return why a value is none of a declared type, as what follows `the value`; None if it is one."""
    expected = _FITTING.get(declared.kind)
    if expected is None:
        return None
    wrong_type = not isinstance(value, expected) or (isinstance(value, bool) and bool not in expected)
    if wrong_type or not _well_written(value, declared.kind):
        return f"is no {declared.kind}"
    if isinstance(value, list) and declared.elements:
        return _fault_of_elements(value, declared)
    if isinstance(value, dict) and declared.members:
        return _fault_of_members(value, declared)
    return None


def misfit(role: str, value: Value, name: str, declared: ParameterType) -> str | None:
    """Return what is told of a parameter whose value, or default, is none of its type; None if it is one."""
    found = fault(value, declared)
    if found and isinstance(value, str) and value.startswith(("[", "{")) and declared.kind in _COMPOUND:
        found += f": a cell of a CSV file is text; write the table as YAML, with {name.rpartition('/')[2]}: {value}"
    return f"the {role} {value!r} of '{name}' {found}" if found else None


def type_for(value: Value | None, declared: ParameterDeclaration) -> ParameterType | None:
    """Return the type that counts for a value of a declared parameter.

    Where whole numbers alone tell the type, a number with a point makes it wider: every Integer becomes a Double.
    """
    if value is None or declared.type is None or not declared.is_by_value or fault(value, declared.type) is None:
        return declared.type
    wider = _widened(declared.type)
    return declared.type if fault(value, wider) else wider


def _widened(declared: ParameterType) -> ParameterType:
    return replace(
        declared,
        kind="Double" if declared.kind == "Integer" else declared.kind,
        elements=tuple(map(_widened, declared.elements)),
        members=tuple((name, _widened(member)) for name, member in declared.members),
    )


def element_types(declared: ParameterType, count: int) -> tuple[ParameterType, ...]:
    """Return the types that the elements of a List, or of an Array of so many, must have."""
    return declared.elements * count if declared.kind == "Array" else declared.elements


def bytes_of(text: str) -> bytes | None:
    """Return what Base64 stands for, or bits after `0b`, filled up from the left; None if the text is neither."""
    if bits := _BINARY.fullmatch(text):
        return int(bits[1], 2).to_bytes(-(-len(bits[1]) // 8), "big")
    try:
        return base64.b64decode("".join(text.split()), validate=True)
    except ValueError:
        return None


def _well_written(value: Value, kind: str) -> bool:
    if isinstance(value, str) and kind == "Date":
        return _DATE.fullmatch(value) is not None
    if isinstance(value, str) and kind == "Base64":
        return bytes_of(value) is not None
    if isinstance(value, int) and kind == "Double":
        try:
            float(value)
        except OverflowError:
            return False
    return True


def _fault_of_elements(values: list[Value], declared: ParameterType) -> str | None:
    types = element_types(declared, len(values))
    if len(values) != len(types):
        return f"has {len(values)} member{'s' * (len(values) != 1)}, {_written(declared)} has {len(types)}"
    faults = (
        f"has member {number}, {short(repr(value))}, that {found}"
        for number, (value, kind) in enumerate(zip(values, types, strict=True), start=1)
        if (found := fault(value, kind))
    )
    return next(faults, None)


def _fault_of_members(values: dict[str, Value], declared: ParameterType) -> str | None:
    types = dict(declared.members)
    for name, value in values.items():
        if name not in types:
            return f"has member '{name}', {_written(declared)} has none of that name{hint(name, types)}"
        if found := fault(value, types[name]):
            return f"has member '{name}', {short(repr(value))}, that {found}"
    return None


def _written(declared: ParameterType) -> str:
    return short(type_text(replace(declared, default=None), declared.position))
