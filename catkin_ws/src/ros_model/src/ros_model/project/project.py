"""The project of a robot: what `metacontrol.yaml` says, and the models that it names."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ros_model.language.library import Library
from ros_model.project.repairs import REPAIR, repairs_of
from ros_model.project.requirements import WORDS, requirements_of
from ros_model.project.roles import roles_of

if TYPE_CHECKING:
    from ros_model.language.metamodel import Position, RosSystem
    from ros_model.project.requirements import Requirements
    from ros_model.project.roles import Roles
    from ros_model.project.settings import Settings

DIRECTIONS = ("lower_is_better", "higher_is_better")


def package_file(text: str) -> tuple[str, str]:
    """Return package and file of `package://PACKAGE/FILE`."""
    package, _, file = text.removeprefix("package://").partition("/")
    return package, file


@dataclass(frozen=True)
class Project:
    """A base system, its variants and what metacontrol.yaml says about them.

    Attributes:
        folder: the folder of metacontrol.yaml; the paths in it are relative to this.
        settings: the content of metacontrol.yaml, checked.
        base: the system without the choices that variants make, and without the components that some of them lack.
        variants: one partial system each, composed with the base (metamodel.compose).
        source: metacontrol.yaml, for positions in errors.
        whole_base: the system as its file has it.
        by_table: names of the variants that a table gives; the others are files of their own.
        packages_folder: where each variant is to become a catkin package, the published layout; None: plain files.
        read_library: reads the `.ros` models beside metacontrol.yaml, and below.
    """

    folder: Path
    settings: dict[str, Any]
    base: RosSystem
    variants: tuple[RosSystem, ...]
    source: Settings = field(repr=False, compare=False)
    whole_base: RosSystem = field(repr=False)
    by_table: frozenset[str] = frozenset()
    packages_folder: Path | None = None
    read_library: Callable[[], Library] = field(default=Library, repr=False, compare=False)

    @cached_property
    def library(self) -> Library:
        """What the `.ros` models beside metacontrol.yaml, and below, declare; read when it is asked for.

        Raises:
            ModelError: one can't be read.
        """
        return self.read_library()

    @property
    def package(self) -> str:
        """Name of the catkin package that holds the models and what is generated from them."""
        return str(self.settings["package"])

    @property
    def base_file(self) -> str:
        """Name of the file, in the folder of the models, that holds `base`."""
        name = str(self.settings["base"])
        return name if self.base == self.whole_base else f"{Path(name).stem}.core.rossystem"

    def designs(self, function: str) -> tuple[RosSystem, ...]:
        """Return the variants that solve a function."""
        names = self.settings["functions"][function]["designs"]
        return tuple(v for v in self.variants if names == "all" or v.name in names)

    def function_of(self, variant: str) -> str:
        """Return the function that a variant solves.

        Raises:
            ModelError: no function names it among its designs.
        """
        for function in self.settings["functions"]:
            if any(design.name == variant for design in self.designs(function)):
                return str(function)
        raise self.source.error(f"none has {variant} among its designs: add it to one", "functions")

    def required_functions(self, variant: str) -> tuple[str, ...]:
        """Return the functions that must be provided for a variant to work.

        Raises:
            ModelError: no function names the variant among its designs.
        """
        required = self.settings["functions"][self.function_of(variant)].get("requires", [])
        return tuple(required.get(variant, ()) if isinstance(required, dict) else required)

    def required_components(self) -> dict[str, frozenset[str]]:
        """Return, for each variant, the components that it can't do without."""
        return {name: frozenset(found.components) for name, found in self.requirements.items()}

    @cached_property
    def requirements(self) -> dict[str, Requirements]:
        """What each variant requires, and why."""
        return requirements_of(self)

    @cached_property
    def roles(self) -> Roles:
        """Roles of the variants, and the components that fill them."""
        return roles_of(self)

    @cached_property
    def components(self) -> dict[str, dict[str, Any]]:
        """What stands for each component in the running graph, by its name, and nothing else of it."""
        entries = {
            name: {key: value for key, value in entry.items() if key not in (*WORDS, REPAIR)}
            for name, entry in self.settings["components"].items()
        }
        return {name: entry for name, entry in entries.items() if entry}

    @cached_property
    def repairs(self) -> dict[str, dict[str, Any]]:
        """How components are repaired, by their names in the running system."""
        return repairs_of(self)

    @property
    def arguments(self) -> dict[str, tuple[str, Position]]:
        """What nodes are started with, by their names in the graph, and where that is written."""
        given = self.settings.get("arguments", {})
        return {
            node: (text, self.source.at("arguments", name))
            for name, text in given.items()
            for node in self.nodes.get(name, ())
        }

    @property
    def parameter_files(self) -> dict[str, str]:
        """Files of nodes' parameters, by their names in the graph, as a launch file names them."""
        return {
            node: "$(find {})/{}".format(*package_file(text))
            for name, text in self.settings.get("parameter_files", {}).items()
            for node in self.nodes.get(name, ())
        }

    @cached_property
    def nodes(self) -> dict[str, list[str]]:
        """Graph names of the nodes of the base and the variants, by the names of their components and by themselves."""
        found: dict[str, dict[str, None]] = defaultdict(dict)
        for system in (self.whole_base, *self.variants):
            for component in system.components:
                for name in (component.name, component.graph_name):
                    found[name][component.graph_name] = None
        return {name: list(nodes) for name, nodes in found.items()}

    def names_of(self, component: str) -> frozenset[str]:
        """Return the names that a component of the models, or of metacontrol.yaml, has in the running system.

        It is the name of the entry of `components` that has its node, else the node's own. Two components of one name
        in two namespaces have two names.
        """
        mapped = self.components
        if component in mapped:
            return frozenset([component])
        named = {str(entry["node"]).strip("/"): str(name) for name, entry in mapped.items() if "node" in entry}
        return frozenset(named.get(node, node) for node in self.nodes.get(component, [component]))
