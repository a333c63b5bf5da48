"""Parameters on the master, and who offers what there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from node_kit.io.xml_rpc import DeniedError
from rosgraph_launcher.io.master import master, system_state

CALLER = "/rosgraph_manipulator"


def get_parameters(names: Iterable[str]) -> dict[str, Any]:
    """Return the values of parameters, by full name; those that are not set are left out.

    Raises:
        CallError: the master does not answer.
    """
    names = list(names)
    with master(CALLER) as connection:
        answers = connection.call_all([("getParam", name) for name in names])
    return {name: value for name, (is_set, value) in zip(names, answers, strict=True) if is_set}


def set_parameters(values: Mapping[str, Any], delete: Iterable[str] = ()) -> None:
    """Delete parameters, then set others, by full name.

    Raises:
        CallError: the master does not answer, or refuses a value.
    """
    names = list(values)
    with master(CALLER) as connection:
        connection.call_all([("deleteParam", name) for name in delete])
        answers = connection.call_all([("setParam", name, values[name]) for name in names])
    for name, (done, _) in zip(names, answers, strict=True):
        if not done:
            raise DeniedError(f"the master refuses parameter {name} = {values[name]!r}")


def publishers(topic: str) -> set[str]:
    """Return the nodes that publish a topic.

    Raises:
        CallError: the master does not answer.
    """
    return set(dict(system_state()[0]).get(topic, ()))


def subscribers(topic: str) -> set[str]:
    """Return the nodes that subscribe to a topic.

    Raises:
        CallError: the master does not answer.
    """
    return set(dict(system_state()[1]).get(topic, ()))


def services_of(node: str) -> list[str]:
    """Return the services that a node offers.

    Raises:
        CallError: the master does not answer.
    """
    return [name for name, owners in system_state()[2] if node in owners]
