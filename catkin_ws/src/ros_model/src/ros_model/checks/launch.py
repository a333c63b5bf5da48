"""Checks what no launch file can express: names that ROS does not allow, texts that roslaunch would evaluate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ros_model.errors import ModelError
from ros_model.findings import ERROR, Finding
from ros_model.generators.launch import declared_type, global_name, legal_name, private_name, remaps, resource_name
from ros_model.generators.launch_parameters import check_range, parameter_element, sent
from ros_model.language.library import Unknown

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ros_model.language.library import Library
    from ros_model.language.metamodel import (
        Component,
        ParameterType,
        Reference,
        RosParameter,
        RosSystem,
        SystemParameter,
    )


def check_launch(system: RosSystem, whole: RosSystem, library: Library | None) -> Iterator[Finding]:
    """Yield the names and values for which `generate launch` would refuse a system.

    Args:
        system: the system to check.
        whole: the system whose connections hold.
        library: the models that declare the parameters' types.
    """
    for parameter in system.parameters:
        yield from _refused("name", legal_name, global_name(parameter), parameter.position)
        yield from _value(parameter, parameter.type)
    for component in system.components:
        yield from _component(component, whole, library)
        for private in component.parameters:
            yield from _refused("name", legal_name, private_name(private), private.position)
            if private.value is not None:
                yield from _value(private, declared_type(private, library))


def _component(component: Component, whole: RosSystem, library: Library | None) -> Iterator[Finding]:
    namespace, _, name = component.graph_name.rpartition("/")
    yield from _refused("name", legal_name, name, component.position)
    if namespace:
        yield from _refused("name", legal_name, namespace, component.position)
    executable = component.executable
    if executable and executable.artifact and not _leads_nowhere(executable, library):
        place = executable.position if executable.position.line else component.position
        yield from _refused("name", resource_name, executable.artifact, place)
    yield from _refused("name", list, remaps(component, whole))


def _leads_nowhere(executable: Reference, library: Library | None) -> bool:
    """Return whether a reference is wrong as such, which is found without a launch file."""
    found = library.node(executable) if library else None
    return isinstance(found, Unknown) and found.severity == ERROR


def _value(parameter: RosParameter | SystemParameter, declared: ParameterType | None) -> Iterator[Finding]:
    try:
        value = sent(parameter, declared)
    except ModelError:  # a value that is none of its type is found without a launch file
        return
    if value is None:
        return
    place = parameter.value_position if parameter.value_position.line else parameter.position
    out_of_range = [*_refused("value", check_range, value, place)]
    yield from out_of_range or _refused("substitution", parameter_element, parameter.name, value, place)


def _refused(rule: str, function: Callable[..., object], *arguments: object) -> Iterator[Finding]:
    """Yield that a function refuses its arguments."""
    try:
        function(*arguments)
    except ModelError as error:
        yield Finding(error.message, error.position, rule)
