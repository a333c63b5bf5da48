"""Observers of quality attributes as metacontrol.yaml describes them, and as models of nodes."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ros_model.language.metamodel import PortKind
from ros_model.language.packages import Artifact, Node, Package, PackageSet, PortDeclaration

if TYPE_CHECKING:
    from ros_model.project.project import Project

DIAGNOSTICS = PortDeclaration("/diagnostics", PortKind.PUBLISHER, "diagnostic_msgs/DiagnosticArray")


@dataclass(frozen=True)
class ObserverModel:
    """An observer of one quality attribute, or of a property of the surroundings.

    Attributes:
        name: of its class.
        package: the package that it is in.
        quality_attribute: what it observes.
        direction: lower_is_better or higher_is_better; empty for a property of the surroundings.
        topics: (topic, `package/Type`) that it listens to.
        rate: evaluations per second of ROS time.
        lowest: value of its formula that is level 0.
        highest: value of its formula that is level 1.
        outputs: (topic, `package/Type`) that it publishes beside diagnostics.
        max_age: seconds after which a message is stale; None: the default of the base class.
        plugin: `module:Class` where it exists already, else "".
    """

    name: str
    package: str
    quality_attribute: str
    direction: str
    topics: tuple[tuple[str, str], ...]
    rate: float
    lowest: float
    highest: float
    outputs: tuple[tuple[str, str], ...] = ()
    max_age: float | None = None
    plugin: str = ""

    @property
    def module(self) -> str:
        """Name of the module that holds it: `comfort_quality_observer` for ComfortQualityObserver."""
        return snake_case(self.name)

    @property
    def python_package(self) -> str:
        """Name of the Python package that holds the module."""
        return self.package.replace("-", "_")

    @property
    def target(self) -> str:
        """Where the monitor finds it: `module:Class`."""
        return self.plugin or f"{self.python_package}.{self.module}:{self.name}"

    @property
    def export_tag(self) -> str:
        """What is in the <export> of package.xml for the monitor to find it."""
        return f'<rosgraph_monitor observer="{self.target}"/>'


def described_observers(project: Project) -> tuple[ObserverModel, ...]:
    """Return the observers that metacontrol.yaml describes; those that it only names are left out."""
    qualities = project.settings["quality_attributes"]
    return tuple(
        observer_model(entry, project.package, qualities.get(entry["quality_attribute"], {}).get("direction", ""))
        for entry in project.settings["observers"]
        if isinstance(entry, dict)
    )


def observer_model(entry: dict[str, Any], package: str, direction: str) -> ObserverModel:
    """Return the observer that an entry of `observers` describes, which the schema has accepted."""
    plugin = entry.get("plugin", "")
    return ObserverModel(
        name=entry["name"],
        package=plugin.partition(".")[0].partition(":")[0] or package,
        quality_attribute=entry["quality_attribute"],
        direction=direction,
        topics=tuple(entry["topics"].items()),
        rate=float(entry["rate"]),
        lowest=float(entry["range"][0]),
        highest=float(entry["range"][1]),
        outputs=tuple(entry.get("outputs", {}).items()),
        max_age=entry.get("max_age"),
        plugin=plugin,
    )


def observer_packages(observers: Iterable[ObserverModel], header: str = "") -> PackageSet:
    """Return the `.ros` model: each observer as a node of an artifact of its own, in its package."""
    artifacts: dict[str, list[Artifact]] = {}
    for observer in observers:
        inputs = (PortDeclaration(topic, PortKind.SUBSCRIBER, kind) for topic, kind in observer.topics)
        outputs = (PortDeclaration(topic, PortKind.PUBLISHER, kind) for topic, kind in observer.outputs)
        node = Node(observer.module, (DIAGNOSTICS, *outputs, *inputs))
        artifacts.setdefault(observer.package, []).append(Artifact(observer.module, (node,)))
    return PackageSet(tuple(Package(name, tuple(found)) for name, found in artifacts.items()), header)


def snake_case(name: str) -> str:
    """Return `comfort_quality_observer` for `ComfortQualityObserver`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def camel_case(name: str) -> str:
    """Return `RideComfort` for `ride_comfort` and `ride/comfort`."""
    return "".join(part[:1].upper() + part[1:] for part in re.split(r"[_/]+", name))


def variables(topics: Iterable[str]) -> list[str]:
    """Return a Python name for the message of each topic, no two the same."""
    found: list[str] = []
    for topic in topics:
        name = re.sub(r"\W+", "_", topic).strip("_").lower() or "msg"
        name = name if name.isidentifier() else f"_{name}"
        while name in found or keyword.iskeyword(name) or name in {"self", "msgs"}:
            name += "_"
        found.append(name)
    return found
