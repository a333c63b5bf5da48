"""Turns the description of a node into the command that starts it: its words, folder, environment and log."""

from __future__ import annotations

import os
from collections.abc import Callable

import rospkg
from node_kit.plugins import UNREADABLE

from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io.command_lines import command_line, process_environment
from rosgraph_launcher.io.processes import MARK, Command

EXPORT = "rosgraph_launcher"
"""The element in a package's <export> that tells the launcher about its nodes."""


class NodeCommands:
    """Makes the commands of one launcher's nodes."""

    def __init__(self, mark: str, run_id: str, log: Callable[[str], None]) -> None:
        """Remember what all commands share.

        Args:
            mark: names the launcher, in the environment of the node.
            run_id: of the roslaunch run; names the folder of the logs.
            log: takes a line for the operator.
        """
        self._mark = mark
        self._run_id = run_id
        self._log = log

    def command(self, node: NodeDescription) -> Command:
        """Return the command that starts a node.

        Raises:
            CommandLineError: there is no such package or executable.
        """
        words, prefixed = command_line(node)
        folder, log = self._log_folder(), None
        file_name = node.name.strip("/").replace("/", "-")
        if folder:
            words.append(f"__log:={folder}/{file_name}.log")
            log = f"{folder}/{file_name}-stdout.log" if node.output != "screen" else None
        # roslaunch knows no other value than "node" and "ROS_HOME". The launcher's own folder may be gone.
        cwd = os.path.dirname(words[prefixed]) if node.cwd == "node" else rospkg.get_ros_home()
        environment = process_environment(node, {**os.environ, MARK: self._mark})
        safe = safe_imports(node.package)
        return Command(tuple(words), cwd, environment, log, prefixed=bool(prefixed), safe_imports=safe)

    def _log_folder(self) -> str:
        folder = os.path.join(rospkg.get_log_dir(), self._run_id)
        try:
            os.makedirs(folder, exist_ok=True)
        except OSError as error:
            self._log(f"nodes run without logs: {folder}: {error.strerror or error}")
            return ""
        return folder


def safe_imports(package: str) -> tuple[str, ...]:
    """Return the modules that a package declares to be safe to import before its node begins, by their first names."""
    try:
        declared = rospkg.RosPack.get_instance().get_manifest(package).get_export(EXPORT, "safe_imports")
    except UNREADABLE:
        return ()
    return tuple(name for name in " ".join(declared).split() if name.isidentifier())
