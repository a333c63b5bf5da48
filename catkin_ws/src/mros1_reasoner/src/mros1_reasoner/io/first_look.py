"""Collects what `rosmodel doctor` judges: the package of a project, the running nodes, the network of this host."""

from __future__ import annotations

import contextlib
import importlib
import os
import socket
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit
from xml.etree import ElementTree

import psutil
import rosgraph.network
import rospkg
from node_kit.io.xml_rpc import CallError, GoneError
from node_kit.plugins import PluginError
from ros_model.errors import ModelError
from ros_model.generators import MARK, find_generators
from ros_model.io.launch_files import load
from ros_model.io.models import files_in, read_packages
from ros_model.language.any_language import PACKAGES
from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.ownership import is_this_host, look_up
from rosgraph_launcher.io.this_host import resolved as addresses_of
from rosgraph_manipulator.configuration.configurations import ConfigurationError, action_type
from rosgraph_monitor.graph.comparison import Scope
from rosgraph_monitor.graph.defaults import parameter_defaults
from rosgraph_monitor.graph.names import instance, resolved
from rosgraph_monitor.graph.wiring import port_types
from rosgraph_monitor.observers import plugins

from mros1_reasoner.doctor.complaints import managed_nodes
from mros1_reasoner.doctor.facts import Launched, ObserverFacts, PackageFacts, SystemFacts
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.pellet.spawning import find_jvm, jar_folder

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ros_model.graph.snapshot import GraphSnapshot
    from ros_model.project.project import Project

_WORKERS = 16
_HEAD = 200  # bytes, in which generated files say that they are
_SECOND_REMEDY = ": correct it, or remove the export from package.xml"
_PUBLISHED_LAYOUT = "command: roslaunch"
"""How config/rosgraph_manipulator.yaml names variants that are packages of their own."""


_WITH_VALUE = ("-p", "--port", "-w", "--numworkers", "-t", "--timeout", "-c", "--child", "-u", "--server_uri", "--pid")
"""Options of roslaunch that have a value as a word of its own."""
_INITIAL = "initial_configuration"


def look_at_package(project: Project) -> PackageFacts:
    """Return what is known of a project without the running system. Its generators and observers are run."""
    folder = project.folder.parent if project.folder.name == "models" else project.folder
    outdated, missing, why = _differences(project, folder)
    return PackageFacts(
        folder=_found(project.package),
        expected=str(folder),
        outdated=outdated,
        missing=missing,
        generator=why,
        missing_types=_missing_types(project),
        java=_java(project),
        other_clone=_other_clone(os.environ.get("MROS_ROOT"), _found("rosgraph_monitor")),
        observers=tuple(_observers(project)),
        initial=tuple(_initial(folder)),
    )


def look_at_system(project: Project, snapshot: GraphSnapshot, namespace: str, master: str) -> SystemFacts:
    """Return what is known of a running system: its nodes are asked, and their processes looked at."""
    hosts = {name: urlsplit(node.uri).hostname or "" for name, node in snapshot.nodes.items()}
    known = {host: bool(addresses_of(host)) for host in set(hosts.values())}
    lost = {name: host for name, host in hosts.items() if not known[host]}
    asked = [name for name in snapshot.nodes if name not in lost]
    with ThreadPoolExecutor(_WORKERS) as pool:
        answers = dict(zip(asked, pool.map(lambda name: _state(snapshot.nodes[name].uri), asked), strict=True))
    dead = frozenset(name for name, state in answers.items() if state == "dead")
    alive = frozenset(snapshot.nodes) - dead
    running = [node for name in managed_nodes(project) if (node := instance(resolved(name, namespace), alive))]
    launched = {node: found for node in running if node not in lost and (found := _launched(node))}
    silent = frozenset(name for name, state in answers.items() if state == "silent")
    return SystemFacts(snapshot, namespace, dead, silent, lost, launched, _address_problem(master))


