"""The system that a launch file starts, as roslaunch itself reads the file, with interfaces from the nodes' sources."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import rospkg
from node_kit.yaml_text import YamlError, parse_yaml
from ros_model.errors import ModelError
from ros_model.io.launch_files import NotRun
from ros_model.io.launch_files import load as load_by_roslaunch
from ros_model.language.graph_names import resolve
from ros_model.language.metamodel import PortKind, Reference, topic_suffixes
from ros_model.language.remappings import remark_lines

from ros_model_extraction import ros_defaults as plumbing
from ros_model_extraction.io.python_modules import Library
from ros_model_extraction.names import as_seen_from, node_name, split_name
from ros_model_extraction.node_facts import NodeSource, SourceError
from ros_model_extraction.packages.catkin_package import CatkinPackage, read_package
from ros_model_extraction.packages.package_source import named, read_executable
from ros_model_extraction.running.graph import End, Instance, Models, assemble, label_of, share_out
from ros_model_extraction.values import leaves

_SPECIAL = "__"


@dataclass(frozen=True)
class LaunchedNode:
    """A node as a launch file has it; names are resolved, `remaps` from full name to full name."""

    name: str
    package: str
    type: str
    remaps: Mapping[str, str]
    private: Mapping[str, Any]  # parameters given as `_name:=value` among its arguments
    unsaid: tuple[str, ...] = ()  # what a model has no words for
    pinned: frozenset[str] = frozenset()  # names of a node at the root that are remapped to names with a leading slash
    words: tuple[str, ...] = ()  # its arguments but for remappings, parameters and options

    @property
    def nodelet(self) -> str:
        """What it loads a nodelet by, `package/Class`; "" where it is no nodelet."""
        match (self.package, self.type, *self.words):
            case ("nodelet", "nodelet", "load" | "standalone", kind, *_):
                return kind
        return ""

    @property
    def source_package(self) -> str:
        """The package that has its source."""
        return self.nodelet.partition("/")[0] or self.package

    @property
    def manager(self) -> str:
        """The full name of the node that has its interfaces in the graph: that of a nodelet is its manager."""
        is_loaded = self.nodelet and self.words[0] == "load" and len(self.words) > 2
        return resolve(self.words[2], self.name) if is_loaded else self.name


def read_launch_file(path: Path, arguments: Sequence[str] = (), *, runs_programs: bool = False) -> Models:
    """Return the models of what a launch file starts.

    Args:
        path: the launch file.
        arguments: `name:=value`, as for roslaunch.
        runs_programs: run those that the file names in `command=`; else the parameters that they give are left out.

    Raises:
        ModelError: roslaunch refuses the file; says what it says.
    """
    nodes, parameters = load(path, arguments, runs_programs)
    not_run = {name: value.command for name, value in parameters.items() if isinstance(value, NotRun)}
    parameters = {name: value for name, value in parameters.items() if name not in not_run}
    private = [(f"{node.name}/{name}", value) for node in nodes for name, value in node.private.items()]
    tree: dict[str, Any] = {}
    sources = _Sources()
    instances = {}
    lines = [
        f"Left out: the parameter {name}, which a program gives that was not run: {command}"
        for name, command in sorted(not_run.items())
    ]
    lines += [
        f"Left out: the parameter {gone}, which {name} replaces: no name has both a value and others below it"
        for name, value in [*sorted(parameters.items()), *private]
        for gone in _put(tree, name, value)
    ]
    names = [node.name for node in nodes]
    managed: dict[str, tuple[str, list[End]]] = {}
    for node in nodes:
        source = sources.node(node, tree)
        reference = Reference(node.package, node.type, node_name(split_name(node.name)[1]))
        instance = Instance(node.name, *label_of(node.name, names), reference)
        if source is None or not source.is_node:
            lines.append(f"The interfaces of {node.name} are not known: {sources.problem(node)}.")
        else:
            if not node.nodelet:
                instance.reference = Reference(node.package, node.type, named(source, node.type).name)
            instance.declared = named(source, node.type).declared()
            instance.ends = _ends(node, source)
            lines += [f"{node.source_package}/{remark}" for remark in source.remarks]
        if node.manager != node.name:
            managed[node.name] = node.manager, instance.ends
            instance.declared = replace(instance.declared, ports=()) if instance.declared else None
            instance.ends = []
        instances[node.name] = instance
        lines += _beside(node, instance.ends)
    for name, (manager, ends) in managed.items():
        lines += _with_nodelet(instances, name, manager, ends)
    unowned = [(key, value) for key, value in share_out(tree, instances) if not plumbing.is_bookkeeping_parameter(key)]
    given = f" with {' '.join(arguments)}" if arguments else ""
    title = [
        f"The system that {path.name}{given} starts. Written by rosmodel extract.",
        "A name with braces is not known from the source: in braces stands the expression, after the @ its place.",
    ]
    name = re.sub(r"[^A-Za-z0-9_-]", "_", path.name.partition(".")[0]) or "launch"
    return assemble(name, instances, unowned, [*title, *dict.fromkeys(lines)])


def _with_nodelet(instances: Mapping[str, Instance], name: str, manager: str, ends: Sequence[End]) -> Iterator[str]:
    """Give the interfaces of a nodelet to its manager, which has them in the graph; yield what is to be said.

    Their names and remappings are those of the node that loads it, which has its parameters, too.
    """
    if manager not in instances:
        yield f"Left out: the interfaces of the nodelet {name}: its manager {manager} has them, started elsewhere."
    elif ends:
        owner = instances[manager]
        known = {(end.kind, end.name) for end in owner.ends}
        owner.ends += [replace(end, node=manager, declared="") for end in ends if (end.kind, end.name) not in known]
        yield f"{manager} has the interfaces of the nodelet {name}, as in the running graph."


def load(path: Path, arguments: Sequence[str], runs_programs: bool) -> tuple[list[LaunchedNode], dict[str, Any]]:
    """Return the nodes of a launch file, and the parameters that it sets, by full name, as roslaunch reads it.

    Raises:
        ModelError: roslaunch refuses the file.
    """
    for argument in arguments:
        if ":=" not in argument:
            raise ModelError(f"argument {argument!r} is not NAME:=VALUE")
    config = load_by_roslaunch(path, arguments, runs_programs=runs_programs)
    nodes = [_launched(node) for node in config.nodes]
    return nodes, {name: parameter.value for name, parameter in config.params.items()}


def _launched(node: Any) -> LaunchedNode:
    full = resolve(node.name, f"{node.namespace.rstrip('/')}/_")
    remaps = [(str(old), str(new)) for old, new in node.remap_args]
    private = {}
    plain = []
    try:
        words = shlex.split(node.args or "")
    except ValueError:
        words = (node.args or "").split()
    for word in words:
        old, assigned, new = word.partition(":=")
        if not assigned or old.startswith(_SPECIAL):
            plain.append(word)
            continue
        if old.startswith("_"):
            private[old[1:]] = _scalar(new)
        else:
            remaps.append((old, new))
    resolved = {resolve(old, full): resolve(new, full) for old, new in remaps}
    unsaid = (
        ("args", shlex.join(plain)),
        ("launch-prefix", node.launch_prefix),
        ("env", " ".join(f"{name}={value}" for name, value in node.env_args)),
        ("machine", node.machine_name),
        ("respawn", "true" if node.respawn else ""),
        ("required", "true" if node.required else ""),
    )
    said = tuple(f'{key}="{value}"' for key, value in unsaid if value)
    is_at_root = not split_name(full)[0]
    pinned = frozenset(resolve(old, full) for old, new in remaps if is_at_root and new.startswith("/"))
    said_plainly = tuple(word for word in plain if not word.startswith("-"))
    return LaunchedNode(full, node.package, node.type, resolved, private, said, pinned, said_plainly)


class _Sources:
    """Reads the source of launched nodes."""

    def __init__(self) -> None:
        self._packages: dict[str, CatkinPackage | str] = {}
        self._libraries: dict[str, Library] = {}
        self._problems: dict[str, str] = {}
        self._installed = rospkg.RosPack()

    def node(self, node: LaunchedNode, tree: Mapping[str, Any]) -> NodeSource | None:
        """Return what the source of a node makes of it with these parameters; None where there is no source."""
        kind = node.nodelet
        package = self._package(node.source_package)
        if isinstance(package, str):
            self._problems[node.name] = package
            return None
        known = (e for e in package.executables if (e.loaded_as == kind if kind else e.name == node.type))
        executable = next(known, None)
        if executable is None:
            self._problems[node.name] = f"the source of {kind or node.type} is not in {package.folder}"
            return None
        library = self._libraries.setdefault(
            package.name, Library([package.folder / "src"], package.folder, package.name)
        )
        try:
            return read_executable(package, executable, library, lambda name: _lookup(tree, resolve(name, node.name)))
        except SourceError as error:
            self._problems[node.name] = str(error.remark)
            return None

    def problem(self, node: LaunchedNode) -> str:
        """Return why a node's interfaces are not known."""
        return self._problems.get(node.name, f"the source of {node.package}/{node.type} starts no node")

    def _package(self, name: str) -> CatkinPackage | str:
        if name not in self._packages:
            try:
                self._packages[name] = read_package(Path(self._installed.get_path(name)))
            except rospkg.ResourceNotFound:
                self._packages[name] = f"the package {name} is not installed"
            except ModelError as error:
                self._packages[name] = str(error)
        return self._packages[name]


