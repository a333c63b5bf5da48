"""The simulated systems: models that other tests use, and one that is made up here, unlike the demonstrator."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.tomasys_generator import generate
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBase
from mros1_reasoner.knowledge.model import Direction, Objective
from ros_model.io.project import load_project
from ros_model.language.metamodel import Component, RosSystem
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_manipulator.configuration.configurations import Configuration, FunctionOptions, ManipulatorOptions

TESTS = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class System:
    """A system and its models.

    Attributes:
        name: its name.
        namespace: where it runs, with a slash at each end.
        base: what belongs to no function.
        variants: by name.
        options: of the manipulator.
        described: what each configuration starts.
        knowledge: of the reasoner.
        components: the component of each node, by the node's name without its namespace.
        nodes: the base's nodes by component.
    """

    name: str
    namespace: str
    base: RosSystem
    variants: dict[str, RosSystem]
    options: ManipulatorOptions
    described: dict[str, SystemDescription]
    knowledge: KnowledgeBase
    components: dict[str, str]

    @property
    def functions(self) -> tuple[str, ...]:
        """The names of the functions."""
        return self.options.all_functions

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """What is needed."""
        return self.knowledge.objectives

    @property
    def base_nodes(self) -> dict[str, Component]:
        """The nodes of the base that no variant has, by full name: they run from the start and may die for good."""
        own = {component.name for variant in self.variants.values() for component in variant.components}
        return {
            f"{self.namespace}{component.graph_name}": component
            for component in self.base.components
            if component.name not in own
        }

    def component_of(self, node: str) -> Component | None:
        """Return the model of a node."""
        for system in (self.base, *self.variants.values()):
            for component in system.components:
                if f"{self.namespace}{component.graph_name}" == node:
                    return component
        return None


@cache
def load(name: str) -> System:
    """Return a system by its name, one of NAMES."""
    folder, namespace = _WHERE[name]
    project = load_project(folder)
    with tempfile.TemporaryDirectory() as output:
        (model,) = generate(project, Path(output))
        qualities: dict[str, Any] = project.settings.get("quality_attributes", {})
        directions = {quality: Direction(entry["direction"]) for quality, entry in qualities.items()}
        knowledge = read_knowledge_base([model], (), directions, str(project.settings.get("utility", "")))
    functions: dict[str, Any] = project.settings["functions"]
    of_design = {design: name for name, entry in functions.items() for design in _designs(entry)}
    default = next(iter(functions))
    variants = {variant.name: variant for variant in project.variants}
    configurations = {
        variant: Configuration(variant, of_design.get(variant, default), f"{variant}.launch") for variant in variants
    }
    described = {variant: _describe(system, namespace) for variant, system in variants.items()}
    components = {
        str(entry["node"]): component
        for component, entry in project.settings.get("components", {}).items()
        if entry.get("node")
    }
    options = ManipulatorOptions(configurations, _function_options(configurations.values(), described))
    return System(name, namespace, project.base, variants, options, described, knowledge, components)


def _function_options(
    configurations: Collection[Configuration], described: Mapping[str, SystemDescription]
) -> dict[str, FunctionOptions]:
    """Return the options of each function: nodes of its variants alone are ended where somebody else has them."""
    nodes: dict[str, set[str]] = {}
    for configuration in configurations:
        nodes.setdefault(configuration.function, set()).update(described[configuration.name].nodes)
    shared = {node for node, count in Counter(node for own in nodes.values() for node in own).items() if count > 1}
    return {name: FunctionOptions(kill_nodes=tuple(sorted(own - shared))) for name, own in nodes.items()}


def _designs(entry: Any) -> list[str]:
    designs = entry.get("designs", []) if isinstance(entry, dict) else entry
    return list(designs) if isinstance(designs, list) else []


def _describe(variant: RosSystem, namespace: str) -> SystemDescription:
    nodes = {}
    for component in variant.components:
        name = f"{namespace}{component.graph_name}"
        executable = component.executable
        nodes[name] = NodeDescription(
            name,
            f"{name.rpartition('/')[0]}/",
            executable.package if executable else "package",
            executable.artifact if executable else "node",
            parameters={parameter.key: parameter.value for parameter in component.parameters},
        )
    parameters = {f"{namespace}{parameter.name}": parameter.value for parameter in variant.parameters}
    return SystemDescription(nodes, parameters)


_INTEGRATION = TESTS / "integration/mros1_reasoner"
_WHERE = {
    "station": (_INTEGRATION / "station/models", "/cell/three/"),
    "greenhouse": (_INTEGRATION / "greenhouse/models", "/"),
    "orchard": (Path(__file__).parent / "orchard", "/fleet/r7/"),
    "d2": (TESTS.parent / "catkin_ws/src/metacontrol_sim/models", "/"),
}
NAMES = tuple(_WHERE)
FOLDERS = tuple(str(folder.relative_to(TESTS.parent)) for folder, _ in _WHERE.values())
"""Where the models are, relative to the project."""
