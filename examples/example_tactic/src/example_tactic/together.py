"""Restart a whole namespace where one of its nodes has to restart: its nodes share something, such as memory."""

from __future__ import annotations

from rosgraph_manipulator.change.tactics import RESTART_COST, ChangeProcesses, Plan, RunningNodes
from rosgraph_manipulator.configuration.difference import Difference

COST = RESTART_COST - 0.1
"""Seconds by which plans are compared. Less than `restart`, so that this tactic comes first where it has a plan."""


def together(difference: Difference, _nodes: RunningNodes) -> Plan | None:
    """Return a plan that restarts the namespaces of all nodes that differ; None where that adds no node."""
    changed = {*difference.replaced, *difference.parameters}
    namespaces = {namespace(node) for node in changed} - {""}
    peers = tuple(node for node in difference.wanted.nodes if node in changed or namespace(node) in namespaces)
    if difference.starts or difference.stops or set(peers) == changed:
        return None
    return Plan("together", COST, (ChangeProcesses(stop=peers, start=peers),))


def namespace(node: str) -> str:
    """Return the namespace of a node, `/arm` for `/arm/driver`; empty for a node that is in none."""
    return node.rpartition("/")[0]
