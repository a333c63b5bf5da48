"""The manipulator's parameters: which launch file deploys which configuration, and which action's goal is kept."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from node_kit.one_line import OneLineError

DEFAULT_FUNCTION = "f_navigate"  # the published configuration files name no function: they are for navigation
ARGUMENT = re.compile(r"[A-Za-z_]\w*:=.*", re.DOTALL)
KEYS = (
    "configurations",
    "configs",
    "functions",
    "repairs",
    "kill_nodes",
    "save_action",
    "goal_msg_type",
    "reconfiguration_action_name",
)
"""The parameters that `parse_options` reads, and `parse_repairs`."""
FUNCTION_KEYS = ("kill_nodes", "save_action", "goal_msg_type")

_OLDER = {
    "kill_nodes": ["/move_base"],
    "save_action": "move_base",
    "goal_msg_type": "move_base_msgs.msg.MoveBaseAction",
}
"""What the published manipulator did when its file had only `configs` (mc_rosgraph_manipulator, 2020)."""
_PACKAGE = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")

FindLaunchFile = Callable[[str, bool], str]
"""Finds a launch file by its path or `package://` address. The second argument tells whether it may be anywhere in its
package. Raises ConfigurationError."""


class ConfigurationError(OneLineError):
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
class Repair:
    """By what a component is repaired: by a service, or by a launch file that starts its driver again.

    Attributes:
        component: its name.
        service: name of the service; empty: it is repaired by the driver.
        driver: the configuration that starts the driver, of a function of its own; None: it is repaired by the service.
    """

    component: str
    service: str = ""
    driver: Configuration | None = None


@dataclass(frozen=True)
class FunctionOptions:
    """What holds for all configurations of one function.

    Attributes:
        kill_nodes: nodes to end before a start, even those that the launcher did not start.
        save_action: the action whose pending goal is kept; None: no goal is kept.
        action_type: type of that action, e.g. `move_base_msgs/MoveBaseAction`; None: no goal is kept.
    """

    kill_nodes: tuple[str, ...] = ()
    save_action: str | None = None
    action_type: str | None = None


@dataclass(frozen=True)
class ManipulatorOptions:
    """What the manipulator is told once, at its start.

    Attributes:
        configurations: by name.
        functions: the options of those functions that have any, by name.
        reconfiguration_action_name: the action that takes requests.
        repairs: by component.
    """

    configurations: Mapping[str, Configuration]
    functions: Mapping[str, FunctionOptions] = field(default_factory=dict)
    reconfiguration_action_name: str = "rosgraph_manipulator_action_server"
    repairs: Mapping[str, Repair] = field(default_factory=dict)

    def of(self, function: str) -> FunctionOptions:
        """Return the options of a function."""
        return self.functions.get(function, FunctionOptions())

    def one_per_function(self, names: object, parameter: str) -> dict[str, str]:
        """Return the configuration of each function that a parameter names.

        Args:
            names: the value of the parameter: one name, several in a list or in a text such as `a, b`, or nothing.
            parameter: its name.

        Raises:
            ConfigurationError: a name is unknown, or two are of one function.
        """
        if not isinstance(names, list):
            names = [name.strip() for name in str(names or "").strip("[] ").split(",") if name.strip()]
        found: dict[str, str] = {}
        for name in map(str, names):
            if name not in self.configurations:
                known = ", ".join(sorted(self.configurations))
                raise ConfigurationError(f"parameter '{parameter}' is '{name}'; known are: {known}")
            function = self.configurations[name].function
            if function in found:
                raise ConfigurationError(
                    f"parameter '{parameter}': {found[function]} and {name} are both of {function}: name one of them"
                )
            found[function] = name
        return found

    @property
    def all_functions(self) -> tuple[str, ...]:
        """The names of all functions."""
        return tuple(dict.fromkeys(configuration.function for configuration in self.configurations.values()))

    @property
    def drivers(self) -> dict[str, Configuration]:
        """The configurations that start drivers again, by name, which is also that of the function of each."""
        return {repair.driver.name: repair.driver for repair in self.repairs.values() if repair.driver}


def parse_options(parameters: Mapping[str, Any], find_launch_file: FindLaunchFile) -> ManipulatorOptions:
    """Check the parameters, in the published form or in ours.

    A configuration whose launch file or package is missing has a `problem`; the others can be deployed without it.

    Args:
        parameters: keys configurations, functions, kill_nodes, save_action, goal_msg_type,
            reconfiguration_action_name. A configuration is `{launch: FILE or package://PKG/FILE, args: [...], function:
            NAME, topics: [...]}` or the published `{command: roslaunch PKG FILE [ARG:=VALUE ...]}`. In place of
            configurations, the older `configs: [NAME, ...]`: NAME is a package with the launch file NAME.launch. An
            entry of functions is `NAME: {kill_nodes: [...], save_action: ..., goal_msg_type: ...}`. The same three keys
            outside it hold for the only function, or for the default function.
        find_launch_file: finds the launch file that a configuration names.

    Raises:
        ConfigurationError: a key is missing or has a value that cannot be used, or no launch file at all is found.
    """
    parameters = _from_older_form(parameters)
    entries = parameters.get("configurations")
    if not isinstance(entries, Mapping) or not entries:
        raise ConfigurationError(
            "parameter 'configurations' is missing or empty: "
            "give a YAML file with 'configurations: {NAME: {launch: FILE}}'"
        )
    configurations = {str(name): _configuration(str(name), entry, find_launch_file) for name, entry in entries.items()}
    problems = [configuration.problem for configuration in configurations.values()]
    if all(problems):
        raise ConfigurationError(problems[0])
    return ManipulatorOptions(
        configurations=configurations,
        functions=_functions(parameters, configurations.values()),
        reconfiguration_action_name=str(
            parameters.get("reconfiguration_action_name") or ManipulatorOptions.reconfiguration_action_name
        ),
    )


def _from_older_form(parameters: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the parameters with `configurations` in place of `configs`."""
    names = parameters.get("configs")
    if names is None or parameters.get("configurations"):
        return parameters
    if not isinstance(names, list) or not all(isinstance(name, str) and _PACKAGE.fullmatch(name) for name in names):
        raise ConfigurationError(
            "parameter 'configs' must be a list of packages, each with a launch file of its name: correct it, or give "
            "'configurations: {NAME: {launch: FILE}}'"
        )
    entries = {name: {"command": f"roslaunch {name} {name}.launch profile:={name}"} for name in names}
    given = {key: value for key, value in parameters.items() if value is not None}
    return {**_OLDER, **given, "configurations": entries}


