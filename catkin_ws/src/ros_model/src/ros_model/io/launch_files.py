"""Reads launch files through roslaunch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ros_model.checks.launched import LaunchedNode, LaunchFile
from ros_model.errors import ModelError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def read_launch_file(path: Path) -> LaunchFile:
    """Return what a launch file starts; its arguments have their defaults. It runs nothing.

    Raises:
        ModelError: as `load`.
    """
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
        ModelError: roslaunch refuses the file; says what it says. Or it holds what no reader of this project takes.
    """
    import roslaunch.config

    from ros_model.io.launch_loader import EXPLAINED, LaunchLoader, check_configuration, in_one_line

    config = roslaunch.config.ROSLaunchConfig()  # without what a roscore has: that runs two programs
    loader = LaunchLoader(None if runs_programs else NotRun)
    try:
        loader.load(str(path), config, argv=list(arguments), verbose=False)
    except EXPLAINED as error:
        text = in_one_line(str(error)).removeprefix(f"{path}: ")
        raise ModelError(f"{path}: roslaunch refuses it: {text}") from error
    check_configuration(path, config)
    return config


def wrong_parameters(path: Path) -> str:
    """Return why roslaunch can't load a file of a node's parameters, in one line; empty: it can."""
    import roslaunch.config
    import roslaunch.loader

    from ros_model.io.launch_loader import LaunchContentError, LaunchLoader

    context, config = roslaunch.loader.LoaderContext("/", str(path)), roslaunch.config.ROSLaunchConfig()
    try:
        LaunchLoader().load_rosparam(context, config, "load", "", str(path), "", verbose=False)
    except LaunchContentError as error:
        return error.problem
    except Exception as error:  # whatever keys and values make of it
        return f"{path}: roslaunch can't load it: {type(error).__name__}: {' '.join(str(error).split())[:300]}"
    return ""
