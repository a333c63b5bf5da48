"""`rosmodel doctor`: what the first start of the meta-controller would stumble over."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
import rosgraph
from ros_model.cli.check import Check
from ros_model.cli.ranges import timeout_option
from ros_model.errors import ModelError, printable
from ros_model.findings import ERROR
from ros_model.project.settings import FILE_NAME

if TYPE_CHECKING:
    from ros_model.project.project import Project

    from mros1_reasoner.doctor.complaints import Complaint
    from mros1_reasoner.doctor.facts import SystemFacts


@click.command()
@click.argument("models", default=".", metavar="[FOLDER]")
@click.option("--master", metavar="URI", help="Address of the ROS master; else $ROS_MASTER_URI.")
@click.option("--namespace", metavar="NAME", help="Where the robot lives; else $ROS_NAMESPACE, else /.")
@click.option(
    "--listen",
    type=click.FloatRange(min=0.0),
    default=2.0,
    show_default=True,
    metavar="S",
    help="For so long to topics, to see which are periodic; 0: not.",
)
@timeout_option("Patience with the master.")
def doctor(models: str, master: str | None, namespace: str | None, listen: float, timeout: float) -> int:
    """Look at the running system and at the project in FOLDER before the meta-controller starts for the first time.

    FOLDER is that of a package with models/, or that of metacontrol.yaml. Each line says what is wrong, where, and the
    remedy. Lines that begin with `note:` are no hindrance. Nothing is changed. Launch files that the robot's nodes were
    started by are read.

    Exit status: 0 nothing is wrong, 1 something is, 2 the project or the master can't be looked at.
    """
    folder = _folder(Path(models))
    told = _Told()
    project = _checked(folder, told)
    if project is not None:
        _look(project, master or rosgraph.get_master_uri(), _absolute(namespace), timeout, listen, told)
    click.echo(told.summary())
    return int(told.count > 0)


class _Told:
    """Tells complaints, and counts them."""

    def __init__(self) -> None:
        self.count = 0

    def add(self, line: str, *, is_note: bool = False) -> None:
        """Tell one line."""
        click.echo(printable(line))
        self.count += not is_note

    def add_all(self, complaints: list[Complaint]) -> None:
        """Tell complaints, notes last."""
        for complaint in sorted(dict.fromkeys(complaints), key=lambda complaint: complaint.is_note):
            self.add(str(complaint), is_note=complaint.is_note)

    def summary(self) -> str:
        """Return how many there were."""
        return f"{self.count} finding{'s' * (self.count != 1)}" if self.count else "nothing found"


def _folder(path: Path) -> Path:
    for folder in (path, path / "models"):
        if os.path.isfile(folder / FILE_NAME):
            return folder
    raise ModelError(f"{path}: no {FILE_NAME} is there or in its models/: give the folder of the project")


def _absolute(namespace: str | None) -> str:
    return "/" + (namespace if namespace is not None else os.environ.get("ROS_NAMESPACE", "")).strip("/")


def _checked(folder: Path, told: _Told) -> Project | None:
    """Tell what `rosmodel check` finds; return the project if it can be loaded."""
    checked = Check()
    checked.add(folder)
    for finding in checked.findings():
        if finding.severity == ERROR:
            told.add(f"{finding}: correct it, then: rosmodel check {folder}")
    return next(iter(checked.projects), None)


def _look(project: Project, master: str, namespace: str, timeout: float, listen: float, told: _Told) -> None:
    """Tell what is wrong with the package, then with the running system.

    Raises:
        ModelError: the master can't be asked.
    """
    from node_kit.io.xml_rpc import CallError  # imported when asked for, as what follows
    from ros_model.io.master import take_snapshot

    from mros1_reasoner.doctor.complaints import package_complaints, system_complaints
    from mros1_reasoner.io.first_look import look_at_package, look_at_system, scope_of

    package = look_at_package(project)
    told.add_all(package_complaints(project, package))
    try:
        snapshot = take_snapshot(master, timeout)
    except CallError as error:
        raise ModelError(f"{error}: start the robot, or set ROS_MASTER_URI or --master") from error
    system = look_at_system(project, snapshot, namespace, master)
    complaints = system_complaints(project, package, system, scope_of(project))
    told.add_all([*complaints, *_silences(project, system, master, listen)])


def _silences(project: Project, system: SystemFacts, master: str, duration: float) -> list[Complaint]:
    """Return notes about topics that are not watched, after listening to them."""
    from mros1_reasoner.doctor.silence import silence_complaints, unwatched_topics

    topics = unwatched_topics(project, system)
    if not topics or not duration:
        return []
    os.environ["ROS_MASTER_URI"] = master
    from mros1_reasoner.ros.arrivals import listen

    return list(silence_complaints(project, replace(system, arrivals=listen(topics, duration))))