def _functions(parameters: Mapping[str, Any], configurations: Iterable[Configuration]) -> dict[str, FunctionOptions]:
    known = list(dict.fromkeys(configuration.function for configuration in configurations))
    entries = parameters.get("functions") or {}
    if not isinstance(entries, Mapping) or not all(isinstance(entry, Mapping) for entry in entries.values()):
        raise ConfigurationError("parameter 'functions' must be of the form {NAME: {save_action: ..., ...}}")
    for name, entry in entries.items():
        if name not in known:
            raise ConfigurationError(
                f"functions/{name}: no configuration has this function; known are: {', '.join(known)}"
            )
        unknown = sorted(set(map(str, entry)) - set(FUNCTION_KEYS))
        if unknown:
            raise ConfigurationError(
                f"functions/{name}: unknown key '{unknown[0]}'; known are: {', '.join(FUNCTION_KEYS)}"
            )
    options = {str(name): _function_options(f"functions/{name}/", entry) for name, entry in entries.items()}
    common = {key: parameters[key] for key in FUNCTION_KEYS if parameters.get(key)}
    if common:
        name = known[0] if len(known) == 1 else DEFAULT_FUNCTION
        if name not in known:
            raise ConfigurationError(
                f"parameter '{next(iter(common))}' does not say for which of {', '.join(known)} it holds: "
                "put it under 'functions: {NAME: {...}}'"
            )
        if name in options:
            raise ConfigurationError(
                f"parameter '{next(iter(common))}' stands beside functions/{name}: put it there, too"
            )
        options[name] = _function_options("", common)
    return options


def _function_options(where: str, entry: Mapping[str, Any]) -> FunctionOptions:
    kill_nodes = entry.get("kill_nodes") or []
    if not isinstance(kill_nodes, list) or not all(isinstance(node, str) for node in kill_nodes):
        raise ConfigurationError(f"parameter '{where}kill_nodes' must be a list of node names")
    save_action = entry.get("save_action") or None
    if save_action is not None and not isinstance(save_action, str):
        raise ConfigurationError(f"parameter '{where}save_action' must be the name of an action, e.g. move_base")
    return FunctionOptions(
        kill_nodes=tuple(kill_nodes),
        # Only a leading slash tells a global action's name from a relative one.
        save_action=save_action.rstrip("/") if save_action else None,
        action_type=action_type(entry.get("goal_msg_type"), f"{where}goal_msg_type") if save_action else None,
    )


def _configuration(name: str, entry: object, find_launch_file: FindLaunchFile) -> Configuration:
    where = f"configurations/{name}"
    if not isinstance(entry, Mapping):
        raise ConfigurationError(f"{where}: expected 'launch: FILE' or 'command: roslaunch PKG FILE', got {entry!r}")
    function = str(entry.get("function", DEFAULT_FUNCTION))
    if "launch" in entry:
        uri, args = str(entry["launch"]), entry.get("args") or []
        if not isinstance(args, list):
            raise ConfigurationError(f"{where}: 'args' is {args!r}: it must be a list of NAME:=VALUE")
        args = [str(arg) for arg in args]
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
