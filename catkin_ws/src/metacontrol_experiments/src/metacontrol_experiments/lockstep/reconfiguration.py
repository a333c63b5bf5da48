"""The configurations of navigation, and how one is changed into another by the manipulator's own tactics."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from move_base.parameters.parameters import MoveBaseParameters
from move_base.parameters.reader import read_parameters
from move_base.parameters.reconfiguration import servers
from node_kit.parameters import ParameterError
from rosgraph_manipulator.change import tactics as manipulator

from metacontrol_experiments.lockstep.system import LockstepError, parameter_tree

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rosgraph_launcher.description import NodeDescription

    from metacontrol_experiments.lockstep.system import System

_EXECUTABLE = ("move_base", "move_base")
"""Package and executable of the only node of a configuration that lockstep can run."""


def plan_change(
    system: System, running: str, wanted: str, tactics: Mapping[str, manipulator.Tactic]
) -> manipulator.Plan:
    """Return the cheapest plan from the running to the wanted configuration.

    Raises:
        LockstepError: no tactic has one, or the wanted configuration has nodes that lockstep cannot run.
    """
    navigation_node(system, wanted)
    nodes = RunningNavigation(system, running)
    found, problems = manipulator.plan_change(system.describe(running), system.describe(wanted), nodes, tactics)
    if not found:
        reasons = "; ".join(problems) or "no tactic has a plan"
        raise LockstepError(f"{running} cannot be changed into {wanted}: {reasons}; export a tactic that can")
    return found[0]


def restarts(plan: manipulator.Plan) -> bool:
    """Tell whether a plan starts or stops nodes; without that, the robot drives on."""
    return bool(plan.touched)


def navigation_node(system: System, configuration: str) -> NodeDescription:
    """Return the node that a configuration starts.

    Raises:
        LockstepError: it does not start one node of move_base and no other.
    """
    nodes = list(system.describe(configuration).nodes.values())
    if [(node.package, node.executable) for node in nodes] != [_EXECUTABLE]:
        started = ", ".join(f"{node.name} ({node.package}/{node.executable})" for node in nodes)
        raise LockstepError(
            f"configuration {configuration} starts {started}: lockstep runs one node of move_base; use --engine ros"
        )
    return nodes[0]


def navigation_parameters(system: System, configuration: str) -> MoveBaseParameters:
    """Return the parameters that navigation finds at its start: those of the configuration over the shared ones.

    Raises:
        LockstepError: the configuration's node is not navigation, or a parameter has a wrong value.
    """
    node = navigation_node(system, configuration)
    tree = system.shared_parameters(node.name)
    _merge(tree, parameter_tree(node.parameters))
    try:
        return read_parameters(tree)
    except ParameterError as error:
        raise LockstepError(f"configuration {configuration}: {error}") from error


class RunningNavigation:
    """What navigation takes by dynamic_reconfigure while a configuration runs: what its servers offer on ROS."""

    def __init__(self, system: System, configuration: str) -> None:
        self._system = system
        self._configuration = configuration

    def adjustable(self, node: str) -> Mapping[str, manipulator.Adjustable]:
        """Return the parameters of a node by their name relative to the node's; none for any other node."""
        if node != navigation_node(self._system, self._configuration).name:
            return {}
        found = {}
        for server in servers(navigation_parameters(self._system, self._configuration)):
            definition = importlib.import_module(f"move_base.cfg.{server.definition}Config")
            namespace = f"{node}/{server.namespace}".rstrip("/")
            for name in definition.defaults:
                limits = (definition.min[name], definition.max[name])
                taken = manipulator.Adjustable(namespace, name, definition.type[name], *limits)
                found[f"{server.namespace}/{name}".lstrip("/")] = taken
        return found


def _merge(tree: dict[str, object], other: Mapping[str, object]) -> None:
    """Set the values of another tree in a tree."""
    for name, value in other.items():
        branch = tree.get(name)
        if isinstance(branch, dict) and isinstance(value, dict):
            _merge(branch, value)
        else:
            tree[name] = value
