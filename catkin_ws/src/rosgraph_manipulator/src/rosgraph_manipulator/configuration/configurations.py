"""The manipulator's parameters: which launch file deploys which configuration, and which action's goal is kept."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

DEFAULT_FUNCTION = "f_navigate"  # the published configuration files name no function: they are for navigation
ARGUMENT = re.compile(r"[A-Za-z_]\w*:=.*", re.DOTALL)
KEYS = ("configurations", "kill_nodes", "save_action", "goal_msg_type", "reconfiguration_action_name")
"""The parameters that `parse_options` reads."""

FindLaunchFile = Callable[[str, bool], str]
"""Finds a launch file by its path or `package://` address. The second argument tells whether it may be anywhere in its
package. Raises ConfigurationError."""


class ConfigurationError(Exception):
    """The configuration cannot be used; the message names the key and the remedy."""


@dataclass(frozen=True)
class Configuration:
    """One way to deploy a function.

    Attributes:
        name: its name, as requests use it.
        function: the function that it provides.
        launch_file: path of the launch file that starts its nodes.
        args: arguments of the launch file, `NAME:=VALUE`.
        topics: topics that its nodes must publish before it is ready.
        problem: why it cannot be deployed, with the remedy; empty: nothing is known to be wrong with it.
    """

    name: str
    function: str
    launch_file: str
    args: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    problem: str = ""


@dataclass(frozen=True)
class ManipulatorOptions:
    """What the manipulator is told once, at its start.

    Attributes:
        configurations: by name.
        kill_nodes: nodes to end before a start, even those that the launcher did not start.
        save_action: the action whose pending goal is kept; None: no goal is kept.
        action_type: type of that action, e.g. `move_base_msgs/MoveBaseAction`.
        reconfiguration_action_name: the action that takes requests.
    """

    configurations: Mapping[str, Configuration]
    kill_nodes: tuple[str, ...] = ()
    save_action: str | None = None
    action_type: str | None = None
    reconfiguration_action_name: str = "rosgraph_manipulator_action_server"


def parse_options(parameters: Mapping[str, Any], find_launch_file: FindLaunchFile) -> ManipulatorOptions:
    """Check the parameters, in the published form or in ours.

    A configuration whose launch file or package is missing has a `problem`; the others can be deployed without it.

    Args:
        parameters: keys configurations, kill_nodes, save_action, goal_msg_type, reconfiguration_action_name. A
            configuration is `{launch: FILE or package://PKG/FILE, args: [...], function: NAME, topics: [...]}` or the
            published `{command: roslaunch PKG FILE [ARG:=VALUE ...]}`.
        find_launch_file: finds the launch file that a configuration names.

    Raises:
        ConfigurationError: a key is missing or has a value that cannot be used, or no launch file at all is found.
    """
    entries = parameters.get("configurations")
    if not isinstance(entries, Mapping) or not entries:
        raise ConfigurationError(
            "parameter 'configurations' is missing or empty: "
            "give a YAML file with 'configurations: {NAME: {launch: FILE}}'"
        )
    kill_nodes = parameters.get("kill_nodes") or []
    if not isinstance(kill_nodes, list) or not all(isinstance(node, str) for node in kill_nodes):
        raise ConfigurationError("parameter 'kill_nodes' must be a list of node names")
    save_action = parameters.get("save_action") or None
    if save_action is not None and not isinstance(save_action, str):
        raise ConfigurationError("parameter 'save_action' must be the name of an action, e.g. move_base")
    configurations = {str(name): _configuration(str(name), entry, find_launch_file) for name, entry in entries.items()}
    problems = [configuration.problem for configuration in configurations.values()]
    if all(problems):
        raise ConfigurationError(problems[0])
    return ManipulatorOptions(
        configurations=configurations,
        kill_nodes=tuple(kill_nodes),
        save_action=save_action.strip("/") if save_action else None,
        action_type=action_type(parameters.get("goal_msg_type"), "goal_msg_type") if save_action else None,
        reconfiguration_action_name=str(
            parameters.get("reconfiguration_action_name") or ManipulatorOptions.reconfiguration_action_name
        ),
    )


def _configuration(name: str, entry: object, find_launch_file: FindLaunchFile) -> Configuration:
    where = f"configurations/{name}"
    if not isinstance(entry, Mapping):
        raise ConfigurationError(f"{where}: expected 'launch: FILE' or 'command: roslaunch PKG FILE', got {entry!r}")
    function = str(entry.get("function", DEFAULT_FUNCTION))
    if "launch" in entry:
        uri, args = str(entry["launch"]), [str(arg) for arg in entry.get("args") or []]
    elif "command" in entry:
        uri, args = _parse_command(where, str(entry["command"]))
    else:
        raise ConfigurationError(f"{where}: neither 'launch' nor 'command' is given")
    for arg in args:
        if not ARGUMENT.fullmatch(arg):
            raise ConfigurationError(f"{where}: launch argument '{arg}' is not NAME:=VALUE")
    topics = entry.get("topics") or []
    if not isinstance(topics, list) or not all(isinstance(topic, str) and topic for topic in topics):
        raise ConfigurationError(f"{where}: 'topics' must be a list of names")
    try:
        launch_file = find_launch_file(uri, "command" in entry)  # a command names a file anywhere in its package
    except ConfigurationError as error:
        return Configuration(name, function, "", tuple(args), tuple(topics), problem=f"{where}: {error}")
    return Configuration(name, function, launch_file, tuple(args), tuple(topics))


def _parse_command(where: str, command: str) -> tuple[str, list[str]]:
    """Return the launch file's address and the arguments of `roslaunch PKG FILE [ARG:=VALUE ...]`. No shell sees it."""
    try:
        words = shlex.split(command)
    except ValueError as error:
        raise ConfigurationError(f"{where}: command '{command}': {error}") from error
    if len(words) < 2 or words[0] != "roslaunch":
        raise ConfigurationError(f"{where}: command '{command}' is not 'roslaunch PKG FILE [ARG:=VALUE ...]'")
    if words[1].endswith(".launch"):
        return words[1], words[2:]
    if len(words) < 3:
        raise ConfigurationError(f"{where}: command '{command}' names no launch file")
    return f"package://{words[1]}/launch/{words[2]}", words[3:]


def action_type(text: object, parameter: str) -> str:
    """Return an action's type as `PKG/TYPEAction`, from that or from the published `PKG.msg.TYPEAction`.

    Raises:
        ConfigurationError: the text has another form.
    """
    match = re.fullmatch(r"([a-z]\w*)(?:\.msg\.|/)([A-Z]\w*Action)", str(text))
    if not match:
        raise ConfigurationError(
            f"parameter '{parameter}' is '{text}': it must name an action's type, e.g. "
            "move_base_msgs.msg.MoveBaseAction"
        )
    return f"{match[1]}/{match[2]}"