def _ends(node: LaunchedNode, source: NodeSource) -> list[End]:
    """Return a node's interfaces by their resolved and remapped names; unresolved names stay as they are."""
    ends: dict[tuple[PortKind, str], End] = {}
    for port in source.ports:
        full = resolve(port.name, node.name) if port.is_resolved else port.name
        name = _remapped(port.kind, full, node.remaps) if port.is_resolved else port.name
        told = {full + suffix for suffix in topic_suffixes(port.kind)} & node.remaps.keys()
        is_absolute = told <= node.pinned if told else port.name.startswith("/")
        ends.setdefault((port.kind, name), End(node.name, port.kind, name, port.type, port.name, is_absolute))
    return [end for end in ends.values() if not plumbing.is_plumbing(end)]


def _beside(node: LaunchedNode, ends: Sequence[End]) -> Iterator[str]:
    """Yield what a launch file says of a node and no interface in the model does; models have words for none of it."""
    kept = {resolve(end.declared, node.name) for end in ends if end.declared}
    actions = {name + topic for name in kept for topic in topic_suffixes(PortKind.ACTION_SERVER)}
    more = [pair for pair in sorted(node.remaps.items()) if pair[0] != pair[1] and pair[0] not in kept | actions]
    yield from remark_lines(
        {node.name: [(as_seen_from(node.name, old), as_seen_from(node.name, new)) for old, new in more]}
    )
    if node.unsaid:
        yield f"Left out: {', '.join(node.unsaid)} of {node.name}: a model has no words for it."


