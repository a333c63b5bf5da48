"""`rosmodel extract`: models from source code and launch files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click
from node_kit.one_line import one_line
from ros_model.cli import BAD_INPUT
from ros_model.errors import ModelError

if TYPE_CHECKING:
    from collections.abc import Iterable

_INCOMPLETE = 1
_LAUNCH_FILES = (".launch", ".xml", ".test")


@click.command()
@click.argument("path", metavar="PATH")
@click.argument("arguments", nargs=-1, metavar="[PATH | ARG:=VALUE]...")
@click.option("-o", "--output", default=".", metavar="FOLDER", help="Where the files go; made if it is missing.")
@click.option(
    "--run-programs", is_flag=True, help="Run programs that a launch file names in `command=`, as roslaunch does."
)
def extract(path: str, arguments: tuple[str, ...], output: str, run_programs: bool) -> int:
    """Write models of what is in PATH: a ROS package, a folder of packages, or a launch file.

    A package gives PACKAGE.ros: its executables (rospy and roscpp), their interfaces and parameters, its messages.
    Several folders are read one after the other.
    A launch file (.launch, .xml, .test), read by roslaunch with the arguments ARG:=VALUE, gives NAME.rossystem and
    NAME.ros. Nothing of what is read is run, unless --run-programs says so.
    What the source does not tell is marked so, with its place, in names and in comments at the top of the files.

    Exit status: 0 all was read, 1 some source file or folder could not be read, 2 a package or launch file could not.
    """
    if os.path.isfile(path):  # False where that can't be looked at, which find_packages tells
        if Path(path).suffix not in _LAUNCH_FILES or Path(path).name == "package.xml":
            known = ", ".join(f"*{suffix}" for suffix in _LAUNCH_FILES)
            raise ModelError(
                f"{path}: no launch file ({known}): give one, or the folder of a ROS package, or of several"
            )
        return _launch_file(Path(path), arguments, output, run_programs)
    for argument in arguments:
        if ":=" in argument:
            raise ModelError(f"{argument}: arguments are for a launch file, and {path} is a folder")
        if os.path.isfile(argument):
            raise ModelError(f"{argument}: not read beside the folder {path}: give folders only, or one launch file")
    return _all_packages((path, *arguments), output)


def _launch_file(path: Path, arguments: tuple[str, ...], output: str, runs_programs: bool) -> int:
    from ros_model_extraction.io.launch_files import read_launch_file  # imported when asked for
    from ros_model_extraction.io.output import write_models

    models = read_launch_file(path, arguments, runs_programs=runs_programs)
    for written in write_models(models, output, models.system.name):
        click.echo(f"wrote {written}")
    nodes = len(models.system.components)
    click.echo(f"{nodes} node{'s' * (nodes != 1)}, {len(models.system.connections)} connections")
    return 0


def _all_packages(paths: Iterable[str], output: str) -> int:
    """Extract from every folder, also after one that can't be read, and return the gravest status."""
    status = 0
    for path in paths:
        try:
            status = max(status, _packages(Path(path), output))
        except ModelError as error:
            click.echo(f"rosmodel: {error}", err=True)
            status = BAD_INPUT
    return status


def _packages(path: Path, output: str) -> int:
    from ros_model_extraction.io.output import write_package_set
    from ros_model_extraction.packages.catkin_package import find_packages
    from ros_model_extraction.packages.package_source import extract_package

    folders, unread = find_packages(Path(os.path.normpath(path)))  # without `a/..`, but links stay as they are named
    for remark in unread:
        click.echo(f"rosmodel: {remark.position.file}: {remark.text}", err=True)
    status = _INCOMPLETE if unread else 0
    for folder in folders:
        try:
            extracted = extract_package(folder)
            model = extracted.model()
        except Exception as error:  # whatever a source makes of its reader: the other packages are read anyway
            unforeseen = f"{folder}: can't be read ({type(error).__name__}: {error}): report it with the package"
            click.echo(f"rosmodel: {error if isinstance(error, ModelError) else one_line(unforeseen)}", err=True)
            status = BAD_INPUT
            continue
        for remark in extracted.unread:
            click.echo(f"rosmodel: {folder}/{remark}", err=True)
            status = max(status, _INCOMPLETE)
        written = write_package_set(model, output, extracted.package.name)
        nodes = [node for node in extracted.nodes.values() if node.is_node]
        ports = [port for node in nodes for port in node.ports]
        unknown = sum(not port.is_resolved or not port.type for port in ports)
        counts = f"{len(nodes)} node{'s' * (len(nodes) != 1)}, {len(ports)} interface{'s' * (len(ports) != 1)}"
        click.echo(f"wrote {written}: {counts}, {unknown} not fully known")
    return status
