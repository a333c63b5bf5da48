"""The system of a mission: its nodes with their parameters, its configurations and its models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ros_model.language.metamodel import RosSystem
    from rosgraph_launcher.description import SystemDescription
    from rosgraph_manipulator.configuration.configurations import Configuration


class LockstepError(RuntimeError):
    """The mission cannot be run in lockstep; the message says why."""


@dataclass(frozen=True)
class System:
    """What launch files and models say.

    Attributes:
        launched: nodes and parameters of the launch file that starts the whole system.
        configurations: what the manipulator can deploy, by name.
        base: the model of the system without a variant.
        describe: returns the nodes that a configuration of this name starts; raises LockstepError.
        variant: returns the model of a configuration of this name; raises ModelError.
    """

    launched: SystemDescription
    configurations: Mapping[str, Configuration]
    base: RosSystem
    describe: Callable[[str], SystemDescription]
    variant: Callable[[str], RosSystem]

    def function(self, configuration: str) -> str:
        """Return the function that a configuration provides."""
        return self.configurations[configuration].function

    def shared_parameters(self, node: str) -> dict[str, Any]:
        """Return the tree of parameters that are set in a node's namespace before any configuration is deployed."""
        prefix = f"{node}/"
        shared = self.launched.parameters
        return parameter_tree({key.removeprefix(prefix): shared[key] for key in shared if key.startswith(prefix)})


def private_parameters(launched: SystemDescription, package: str, executable: str) -> dict[str, Any]:
    """Return the tree of private parameters of the node that runs an executable.

    Raises:
        LockstepError: there is no such node, or more than one.
    """
    found = [node for node in launched.nodes.values() if (node.package, node.executable) == (package, executable)]
    if len(found) != 1:
        raise LockstepError(f"the launch file starts {len(found)} nodes {package}/{executable}: lockstep needs one")
    return parameter_tree(found[0].parameters)


def parameter_tree(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters with names such as a/b as the tree that the parameter server makes of them."""
    tree: dict[str, Any] = {}
    for key, value in parameters.items():
        *folders, name = key.split("/")
        branch = tree
        for folder in folders:
            branch = branch.setdefault(folder, {})
        branch[name] = value
    return tree
