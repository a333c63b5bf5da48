"""Reads launch files through roslaunch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import rospkg

from ros_model.checks.launched import LaunchedNode, LaunchFile
from ros_model.errors import ModelError
from ros_model.io.files import read_text

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path


def read_launch_file(path: Path) -> LaunchFile:
    """Return what a launch file starts; its arguments have their defaults. It runs nothing.

    Raises:
        ModelError: it can't be read, or roslaunch refuses it; says what roslaunch says. Or a node has no name.
    """
    text = read_text(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ModelError(f"{path}: a launch file has no DOCTYPE and no entities: remove them")
    config = load(path)
    nodes = [
        LaunchedNode(f"{node.namespace}{node.name}", node.package, node.type, node.machine_name or "")
        for node in config.nodes
    ]
    machines = {name: str(machine.address) for name, machine in config.machines.items() if name}
    return LaunchFile(str(path), tuple(nodes), machines)


@dataclass(frozen=True)
class NotRun:
    """Stands for the value of a parameter that a program would give.

    Attributes:
        command: the words of `command=`.
    """

    command: str


def load(path: Path, arguments: Sequence[str] = (), *, runs_programs: bool = False) -> Any:
    """Return the configuration that roslaunch makes of a launch file, without what a roscore has.

    Args:
        path: the launch file.
        arguments: `name:=value`, as for roslaunch.
        runs_programs: run those that the file names in `command=`, as roslaunch does; else their parameters have a
            NotRun as their value.

    Raises:
        ModelError: roslaunch refuses the file; says what it says. Or a node has no name.
    """
    import roslaunch.config
    import roslaunch.core
    import roslaunch.xmlloader

    try:
        config = roslaunch.config.ROSLaunchConfig()  # without what a roscore has: that runs two programs
        loader = roslaunch.xmlloader.XmlLoader()
        if not runs_programs:
            loader.param_value = _without_programs(loader.param_value)
        loader.ignore_unset_args = False
        loader.load(str(path), config, argv=list(arguments), verbose=False)
    except (roslaunch.core.RLException, roslaunch.xmlloader.XmlParseException, rospkg.ResourceNotFound) as error:
        raise ModelError(f"{path}: roslaunch refuses it: {' '.join(str(error).split())}") from error
    except Exception as error:  # whatever `$(eval ...)`, an encoding or the file's size makes of it
        raise ModelError(f"{path}: roslaunch can't read it: {type(error).__name__}: {error}") from error
    if config.config_errors:
        raise ModelError(f"{path}: roslaunch refuses it: {' '.join(str(config.config_errors[0]).split())}")
    for node in config.nodes:
        if not node.name:  # roslaunch makes one up at each start
            raise ModelError(f"{path}: a node of {node.package}/{node.type} has no name: give it one")
    return config


def wrong_parameters(path: Path) -> str:
    """Return why roslaunch can't load a file of a node's parameters, in one line; empty: it can."""
    import roslaunch.config
    import roslaunch.loader

    try:
        read_text(path)
        loader, context = roslaunch.loader.Loader(), roslaunch.loader.LoaderContext("/node", str(path))
        loader.load_rosparam(context, roslaunch.config.ROSLaunchConfig(), "load", "", str(path), "", verbose=False)
    except ModelError as error:
        return str(error)
    except Exception as error:  # whatever keys and values make of it
        return f"{path}: roslaunch can't load it: {type(error).__name__}: {' '.join(str(error).split())[:300]}"
    return ""


def _without_programs(param_value: Callable[..., Any]) -> Callable[..., Any]:
    """Return roslaunch's reader of a parameter's value, which runs no program."""

    def value_of(verbose: bool, name: str, kind: str, *ways: str | None) -> Any:
        *_, command = ways  # value, textfile, binfile, command: one of them is given
        return param_value(verbose, name, kind, *ways) if command is None else NotRun(command)

    return value_of
