"""Asks nodes what the master does not know: types of services, and the programs that the nodes run."""

from __future__ import annotations

import os
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import rosgraph.network
import rospkg
from node_kit.io.input_files import is_file
from node_kit.io.xml_rpc import CallError, Client, GoneError

from ros_model_extraction.running.details import Details, Origin

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ros_model.graph.snapshot import GraphSnapshot

_CALLER = "/rosmodel"
_WORKERS = 16
_MAX_HEADER = 64_000  # bytes of the header by which a service answers; it has some hundred


def ask_nodes(snapshot: GraphSnapshot, master: str, timeout: float = 2.0) -> Details:
    """Ask all nodes, side by side; `timeout` in wall seconds is for each part of an answer. Nothing is raised."""
    packages = rospkg.RosPack()
    known = set(packages.list())
    with ThreadPoolExecutor(_WORKERS) as pool:
        addresses = _service_addresses(master, snapshot.services, timeout)
        types = pool.map(lambda service: (service, _service_type(service, addresses[service], timeout)), addresses)
        pids = dict(pool.map(lambda node: (node.name, _pid(node.uri, timeout)), snapshot.nodes.values()))
        service_types = {service: type_name for service, type_name in types if type_name}
    origins, unknown = {}, {}
    for node, pid in pids.items():
        found = _looked_at(pid, known) if isinstance(pid, int) else pid
        if isinstance(found, Origin):
            origins[node] = found
        else:
            unknown[node] = found
    dead = frozenset(node for node, answer in pids.items() if answer == _DEAD)
    return Details(origins, {n: why for n, why in unknown.items() if n not in dead}, service_types, dead)


_DEAD = "nobody listens at its address"


def _pid(uri: str, timeout: float) -> int | str:
    """Return the process id of a node on this host, else why there is none."""
    try:
        host = urlsplit(uri).hostname or ""
        with Client(uri, _CALLER, timeout, peer="node") as node:
            pid = node.pid()
        return pid if rosgraph.network.is_local_address(host) else f"it runs on the host {host}"
    except GoneError:
        return _DEAD
    except (CallError, OSError, ValueError):  # OSError: its host is not known
        return "it does not answer"


def _looked_at(pid: int, packages: set[str]) -> Origin | str:
    try:
        return _origin(pid, packages)
    except Exception as error:  # whatever command lines and folders make of it: the other nodes are asked anyway
        return f"its process {pid} can't be looked at ({type(error).__name__}: {error})"


def _origin(pid: int, packages: set[str]) -> Origin | str:
    """Return the executable of a process, from its command line."""
    process = Path("/proc") / str(pid)
    try:
        arguments = (process / "cmdline").read_bytes().decode("utf-8", "replace").split("\0")
        folder = (process / "cwd").resolve()
    except OSError as error:
        return f"its process {pid} can't be looked at ({error.strerror})"
    return executable_of(arguments, folder, packages) or f"its program {arguments[0]!r} is in no ROS package"


def executable_of(arguments: Sequence[str], folder: Path, packages: Iterable[str]) -> Origin | None:
    """Return the executable that a command line runs, if it is in a ROS package.

    Args:
        arguments: the command line; an interpreter may come first, and a module that runs the executable.
        folder: its working folder.
        packages: names of the packages that are installed.
    """
    known = set(packages)
    found: Origin | None = None
    for number, argument in enumerate(arguments):
        is_option = number and argument.startswith("-")
        if not argument or is_option or ":=" in argument or (not number and Path(argument).name.startswith("python")):
            continue
        path = folder / argument
        if not is_file(path):
            break
        package = path.parent.name if path.parent.name in known else _package_of(path)
        origin = Origin(package, path.name, *told(arguments[number + 1 :])) if package else None
        if origin and os.access(path, os.X_OK):
            return origin
        found = found or origin
        if origin is None:
            break  # the program is in no package: what follows are its arguments
    return found


def _package_of(path: Path) -> str | None:
    try:
        name: str | None = rospkg.get_package_name(str(path))
    except Exception:  # of a package.xml above it that can't be read
        return None
    return name


def told(arguments: Iterable[str]) -> tuple[tuple[tuple[str, str], ...], tuple[str, ...]]:
    """Return what a node's command line tells it: remappings, and arguments of its own.

    `__name:=` and the like are for ROS, and `_rate:=5` is a parameter, which the parameter server has.
    """
    remaps, own = [], []
    for argument in arguments:
        inside, is_assignment, outside = argument.partition(":=")
        if not is_assignment:
            own.append(argument)
        elif inside and outside and not inside.startswith("_"):
            remaps.append((inside, outside))
    return tuple(remaps), tuple(argument for argument in own if argument)


def _service_addresses(master: str, services: Iterable[str], timeout: float) -> dict[str, str]:
    names = list(services)
    try:
        with Client(master, _CALLER, timeout) as client:
            answers = client.call_all([("lookupService", name) for name in names])
    except CallError:
        return {}
    return {name: str(uri) for name, (known, uri) in zip(names, answers, strict=True) if known}


def _service_type(service: str, uri: str, timeout: float) -> str:
    """Ask the node that offers a service for its type, as rosservice does; "" where it does not answer in time."""
    deadline = time.monotonic() + timeout
    try:
        address = urlsplit(uri)
        with socket.create_connection((address.hostname, address.port), timeout) as connection:
            question = {"probe": "1", "md5sum": "*", "callerid": _CALLER, "service": service}
            rosgraph.network.write_ros_handshake_header(connection, question)
            size = _received(connection, 4, deadline)
            header = _received(connection, int.from_bytes(size, "little"), deadline)
        return str(rosgraph.network.decode_ros_handshake_header(size + header).get("type", ""))
    except Exception:  # whatever addresses and answers make of it: the other services are asked anyway
        return ""


def _received(connection: socket.socket, size: int, deadline: float) -> bytes:
    """Return so many bytes of what the other side sends.

    Raises:
        OSError: they do not come by the deadline, a time of the monotonic clock.
        ValueError: they are too many.
    """
    if size > _MAX_HEADER:
        raise ValueError(f"{size} bytes are too many")
    data = bytearray()
    while len(data) < size:
        connection.settimeout(max(deadline - time.monotonic(), 1e-3))
        part = connection.recv(size - len(data))
        if not part or time.monotonic() > deadline:
            raise TimeoutError("the answer ends, or takes too long")
        data += part
    return bytes(data)