def scope_of(project: Project) -> Scope:
    """Return what `.ros` models beside the project tell of types and defaults; one that can't be read tells nothing."""
    models = []
    for path in files_in(project.folder, PACKAGES):
        try:
            models.append(read_packages(path))
        except ModelError:  # `rosmodel check` tells it
            continue
    return Scope(types=port_types(models), defaults=parameter_defaults(models))


def _found(package: str) -> str | None:
    try:
        return str(Path(rospkg.RosPack().get_path(package)).resolve())
    except rospkg.ResourceNotFound:
        return None


def _other_clone(root: str | None, monitor: str | None) -> str:
    """Return the folder of the monitor if it is not below the clone that the shell is set up for; else empty."""
    if not root or not monitor or Path(monitor).is_relative_to(Path(root).resolve()):
        return ""
    return monitor


def _differences(project: Project, folder: Path) -> tuple[tuple[str, ...], tuple[str, ...], str]:
    """Generate all anew beside the package; return the files that differ, those that are not there, and what fails."""
    outdated: list[str] = []
    missing: list[str] = []
    with tempfile.TemporaryDirectory() as place:
        root = Path(place)
        output = root / project.package
        as_packages = _PUBLISHED_LAYOUT in _text(folder / "config" / "rosgraph_manipulator.yaml")
        placed = replace(project, packages_folder=root if as_packages else None)
        written: set[Path] = set()
        failed = []
        for generate in find_generators().values():
            try:
                written.update(generate(placed, output))
            except ModelError as error:  # the other generators' files are compared
                failed.append(str(error).replace(place, ""))
        for path in sorted(written):
            inside = path.is_relative_to(output)
            there = folder / path.relative_to(output) if inside else folder.parent / path.relative_to(root)
            name = str(there.relative_to(folder)) if there.is_relative_to(folder) else str(there)
            text = path.read_bytes()
            if MARK.encode() not in text[:_HEAD]:
                continue  # once it is made, it is the user's
            if not there.is_file():
                missing.append(name)
            elif there.read_bytes() != text:
                outdated.append(name)
    return tuple(outdated), tuple(missing), "; ".join(failed)


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def _initial(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield each launch file of a package that names configurations to begin with, and what it names."""
    for path in sorted(folder.glob("launch/*.launch")):
        with contextlib.suppress(OSError, ElementTree.ParseError, LookupError, ValueError):  # the launch will say so
            for element in ElementTree.parse(path).getroot().iter("arg"):  # noqa: S314 - the project's own file
                named = element.get("default") or element.get("value") or ""
                if element.get("name") == _INITIAL and named and "$(" not in named:
                    yield f"launch/{path.name}", named


def _missing_types(project: Project) -> dict[str, str]:
    """Return the types of goals that can't be imported, with the reason; only messages of ROS packages are imported."""
    entries = [*project.settings["functions"].values(), project.settings.get("manipulator", {})]
    found = {}
    for name in {str(entry["goal_msg_type"]) for entry in entries if "goal_msg_type" in entry}:
        try:
            package, _, kind = action_type(name, "goal_msg_type").partition("/")
            rospkg.RosPack().get_path(package)
            getattr(importlib.import_module(f"{package}.msg"), kind)
        except ConfigurationError:
            found[name] = "names no action's type, such as move_base_msgs.msg.MoveBaseAction"
        except rospkg.ResourceNotFound:
            found[name] = f"can't be imported (no package {package})"
        except (ImportError, AttributeError) as error:
            found[name] = f"can't be imported ({error})"
    return found


def _java(project: Project) -> str:
    if project.settings.get("reasoner", {}).get("reasoner") == "rules":
        return ""
    try:
        find_jvm()
        jar_folder()
    except ReasonerError as error:
        return str(error)
    return ""


def _observers(project: Project) -> list[ObserverFacts]:
    """Load each observer as the monitor does."""
    known = plugins.exported()
    found = []
    for entry in project.settings["observers"]:
        name = str(entry["name"] if isinstance(entry, dict) else entry)
        try:
            observer = plugins.make(name, known)
            observer.follow(project.whole_base)
            topics = tuple((topic, str(getattr(kind, "_type", ""))) for topic, kind in observer.topics)
            found.append(ObserverFacts(name, "", topics, tuple(topic for topic, _ in observer.outputs)))
        except PluginError as error:
            found.append(ObserverFacts(name, str(error).removesuffix(_SECOND_REMEDY)))
        except Exception as error:  # a plug-in is somebody else's code
            found.append(ObserverFacts(name, f"does not tell its topics: {type(error).__name__}: {error}"))
    return found


def _state(uri: str) -> str:
    """Return whether a node is dead, silent or alive."""
    try:
        NodeApi.ask_pid(uri)
    except GoneError:
        return "dead"
    except CallError:
        return "silent"
    return "alive"


def _launched(node: str) -> Launched | None:
    """Return how a node of this host was started; None if that can't be seen."""
    for facts in look_up(node).lineage:
        try:
            process = psutil.Process(facts.pid)
            words, folder, environment = process.cmdline(), Path(process.cwd()), process.environ()
            arguments = _arguments(words)
            if arguments is None:
                continue
            path = _launch_file(arguments, folder)
            with _namespace(environment.get("ROS_NAMESPACE")):
                entries = load(path, [word for word in arguments if ":=" in word]).nodes
        except (psutil.Error, ModelError, OSError):
            return None
        return _entry(str(path), node, entries)
    return None


@contextlib.contextmanager
def _namespace(name: str | None) -> Iterator[None]:
    """Read launch files in the namespace of another process: roslaunch takes it from the environment."""
    own = os.environ.pop("ROS_NAMESPACE", None)
    try:
        os.environ.update({"ROS_NAMESPACE": name} if name else {})
        yield
    finally:
        os.environ.pop("ROS_NAMESPACE", None)
        os.environ.update({"ROS_NAMESPACE": own} if own is not None else {})


def _arguments(words: Sequence[str]) -> list[str] | None:
    """Return the arguments of a roslaunch without its options; None if the command line is none."""
    for number, word in enumerate(words[:3]):
        if Path(word).name == "roslaunch":
            before = (words[number], *words[number + 1 : -1])  # the word in front of each
            pairs = zip(before, words[number + 1 :], strict=True)
            return [word for option, word in pairs if option not in _WITH_VALUE and not word.startswith(("-", "__"))]
    return None


def _launch_file(arguments: Sequence[str], folder: Path) -> Path:
    """Return the file that roslaunch was started with: a path, or a package and a name.

    Raises:
        ModelError: there is none.
    """
    import roslaunch.core
    import roslaunch.rlutil

    names = [word for word in arguments if ":=" not in word]
    if names and (folder / names[0]).is_file():
        return folder / names[0]
    try:
        files = roslaunch.rlutil.resolve_launch_arguments(names)
    except (roslaunch.core.RLException, rospkg.ResourceNotFound) as error:
        raise ModelError(f"{' '.join(names)}: {error}") from error
    if not files:
        raise ModelError("roslaunch was started without a file")
    return Path(files[0])


def _entry(path: str, node: str, entries: Sequence[Any]) -> Launched:
    """Return what a launch file says of a node."""
    entry = next((entry for entry in entries if f"{entry.namespace}{entry.name}" == node), None)
    if entry is None:
        return Launched(path)
    return Launched(path, bool(entry.respawn), bool(entry.required), " ".join(str(entry.args or "").split()))


def _address_problem(master: str) -> str:
    """Return why nodes that are started in this shell can't be reached; empty if they can."""
    name = os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP") or ""
    variable = "ROS_HOSTNAME" if os.environ.get("ROS_HOSTNAME") else "ROS_IP" if name else "the name of this host,"
    given = name or socket.gethostname()
    if not addresses_of(given):
        return f"{variable} {given} does not resolve"
    if name and not is_this_host(given):
        return f"{variable} {given} is no address of this host"
    own = name if name else rosgraph.network.get_host_name()
    is_loopback = all(address.startswith("127.") or address == "::1" for address in addresses_of(own))
    if is_loopback and not is_this_host(urlsplit(master).hostname or ""):
        return f"nodes of this shell announce {own}, which other hosts take for themselves, and the master is elsewhere"
    return ""
