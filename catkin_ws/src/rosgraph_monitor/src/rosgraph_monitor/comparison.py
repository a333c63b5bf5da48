"""Comparison of what runs with what should run: a snapshot and the desired system in, findings out."""

from __future__ import annotations

import fnmatch
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosgraph_monitor.status import ADDITIONAL_NODE, MISSING_NODE, WRONG_PARAMETER, Level, Status

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from ros_model.metamodel import Component, RosSystem, Value
    from ros_model.snapshot import GraphSnapshot

DEFAULT_IGNORED = (
    *("rosout", "rosgraph_*", "reasoner", "mission", "mission_*", "rviz*", "rosbag*", "record", "rostopic*"),
    *("rosservice*", "rqt*", "diagnostic_aggregator", "roslaunch*", "rostest*"),
)
"""Nodes that never count as additional: the meta-controller's own, missions and tools."""
RELATIVE_TOLERANCE = 1e-6
ABSOLUTE_TOLERANCE = 1e-9
"""Numbers closer than this are the same: parameters pass through decimal text on their way."""

# rospy: NAME_PID_MILLISECONDS; roscpp: NAME_NANOSECONDS (and tools with epoch seconds, such as /rviz_1700000000).
_ANONYMOUS = re.compile(r".*_\d{10,}$")


class _NotSet:
    def __str__(self) -> str:
        return "<not set>"


NOT_SET = _NotSet()


@dataclass(frozen=True)
class MissingNode:
    """A node of the model that does not run; the reason in words."""

    node: str
    reason: str


@dataclass(frozen=True)
class AdditionalNode:
    """A node that runs but is not in the model."""

    node: str


@dataclass(frozen=True)
class WrongParameter:
    """A parameter whose value is not the model's. The parameter's name is relative to the node."""

    node: str
    parameter: str
    expected: Any
    actual: Any


Finding = MissingNode | AdditionalNode | WrongParameter


def resolved(name: str, namespace: str = "/") -> str:
    """Return the name of a node in the graph, from its name relative to the namespace."""
    return name if name.startswith("/") else f"/{namespace.strip('/')}/{name}".replace("//", "/")


def relative(name: str, namespace: str = "/") -> str | None:
    """Return the name relative to the namespace, without a leading slash; None where it is outside."""
    prefix = f"/{namespace.strip('/')}/".replace("//", "/")
    return name.removeprefix(prefix) if name.startswith(prefix) else None


def compare(
    snapshot: GraphSnapshot,
    desired: RosSystem,
    *,
    dead: Mapping[str, str],
    excused: Collection[str] = (),
    ignored: Iterable[str] = DEFAULT_IGNORED,
    namespace: str = "/",
) -> tuple[Finding, ...]:
    """Compare a snapshot with the desired system.

    Args:
        snapshot: what the master lists.
        desired: what should run: the base composed with the active variants.
        dead: resolved names of nodes that the master lists but that are known not to run, with the reason in words.
        excused: names (relative, as in the findings) of desired nodes that raise no alarm now.
        ignored: shell patterns of names of nodes that may run beside the model.
        namespace: where the system lives; nodes outside it are none of its business.

    Returns:
        Missing nodes, wrong parameters of nodes that run, additional nodes; names are relative to the namespace.
    """
    alive = snapshot.nodes.keys() - dead.keys()
    missing: list[Finding] = []
    wrong: list[Finding] = []
    expected = {}
    for component in desired.components:
        name = component.graph_name
        graph_name = resolved(name, namespace)
        expected[graph_name] = component
        if name in excused:
            continue
        if graph_name in alive:
            wrong.extend(_wrong_parameters(snapshot, component, graph_name))
        else:
            missing.append(MissingNode(name, dead.get(graph_name, "not registered with the master")))
    patterns = tuple(ignored)
    additional = [
        AdditionalNode(name)
        for name in (relative(node, namespace) for node in sorted(alive - expected.keys()))
        if name is not None and name not in excused and not is_ignored(name, patterns)
    ]
    return (*missing, *wrong, *additional)


def is_ignored(name: str, patterns: Iterable[str]) -> bool:
    """Say whether a node may run beside the model: its name is anonymous, or fits a pattern."""
    return bool(_ANONYMOUS.fullmatch(name)) or any(fnmatch.fnmatchcase(name, p.lstrip("/")) for p in patterns)


def same_value(expected: Value, actual: object) -> bool:
    """Compare a value of the model with one of the parameter server.

    Numbers are compared by tolerance, lists element by element, and of a struct only the members that the model gives.
    A text of the model that reads as a number or truth value equals that value, since roslaunch converts such text.
    """
    if isinstance(expected, list):
        return (
            isinstance(actual, list)
            and len(actual) == len(expected)
            and all(same_value(e, a) for e, a in zip(expected, actual, strict=True))
        )
    if isinstance(expected, dict):
        return isinstance(actual, dict) and all(k in actual and same_value(v, actual[k]) for k, v in expected.items())
    if isinstance(expected, str) and not isinstance(actual, str):
        return _same_scalar(_converted(expected), actual)
    return _same_scalar(expected, actual)


def finding_statuses(findings: Iterable[Finding]) -> list[Status]:
    """Return the findings as statuses; the wrong parameters of one node share a status.

    The values of "Wrong param configuration" are (parameter, actual value), and then (`expected/PARAMETER`, value).
    """
    statuses = []
    wrong: dict[str, list[WrongParameter]] = {}
    for finding in findings:
        match finding:
            case MissingNode(node, reason):
                statuses.append(Status(Level.ERROR, node, MISSING_NODE, (("reason", reason),)))
            case AdditionalNode(node):
                statuses.append(Status(Level.WARN, node, ADDITIONAL_NODE))
            case WrongParameter(node):
                wrong.setdefault(node, []).append(finding)
    for node, parameters in wrong.items():
        actual = tuple((p.parameter, str(p.actual)) for p in parameters)
        expected = tuple((f"expected/{p.parameter}", str(p.expected)) for p in parameters)
        statuses.append(Status(Level.ERROR, node, WRONG_PARAMETER, actual + expected))
    return statuses


def _wrong_parameters(snapshot: GraphSnapshot, component: Component, graph_name: str) -> list[WrongParameter]:
    wrong = []
    for parameter in component.parameters:
        if parameter.value is None:
            continue
        try:
            actual = snapshot.parameter(f"{graph_name}/{parameter.key.strip('/')}")
        except KeyError:
            actual = NOT_SET
        if not same_value(parameter.value, actual):
            wrong.append(WrongParameter(component.graph_name, parameter.key, parameter.value, actual))
    return wrong


def _same_scalar(expected: object, actual: object) -> bool:
    if isinstance(expected, bool) or isinstance(actual, bool):
        return expected is actual
    if isinstance(expected, (int, float)) and isinstance(actual, (int, float)):
        return math.isclose(expected, actual, rel_tol=RELATIVE_TOLERANCE, abs_tol=ABSOLUTE_TOLERANCE)
    return expected == actual


def _converted(text: str) -> object:
    """Return what roslaunch makes of the text of a parameter without a type."""
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        return float(text)
    except ValueError:
        return text
