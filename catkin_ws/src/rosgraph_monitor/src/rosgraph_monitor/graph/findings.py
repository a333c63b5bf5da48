"""The findings of the comparison of graph and model, and their form on /diagnostics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from metacontrol_msgs.msg import DiagnosticWords as Words

from rosgraph_monitor.diagnostics.status import Level, Status

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable


class _NotSet:
    def __str__(self) -> str:
        return "<not set>"


NOT_SET = _NotSet()
NO_NODE: str = Words.GRAPH
"""Stands for the node in findings that concern no single one."""


@dataclass(frozen=True)
class MissingNode:
    """A node of the model that does not run: its state in one word, and the reason in words."""

    node: str
    state: str
    reason: str


@dataclass(frozen=True)
class AdditionalNode:
    """A node that runs but is not in the model."""

    node: str


@dataclass(frozen=True)
class MissingPort:
    """An interface of the model that a running node lacks."""

    node: str
    kind: str
    name: str


@dataclass(frozen=True)
class AdditionalPort:
    """An interface of a running node that is not in the model."""

    node: str
    kind: str
    name: str


@dataclass(frozen=True)
class WrongType:
    """A topic or action whose type is not the expected one."""

    node: str
    name: str
    expected: str
    actual: str


@dataclass(frozen=True)
class MissingConnection:
    """Two running nodes that the model connects, but that share no such topic or action."""

    name: str
    source: str
    target: str
    actual: str
    nodes: tuple[str, str]


@dataclass(frozen=True)
class WrongParameter:
    """A parameter whose value is not the model's. The parameter's name is relative to the node."""

    node: str
    parameter: str
    expected: Any
    actual: Any


PortFinding = MissingPort | AdditionalPort | WrongType | MissingConnection
Finding = MissingNode | AdditionalNode | WrongParameter | PortFinding


def finding_statuses(
    findings: Iterable[Finding],
    configurations_of: Callable[[str, Collection[str]], Iterable[str]] = lambda _node, _parameters: (),
) -> list[Status]:
    """Return one status for each finding; only the wrong parameters of one node share a status.

    The values of "Wrong param configuration" are (parameter, actual value), then (`expected/PARAMETER`, value), then
    (`in configuration`, name). Other findings have the values `expected` and `actual`.

    Args:
        findings: what differs.
        configurations_of: returns the deployed configurations that set parameters of a node.
    """
    statuses = []
    wrong: dict[str, list[WrongParameter]] = {}
    for finding in findings:
        if isinstance(finding, WrongParameter):
            wrong.setdefault(finding.node, []).append(finding)
        else:
            statuses.append(_status(finding))
    for node, parameters in wrong.items():
        actual = tuple((p.parameter, str(p.actual)) for p in parameters)
        expected = tuple((f"expected/{p.parameter}", str(p.expected)) for p in parameters)
        names = configurations_of(node, [p.parameter for p in parameters])
        belongs = tuple((str(Words.IN_CONFIGURATION), name) for name in names)
        statuses.append(Status(Level.ERROR, node, Words.WRONG_PARAMETER, actual + expected + belongs))
    return statuses


def _status(finding: MissingNode | AdditionalNode | PortFinding) -> Status:
    match finding:
        case MissingNode(node, state, reason):
            values = ((str(Words.REASON), reason), ("expected", "running"), ("actual", state))
            return Status(Level.ERROR, node, Words.MISSING_NODE, values)
        case AdditionalNode(node):
            return Status(Level.WARN, node, Words.ADDITIONAL_NODE, (("expected", "not running"), ("actual", "running")))
        case MissingPort(node, kind, name):
            values = (("port", name), ("expected", kind), ("actual", "none"))
            return Status(Level.ERROR, node, Words.MISSING_PORT, values)
        case AdditionalPort(node, kind, name):
            values = (("port", name), ("expected", "none"), ("actual", kind))
            return Status(Level.WARN, node, Words.ADDITIONAL_PORT, values)
        case WrongType(node, name, expected, actual):
            values = (("port", name), ("expected", expected), ("actual", actual))
            return Status(Level.ERROR, node, Words.WRONG_TYPE, values)
        case MissingConnection(name, source, target, actual):
            values = (("connection", name), ("expected", f"{source} -> {target}"), ("actual", actual))
            return Status(Level.ERROR, name, Words.MISSING_CONNECTION, values)
