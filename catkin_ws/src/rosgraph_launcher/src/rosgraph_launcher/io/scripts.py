"""Looks whether a shell script runs that is started as a node, but is none: it answers under no name."""

from __future__ import annotations

import contextlib
import functools
import os
import time

import psutil

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.command_lines import CommandLineError, command_line
from rosgraph_launcher.io.processes import MARK
from rosgraph_launcher.launching.ownership import ScriptProcess, same_launcher

SHELLS = {"sh", "ash", "bash", "dash", "ksh", "zsh"}


def script_is_at_work(node: NodeDescription, mark: str) -> bool:
    """Tell whether a node is a shell script that runs and starts no ROS node.

    Args:
        node: the node.
        mark: of the launcher that should run it.
    """
    path = _shell_script(node.package, node.executable)
    if not path:
        return False
    name = f"__name:={node.name.rpartition('/')[2]}"
    for process in _all_processes():
        with contextlib.suppress(psutil.Error, OSError):
            words = process.cmdline()
            if path in words and name in words:
                environment = process.environ()
                namespace = environment.get("ROS_NAMESPACE", "").strip("/")
                if same_launcher(environment.get(MARK, ""), mark) and namespace == node.namespace.strip("/"):
                    return _look_at(process).is_at_work()
    return False


def _all_processes() -> list[psutil.Process]:
    """Return the processes of this host; none where the system has no descriptor for looking at them."""
    with contextlib.suppress(OSError):
        return list(psutil.process_iter())
    return []


def _look_at(process: psutil.Process) -> ScriptProcess:
    tree = [process, *process.children(recursive=True)]
    return ScriptProcess(
        is_shell=_is_shell(process.exe()),
        age=time.time() - process.create_time(),
        has_sockets=any(_has_sockets(one.pid) for one in tree),
    )


def _has_sockets(pid: int) -> bool:
    with contextlib.suppress(OSError):
        for entry in os.scandir(f"/proc/{pid}/fd"):
            with contextlib.suppress(OSError):
                if os.readlink(entry.path).startswith("socket:"):
                    return True
    return False


def _shell_script(package: str, executable: str) -> str:
    """Return the path of an executable that is a shell script; empty for any other one."""
    with contextlib.suppress(CommandLineError, OSError):
        return _read_script(package, executable)
    return ""


@functools.lru_cache(maxsize=None)
def _read_script(package: str, executable: str) -> str:
    """Do the same, once for all. An error is not kept: descriptors may be lacking for a moment only."""
    path = command_line(NodeDescription("/any", "/", package, executable))[0][0]
    with open(path, "rb") as file:
        line = file.readline(256)
    try:
        first = line.decode()
    except ValueError:
        return ""
    words = first[2:].split() if first.startswith("#!") else []
    return path if any(os.path.basename(word) in SHELLS for word in words) else ""


def _is_shell(path: str) -> bool:
    return os.path.basename(os.path.realpath(path)) in SHELLS
