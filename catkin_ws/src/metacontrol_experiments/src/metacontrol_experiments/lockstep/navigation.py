"""Navigation in lockstep: the parameters of a configuration's node of move_base, and what it takes while it runs."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from move_base.navigation.navigator import Navigator
from move_base.parameters.parameters import MoveBaseParameters, ParameterError, read_parameters
from move_base.parameters.reconfiguration import servers
from rosgraph_manipulator.change.tactics import Adjustable

from metacontrol_experiments.lockstep.system import LockstepError, parameter_tree

if TYPE_CHECKING:
    from collections.abc import Mapping

    from move_base.costmap.static_map import StaticMap
    from rosgraph_manipulator.configuration.description import NodeDescription

    from metacontrol_experiments.lockstep.system import System

_EXECUTABLE = ("move_base", "move_base")
"""Package and executable of the only node of a configuration that lockstep can run."""
_MAP_FRAME = "map"


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

    def adjustable(self, node: str) -> Mapping[str, Adjustable]:
        """Return the parameters of a node by their name relative to the node's; none for any other node."""
        if node != navigation_node(self._system, self._configuration).name:
            return {}
        found = {}
        for server in servers(navigation_parameters(self._system, self._configuration)):
            definition = importlib.import_module(f"move_base.cfg.{server.definition}Config")
            namespace = f"{node}/{server.namespace}".rstrip("/")
            for name in definition.defaults:
                limits = (definition.min[name], definition.max[name])
                taken = Adjustable(namespace, name, definition.type[name], *limits)
                found[f"{server.namespace}/{name}".lstrip("/")] = taken
        return found


def start_navigator(parameters: MoveBaseParameters, static_map: StaticMap) -> Navigator:
    """Return the navigator of a node that has just started and has received the map."""
    navigator = Navigator(parameters)
    navigator.set_map(static_map, _MAP_FRAME)
    return navigator


def _merge(tree: dict[str, object], other: Mapping[str, object]) -> None:
    """Set the values of another tree in a tree."""
    for name, value in other.items():
        branch = tree.get(name)
        if isinstance(branch, dict) and isinstance(value, dict):
            _merge(branch, value)
        else:
            tree[name] = value
