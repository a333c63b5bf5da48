"""Converts node descriptions, reports and what processes use from and to messages."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from metacontrol_msgs.msg import LaunchedFunction, ProcessUsage
from metacontrol_msgs.msg import NodeDescription as Message

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.launching.report import STATES, LauncherReport
from rosgraph_launcher.usage import Sample, Use

_OPTIONAL = ("cwd", "launch_prefix")  # None in the description is empty in the message
_PLAIN = tuple(
    field.name for field in fields(NodeDescription) if field.name not in ("remaps", "environment", "parameters")
)


def to_message(node: NodeDescription) -> Message:
    """Return the message of a node; its parameters are no part of it, because they are on the parameter server."""
    return Message(
        remaps=[f"{source}:={target}" for source, target in node.remaps],
        environment=[f"{name}={value}" for name, value in node.environment],
        **{name: "" if getattr(node, name) is None else getattr(node, name) for name in _PLAIN},
    )


def from_message(message: Message) -> NodeDescription:
    """Return the node that a message describes, without parameters.

    Raises:
        ValueError: a remapping or a variable has another form.
    """
    plain: dict[str, Any] = {name: getattr(message, name) for name in _PLAIN}
    plain.update({name: plain[name] or None for name in _OPTIONAL})
    return NodeDescription(
        remaps=_pairs(message.remaps, ":=", message.name),
        environment=_pairs(message.environment, "=", message.name),
        **plain,
    )


def _pairs(texts: list[str], between: str, node: str) -> tuple[tuple[str, str], ...]:
    for text in texts:
        if between not in text:
            raise ValueError(f"node {node}: '{text}' is not NAME{between}VALUE")
    return tuple((text.partition(between)[0], text.partition(between)[2]) for text in texts)


def report_message(report: LauncherReport) -> LaunchedFunction:
    """Return the message of a report."""
    return LaunchedFunction(**vars(report))


def report_from(message: LaunchedFunction) -> LauncherReport:
    """Return the report that a message holds.

    Raises:
        ValueError: the function has a state that is none.
    """
    if message.state not in STATES:
        raise ValueError(f"function {message.function!r} has the state {message.state!r}, which is none")
    content = {field.name: getattr(message, field.name) for field in fields(LauncherReport)}
    return LauncherReport(**{**content, "nodes": tuple(message.nodes), "dead": tuple(message.dead)})


def usage_messages(samples: Mapping[int, Sample]) -> list[ProcessUsage]:
    """Return the messages of what processes use, by their ids."""
    return [
        ProcessUsage(root, pid, created, sample.at, use.cpu, use.memory)
        for root, sample in samples.items()
        for (pid, created), use in sample.uses.items()
    ]


def samples_from(messages: Iterable[ProcessUsage]) -> dict[int, Sample]:
    """Return what processes use, by the ids that were asked for."""
    samples: dict[int, Sample] = {}
    for message in messages:
        earlier = samples[message.root].uses if message.root in samples else {}
        use = Use(message.cpu, message.memory)
        samples[message.root] = Sample(message.at, {**earlier, (message.pid, message.created): use})
    return samples