def _remapped(kind: PortKind, name: str, remaps: Mapping[str, str]) -> str:
    if kind in (PortKind.ACTION_SERVER, PortKind.ACTION_CLIENT):  # a remapping names its topics
        return remaps.get(f"{name}/goal", f"{name}/goal").removesuffix("/goal")
    return remaps.get(name, name)


def _put(tree: dict[str, Any], name: str, value: Any) -> list[str]:
    """Set a parameter, and return the names of those that it replaces, which are above or below it."""
    *namespaces, last = name.strip("/").split("/")
    replaced = []
    for count, part in enumerate(namespaces, 1):
        inner = tree.get(part, {})
        if not isinstance(inner, dict):
            replaced.append(f"/{'/'.join(namespaces[:count])}")
            inner = {}
        tree[part] = inner
        tree = inner
    full = f"/{'/'.join([*namespaces, last])}"
    now = {below for below, _ in leaves({full: value})}
    replaced += [below for below, _ in leaves({full: tree.get(last, {})}) if below not in now]
    tree[last] = value
    return replaced


def _lookup(tree: Any, name: str) -> Any:
    for part in name.strip("/").split("/"):
        if not isinstance(tree, dict):
            raise KeyError(name)
        tree = tree[part]
    return tree


def _scalar(text: str) -> Any:
    """Return a parameter given on the command line, typed as roslaunch does it."""
    try:
        return parse_yaml(text)
    except YamlError:
        return text
