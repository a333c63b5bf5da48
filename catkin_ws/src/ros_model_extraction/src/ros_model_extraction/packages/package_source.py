"""The model of a package, from its source."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ros_model.errors import ModelError
from ros_model.language.metamodel import Position
from ros_model.language.packages import Artifact, Package, PackageSet, remarks_on_types

from ros_model_extraction.io.python_modules import Library
from ros_model_extraction.io.workspace import package_folder
from ros_model_extraction.names import node_name
from ros_model_extraction.node_facts import LoadedNodelet, NodeSource, Remark, SourceError, unique, with_nodelet
from ros_model_extraction.packages.catkin_package import CatkinPackage, Executable, read_package
from ros_model_extraction.packages.message_files import read_specs

NOT_READ = "not read"
"""How remarks begin that say that a file was not understood at all."""

Parameters = Callable[[str], Any]

_LEGEND = (
    "A name with braces is not known from the source: in braces stands the expression, after the @ its place.",
    "Left out, because every node has it: publishing /rosout, listening to /clock, ~get_loggers, ~set_logger_level.",
)


@dataclass(frozen=True)
class ExtractedPackage:
    """The model of a package, what was found of each executable (by its file's name), and what is to be said."""

    package: Package
    nodes: Mapping[str, NodeSource]
    remarks: tuple[Remark, ...]

    def model(self) -> PackageSet:
        """Return the content of a `.ros` file, with remarks as its first comments."""
        no_nodes = [name for name, node in self.nodes.items() if not node.is_node]
        lines = [f"The package {self.package.name}, from its source. Written by rosmodel extract.", *_LEGEND]
        if no_nodes:
            lines.append(f"Executables that start no ROS node: {', '.join(no_nodes)}.")
        lines += remarks_on_types([self.package])
        return PackageSet((self.package,), "\n".join([*lines, *map(str, self.remarks)]))

    @property
    def unread(self) -> tuple[Remark, ...]:
        """Remarks about files that could not be read at all."""
        return tuple(remark for remark in self.remarks if remark.text.startswith(NOT_READ))


def extract_package(folder: Path) -> ExtractedPackage:
    """Return the model of the package in a folder.

    Raises:
        ModelError: its package.xml can't be read. Other files that can't be read are remarks.
    """
    package = read_package(folder)
    nodes = {}
    remarks = list(package.remarks)
    library = Library([folder / "src", folder], folder, package.name)
    for executable in package.executables:
        try:
            nodes[executable.name] = read_executable(package, executable, library)
        except SourceError as error:
            remarks.append(error.remark)
    remarks += library.remarks
    for node in nodes.values():
        remarks += node.remarks
    for executable in package.executables:
        if executable.nodelet:
            started = f"nodelet load {executable.loaded_as} MANAGER"
            remarks.append(
                Remark(executable.position, f"{executable.name} is a nodelet, which is started by {started}")
            )
    specs, said = read_specs(folder)
    artifacts = tuple(
        Artifact(name, (named(node, name).declared(),), position=node.position)
        for name, node in nodes.items()
        if node.is_node
    )
    model = Package(
        package.name,
        artifacts,
        specs,
        package.dependencies,
        external_dependencies=package.external_dependencies,
        position=Position(str(folder), 1, 1),
    )
    return ExtractedPackage(model, nodes, unique([*remarks, *said]))


def read_executable(
    package: CatkinPackage, executable: Executable, library: Library, parameters: Parameters | None = None
) -> NodeSource:
    """Return what an executable's source makes of a node; it `is_node` where it is one.

    Raises:
        SourceError: it can't be read.
    """
    if executable.is_python:
        from ros_model_extraction.python.node_reader import read_python_node

        plugins, configurations = package.plugins, package.configurations
        return read_python_node(executable.sources[0], library, plugins, parameters, configurations)
    from ros_model_extraction.cpp.node_reader import Entry
    from ros_model_extraction.io.cpp_files import read_cpp_node

    entry = Entry(executable.nodelet, package.configurations)
    node = read_cpp_node(executable.sources, package.folder, parameters, entry)
    if executable.nodelet:
        return replace(node, name=executable.name, position=executable.position)
    for loaded in node.nodelets:
        found = _nodelet(package, loaded, library, parameters)
        if found is None:
            said = f"it loads the nodelet {loaded.loaded_as}, whose source is not here: its interfaces are missing"
            node = replace(node, remarks=(*node.remarks, Remark(loaded.position, said)))
        else:
            node = with_nodelet(node, loaded, found)
    return node


def _nodelet(
    package: CatkinPackage, loaded: LoadedNodelet, library: Library, parameters: Parameters | None
) -> NodeSource | None:
    """Return the nodelet that a program loads, of its own or of another package; None where it has no source."""
    owner = package
    name = loaded.loaded_as.partition("/")[0]
    if name != package.name:
        folder = package_folder(name)
        try:
            owner = read_package(folder) if folder else package
        except ModelError:
            return None
    found = next((executable for executable in owner.executables if executable.loaded_as == loaded.loaded_as), None)
    return read_executable(owner, found, library, parameters) if found else None


def named(node: NodeSource, executable: str) -> NodeSource:
    """Return the node with a name that a reference can hold: that of its executable, where its own is not known."""
    name = node.name if node.name and "{" not in node.name else executable
    return replace(node, name=node_name(name.strip("/").replace("/", "_")))
