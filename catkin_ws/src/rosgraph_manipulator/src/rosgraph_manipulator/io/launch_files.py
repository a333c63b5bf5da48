"""Reads launch files through roslaunch."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import rosgraph
import rosgraph.names
import roslaunch.config
import roslaunch.core
import roslaunch.loader
import roslaunch.substitution_args
from node_kit.one_line import OneLineError
from ros_model.errors import ModelError
from ros_model.generators.launch import launch_file, launch_file_of
from ros_model.io.launch_loader import (
    LaunchContentError,
    LaunchLoader,
    check_configuration,
    in_one_line,
    shortened,
)
from ros_model.io.models import read_system
from ros_model.io.project import load_project
from ros_model.project.settings import FILE_NAME
from rosgraph_launcher.description import NodeDescription, SystemDescription, owner_of
from rosgraph_launcher.io.command_lines import EXPLAINED, reason

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.configuration.configurations import Configuration


class LaunchFileError(OneLineError):
    """A launch file cannot be used; the message names it and says why, in one line."""


@dataclass(frozen=True)
class LaunchFile:
    """The content of a launch file.

    Attributes:
        system: its nodes and parameters.
        clear: full names of the parameters to delete before any is set.
        commands: the `rosparam` calls to make before that, each as a tuple of words.
        remarks: lines for the operator about what it says and what has no effect.
    """

    system: SystemDescription
    clear: tuple[str, ...] = ()
    commands: tuple[tuple[str, ...], ...] = ()
    remarks: tuple[str, ...] = ()


def read_launch_file(
    path: str | Path, args: Sequence[str] = (), parameter_files: dict[str, str] | None = None
) -> LaunchFile:
    """Read a launch file.

    Args:
        path: of the file.
        args: its arguments, `NAME:=VALUE`.
        parameter_files: texts of the files of parameters that launch files load, by path, as they were when they could
            be used last; they stand in for one that can't be used now, and are brought up to date.

    Raises:
        LaunchFileError: the file is missing or malformed, or starts no node.
    """
    with _refusing(str(path)):
        config = roslaunch.config.ROSLaunchConfig()
        loader = _Loader()
        if parameter_files is not None:
            loader.parameter_files = parameter_files
        loader.load(str(path), config, argv=list(args), verbose=False)
        launch = _checked(path, config)
        return replace(launch, remarks=(*launch.remarks, *loader.remarks))


def read_configuration(configuration: Configuration, parameter_files: dict[str, str]) -> LaunchFile:
    """Read the launch file of a configuration.

    Args:
        configuration: it.
        parameter_files: as of `read_launch_file`.

    Raises:
        DeploymentError: it can't be read.
    """
    if configuration.problem:
        raise DeploymentError(configuration.problem)
    try:
        return read_launch_file(configuration.launch_file, configuration.args, parameter_files)
    except LaunchFileError as error:
        raise DeploymentError(str(error)) from error


def read_model(path: Path) -> LaunchFile:
    """Read a `.rossystem` model as the launch file that is generated from it, by its project where it has one.

    Raises:
        LaunchFileError: the model can't be read, or its launch file can't be used.
    """
    with _refusing(str(path)):
        config = roslaunch.config.ROSLaunchConfig()
        _Loader().load_string(_generated(path), config, verbose=False)
        return _checked(path, config)


def _generated(path: Path) -> str:
    """Return the text of the launch file that is generated from a model."""
    system = read_system(path)
    folder = next((folder for folder in path.resolve().parents[:2] if (folder / FILE_NAME).is_file()), None)
    project = load_project(folder) if folder else None
    if project is None or system.name not in {variant.name for variant in project.variants}:
        return launch_file(system)
    return launch_file_of(project, system)


_EXPLAINED = (
    *EXPLAINED,
    ModelError,
    roslaunch.loader.LoadException,
    roslaunch.substitution_args.SubstitutionException,
)
"""Errors whose message says what is wrong. Any other one is named by its class, too."""
_OF_A_TEXT = "string"
"""What roslaunch has for the name of a file where it reads a text."""


@contextmanager
def _refusing(what: str) -> Iterator[None]:
    """Turn whatever the body raises into a LaunchFileError about `what`.

    A launch file evaluates expressions, runs commands and names files of any content, so that reading it may raise
    anything. None of it may end the node that reads.
    """
    try:
        yield
    except LaunchFileError:
        raise
    except (Exception, SystemExit) as error:
        if known := _known(error):
            raise known from error
        if isinstance(error, LaunchContentError):
            file = what if error.file == _OF_A_TEXT else error.file
            raise LaunchFileError(f"{file}: {error.problem}") from error
        text = in_one_line(reason(error, _EXPLAINED))
        raise LaunchFileError(f"{what}: {text.removeprefix(f'{what}: ')}") from error


def _known(error: BaseException | None) -> LaunchFileError | None:
    """Return the error of this module that another one was raised about; None: there is none."""
    while error is not None and not isinstance(error, LaunchFileError):
        error = error.__context__
    return error


class _StableNames(dict[str, str]):
    """The names for `$(anon NAME)`: the same at every reading, so that two readings can be compared."""

    def __contains__(self, _key: object) -> bool:
        return True

    def __missing__(self, key: str) -> str:
        return f"{key}_launched"


class _Loader(LaunchLoader):
    """The reader of all launch files, with stable anonymous names, and files of parameters as they were."""

    def __init__(self) -> None:
        super().__init__()
        self.parameter_files: dict[str, str] = {}
        self.remarks: list[str] = []

    def values_of_file(self, file: str, values_of: Callable[[str], Any]) -> Any:
        """Return what a file of parameters says. Where it can't be used now, that is what it said before.

        Many launch files may load the same file. None of them could be used without it.
        """
        before = self.parameter_files.get(file)
        try:
            text = self.text_of(file)
            found = values_of(text)
            if before and not text.strip():
                raise LaunchContentError(file, "it is empty")
        except LaunchContentError as error:
            if before is None:
                raise
            why = shortened(error.problem)
            self.remarks.append(f"{file} can't be used, so its values are those of before: correct it ({why})")
            return values_of(before)
        self.parameter_files[file] = text
        return found

    @property
    def root_context(self) -> Any:
        return self._root_context

    @root_context.setter
    def root_context(self, context: Any) -> None:
        self._root_context = context
        if context is not None:
            context.resolve_dict["anon"] = _StableNames()

    def resolve_args(self, args: str | None, context: Any) -> Any:
        """Return an attribute with its `$(...)` replaced.

        Raises:
            LaunchFileError: an expression fails. roslaunch's own error would not name it, and roslaunch would add the
                whole element to an error of its own kind.
        """
        try:
            return super().resolve_args(args, context)
        except (*_EXPLAINED, RecursionError):  # the latter comes of a file that includes itself
            raise
        except (Exception, SystemExit) as error:
            what = f"'{shortened(args or '')}' fails: {type(error).__name__}: {' '.join(str(error).split())}"
            raise LaunchFileError(f"{context.filename}: {what}: correct the expression") from error


def _checked(path: str | Path, config: Any) -> LaunchFile:
    check_configuration(path, config)
    for node in config.nodes:
        name = node.machine_name or ""
        if name not in config.machines:
            remedy = f'add <machine name="{name}" address="HOST"/>, or correct the name'
            raise LaunchFileError(f"{path}: node {node.name} is for machine '{name}', which is not declared: {remedy}")
        node.machine = config.machines[name]
    if not config.nodes:
        raise LaunchFileError(f"{path}: starts no node")
    nodes = {}
    names = [rosgraph.names.ns_join(node.namespace, node.name) for node in config.nodes]
    private: dict[str, dict[str, Any]] = {}
    for key, parameter in config.params.items():
        owner = owner_of(key, names)
        private.setdefault(owner, {})[key.removeprefix(f"{owner}/") if owner else key] = parameter.value
    for name, node in zip(names, config.nodes, strict=True):
        nodes[name] = _description(name, node, private.get(name, {}))
    return LaunchFile(
        SystemDescription(nodes, private.get("", {})),
        clear=tuple(config.clear_params),
        commands=tuple((str(e.command), *map(str, e.args)) for e in config.executables),
        remarks=tuple(dict.fromkeys(_ignored(node.machine) for node in config.nodes if _ignored(node.machine))),
    )


def _is_here(machine: Any) -> bool:
    """Tell whether a machine is this host, as roslaunch does, whatever its user is.

    A name that the name service does not know may be one that a launcher was given.
    """
    try:
        return bool(roslaunch.core.is_machine_local(roslaunch.core.Machine(machine.name, machine.address)))
    except (roslaunch.core.RLException, UnicodeError):
        return False


def _ignored(machine: Any) -> str:
    """Return what has no effect in the machine of a node, in one line; empty where all has."""
    if _is_here(machine):
        return ""
    given = (("env-loader", machine.env_loader), ("user", machine.user), ("password", machine.password))
    names = [name for name, value in given if value]
    if not names:
        return ""
    return f"machine '{machine.name}': {', '.join(names)} are ignored: a rosgraph_launcher runs there, and needs no ssh"


def _description(name: str, node: Any, parameters: dict[str, Any]) -> NodeDescription:
    return NodeDescription(
        name=name,
        namespace=node.namespace,
        package=node.package,
        executable=node.type,
        args=node.args or "",
        remaps=tuple((source, target) for source, target in node.remap_args),
        environment=tuple((key, value) for key, value in node.env_args),
        cwd=node.cwd,
        output=node.output or "log",
        respawn=bool(node.respawn),
        respawn_delay=float(node.respawn_delay or 0.0),
        required=bool(node.required),
        launch_prefix=node.launch_prefix or None,
        machine="" if _is_here(node.machine) else str(node.machine.address),
        parameters=parameters,
    )
