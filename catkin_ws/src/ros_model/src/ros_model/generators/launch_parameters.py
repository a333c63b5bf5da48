"""Parameters of launch files: values with their types, sent as the model says them, none of them evaluated."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING, Any

import yaml

from ros_model.errors import ModelError
from ros_model.language.typed_values import bytes_of, element_types, fault, misfit

if TYPE_CHECKING:
    from ros_model.language.metamodel import ParameterType, Position, RosParameter, SystemParameter, Value

Sent = bool | int | float | str | bytes | list[Any] | dict[str, Any]
"""A value as the parameter server holds it."""

_NO_XML = re.compile(r"[^\t\n\r\x20-\uD7FF\uE000-\uFFFD\U00010000-\U0010FFFF]")
_SUBSTITUTION = re.compile(r"\$\(")


class _Quoting(yaml.SafeDumper):
    """Writes every text in quotes, since rosparam takes more for numbers than YAML does (`deg(90)`)."""


_Quoting.add_representer(str, lambda dumper, text: dumper.represent_scalar("tag:yaml.org,2002:str", text, style='"'))


def sent(parameter: RosParameter | SystemParameter, declared: ParameterType | None) -> Sent | None:
    """Return the value of a parameter, or its declared default, as its declared type has it.

    Raises:
        ModelError: it is none of the type.
    """
    role, value, place = "value", parameter.value, parameter.value_position
    if declared and value is None:
        role, value, place = "default", declared.default, declared.default_position
    if declared is None or value is None:
        return value
    try:
        return _converted(value, declared)
    except (KeyError, ValueError):
        text = misfit(role, value, parameter.name, declared)
        raise ModelError(str(text), place if place.line else parameter.position) from None


def _converted(value: Value, declared: ParameterType) -> Sent:
    """Return a value as its type has it on the parameter server: a Double is never an integer, Base64 is bytes.

    Raises:
        KeyError: a struct has a member that its type lacks.
        ValueError: the value is none of the type in another way.
    """
    if isinstance(value, list) and declared.elements:
        types = element_types(declared, len(value))
        return [_converted(item, kind) for item, kind in zip(value, types, strict=True)]
    if isinstance(value, dict) and declared.members:
        members = dict(declared.members)
        return {name: _converted(item, members[name]) for name, item in value.items()}
    if declared.kind == "String" and isinstance(value, (bool, int, float)):  # as the cells of tables are read
        return str(value).lower() if isinstance(value, bool) else str(value)
    if found := fault(value, declared):
        raise ValueError(found)
    if isinstance(value, str) and declared.kind == "Base64":
        return bytes_of(value) or b""
    return float(value) if isinstance(value, int) and declared.kind == "Double" else value


def parameter_element(name: str, value: Sent, where: Position) -> ET.Element:
    """Return a typed `<param>`, or `<rosparam>` for what that can not carry: lists, structs, bytes, outer blanks."""
    check_range(value, where)
    for kind, word in ((bool, "bool"), (int, "int"), (float, "double"), (str, "str")):
        if isinstance(value, kind) and not (isinstance(value, str) and value != value.strip()):
            text = str(value).lower() if kind is bool else str(value)
            return ET.Element("param", {"name": name, "type": word, "value": harmless(text, where)})
    element = ET.Element("rosparam", {"param": name, "subst_value": "false"})
    text = yaml.dump(
        value, Dumper=_Quoting, default_flow_style=True, sort_keys=False, width=math.inf, allow_unicode=True
    )
    element.text = harmless(text.removesuffix("\n...\n").strip(), where)
    return element


def check_range(value: Sent, where: Position) -> None:
    """Check that the parameter server can hold a value's numbers.

    Raises:
        ModelError: it can't.
    """
    if isinstance(value, (list, dict)):
        for item in value.values() if isinstance(value, dict) else value:
            check_range(item, where)
    elif isinstance(value, int) and not -(1 << 31) <= value < 1 << 31:
        raise ModelError(f"the integer {value} has more than 32 bits, which the parameter server can't hold", where)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ModelError(f"the value {value} is no number: give a finite one", where)


def harmless(text: str, where: Position) -> str:
    """Return a text that a launch file can hold, and that roslaunch does not evaluate.

    Raises:
        ModelError: it is none.
    """
    if _SUBSTITUTION.search(text):
        raise ModelError(f"{text!r} holds '$(', which roslaunch would evaluate: take it out", where)
    if bad := _NO_XML.search(text):
        raise ModelError(f"{text!r} holds the character {bad[0]!r}, which XML can't: take it out", where)
    return text
