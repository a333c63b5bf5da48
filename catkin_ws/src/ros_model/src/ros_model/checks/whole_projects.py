"""The check of a whole project: its base, each variant with the base, the designs of each function, its observers."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ros_model.checks.exported import exported_findings
from ros_model.checks.families import check_family
from ros_model.checks.projects import needless_words
from ros_model.checks.systems import check_system
from ros_model.errors import ModelError
from ros_model.findings import WARNING, Finding
from ros_model.generators.launch_parameters import harmless
from ros_model.language.metamodel import compose
from ros_model.language.packages import SpecKind
from ros_model.project.project import package_file
from ros_model.project.repairs import REPAIR
from ros_model.project.schema_check import dotted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ros_model.language.library import Library
    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project


def check_project(project: Project, library: Library, sources: Library | None = None) -> Iterator[Finding]:
    """Yield what is wrong with a project that could be loaded.

    Args:
        project: the project.
        library: what is known of packages, those beside the project included.
        sources: what of it is from models of the nodes' source.
    """
    base, started = project.whole_base, {part.name for variant in project.variants for part in variant.components}
    yield from check_system(base, library=library, installed=library.installed, sources=sources, started=started)
    for variant in project.variants:
        # Where nothing is known of packages, the base has told so.
        whole = compose(_with_other_functions(project, variant), variant)
        yield from check_system(variant, whole, library or None, library.installed, sources, started)
    solving = {design.name for function in project.settings["functions"] for design in project.designs(function)}
    for variant in project.variants:
        if variant.name not in solving:
            text = f"functions: none has {variant.name} among its designs: add it to one"
            yield Finding(text, project.source.at("functions"), "settings")
    for function in project.settings["functions"]:  # designs of one function are compared, and only with each other
        yield from check_family(project.designs(function))
    yield from without_nodes(project)
    yield from needless_words(project)
    yield from wrong_arguments(project)
    yield from wrong_parameter_files(project, library)
    yield from wrong_launch_files(project, library)
    yield from unknown_observed_types(project, library)
    yield from exported_findings(project)


def _with_other_functions(project: Project, variant: RosSystem) -> RosSystem:
    """Return the base with the components that other functions deploy beside a variant: it may be connected to them."""
    families = [project.designs(function) for function in project.settings["functions"]]
    others = [design for designs in families if variant not in designs for design in designs]
    own = {component.name for system in (project.base, variant) for component in system.components}
    known = {c.name: c for system in reversed(others) for c in system.components if c.name not in own}
    return replace(project.base, components=(*known.values(), *project.base.components))


def without_nodes(project: Project) -> Iterator[Finding]:
    """Yield variants that start no node; the manipulator refuses their launch files."""
    for variant in project.variants:
        if not variant.components:
            text = f"variant {variant.name} starts no node, so the manipulator refuses it: add one, or take it out"
            yield Finding(text, variant.position, "settings", WARNING)


def wrong_arguments(project: Project) -> Iterator[Finding]:
    """Yield arguments for a node that no variant starts, and those that a launch file can't hold."""
    for name, text in project.settings.get("arguments", {}).items():
        where = project.source.at("arguments", name)
        started = {component.graph_name for variant in project.variants for component in variant.components}
        if started.isdisjoint(project.nodes.get(name, ())):
            yield Finding(f"arguments.{name}: no variant starts such a node: correct the name", where, "settings")
        try:
            harmless(text, where)
        except ModelError as error:
            yield Finding(f"arguments.{name}: {error.message}", where, "substitution")


def wrong_parameter_files(project: Project, library: Library) -> Iterator[Finding]:
    """Yield files of parameters for a node that no variant starts, and those that can't be loaded."""
    started = {component.graph_name for variant in project.variants for component in variant.components}
    for name, text in project.settings.get("parameter_files", {}).items():
        where = project.source.at("parameter_files", name)
        if started.isdisjoint(project.nodes.get(name, ())):
            yield Finding(f"parameter_files.{name}: no variant starts such a node: correct the name", where, "settings")
        package, file = package_file(text)
        own = project.folder.parent if package == project.package else None
        if wrong := library.installed.wrong_parameter_file(package, file, own):
            yield Finding(f"parameter_files.{name}: {wrong.message}", where, "settings", wrong.severity)


def wrong_launch_files(project: Project, library: Library) -> Iterator[Finding]:
    """Yield launch files of repairs that are not there, and arguments of them that roslaunch would evaluate."""
    for name, entry in project.settings["components"].items():
        launch = entry.get(REPAIR, {}).get("launch")
        if not launch:
            continue
        keys = ("components", name, REPAIR, "launch")
        package = launch.get("package", project.package)
        own = project.folder.parent if package == project.package else None
        missing = library.installed.missing_file(package, launch["file"], own)
        if missing:
            where = project.source.at(*keys, "file")
            yield Finding(f"{dotted(keys)}.file: {missing.message}", where, "settings", missing.severity)
        for argument, value in launch.get("args", {}).items():
            where = project.source.at(*keys, "args", argument)
            try:
                harmless(str(value), where)
            except ModelError as error:
                yield Finding(f"{dotted((*keys, 'args', argument))}: {error.message}", where, "substitution")


def unknown_observed_types(project: Project, library: Library) -> Iterator[Finding]:
    """Yield the message types of observers that nobody declares."""
    for number, entry in enumerate(project.settings["observers"]):
        for key in ("topics", "outputs") if isinstance(entry, dict) else ():
            for topic, kind in entry.get(key, {}).items():
                unknown = library.missing_type(SpecKind.TOPIC, kind)
                if unknown:
                    keys = ("observers", number, key, topic)
                    text = f"{dotted(keys)}: {unknown.message}"
                    yield Finding(text, project.source.at(*keys), "unknown-type", unknown.severity)
