"""`rosmodel check`: what is wrong in models."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click
from node_kit.io.input_files import real_path

from ros_model.checks.families import check_family, families
from ros_model.checks.launched import check_launch_file
from ros_model.checks.packages import check_packages
from ros_model.checks.systems import check_system
from ros_model.checks.whole_projects import check_project
from ros_model.cli import BAD_INPUT
from ros_model.cli.reports import FORMATS
from ros_model.errors import ModelError, printable
from ros_model.findings import ERROR, WARNING, Finding
from ros_model.generators import MARK
from ros_model.io.installed import InstalledPackages
from ros_model.io.models import files_in, models_at, read_all, read_packages
from ros_model.language.any_language import PACKAGES
from ros_model.language.library import Library
from ros_model.language.metamodel import compose
from ros_model.language.packages import PackageSet
from ros_model.project.repairs import repair_lines
from ros_model.project.requirements import requirement_lines
from ros_model.project.roles import role_lines
from ros_model.project.settings import FILE_NAME

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.checks.launched import LaunchFile
    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project


_LAUNCH = ".launch"
_UNREADABLE = ("syntax", "unreadable")  # rules that a file breaks which can't be read


@click.command()
@click.option(
    "--path",
    "folders",
    multiple=True,
    type=click.Path(),
    metavar="FOLDER",
    help="Where .ros models are that references lead to, in this folder or below; may be given several times.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(list(FORMATS)),
    default="text",
    show_default=True,
    help="How findings are told: for people, for programs, as annotations of a GitHub workflow, as SARIF 2.1.0.",
)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path())
def check(files: tuple[str, ...], folders: tuple[str, ...], form: str) -> int:
    """Check .rossystem and .ros files, folders of them, projects by their metacontrol.yaml or folder, or .launch files.

    References are followed to the .ros models that are checked, stand beside the files, belong to their project, or are
    found with --path. Message types of installed ROS packages are known. A variant is checked with its project's base.
    Of a launch file, the machines and the executables are checked, with the defaults of its arguments.
    Of a project, the text also tells which components each design requires and by which way, what fills roles, and how
    components are repaired.

    Exit status: 0 all is well or only warnings were given, 1 something is wrong in a model, 2 a file can't be read.
    """
    checked = Check(folders)
    for file in files:
        checked.add(Path(file))
    findings = checked.findings()
    if text := FORMATS[form](findings):
        click.echo(text)
    if form == "text":
        lines = [line for project in checked.projects for line in _designs_lines(project)]
        for line in lines or ([] if text else ["nothing is wrong"]):
            click.echo(printable(line))
    if any(finding.severity == ERROR and finding.rule in _UNREADABLE for finding in findings):
        return BAD_INPUT
    return int(any(finding.severity == ERROR for finding in findings))


def _designs_lines(project: Project) -> tuple[str, ...]:
    """Return what designs of a project require, what fills their roles, and how components are repaired."""
    return (*requirement_lines(project), *role_lines(project), *repair_lines(project))


class Check:
    """Gathers what there is to check, then checks it by all that is known."""

    def __init__(self, folders: Iterable[str] = ()) -> None:
        self._refused: list[Finding] = []
        self._unknown: dict[Path, Finding] = {}  # what could not be read, though nobody asked to check it
        self._asked: set[Path] = set()
        self._projects: dict[Path, Project] = {}
        self._loaded: dict[Path, Project] = {}
        self._systems: dict[Path, RosSystem] = {}
        self._wholes: dict[Path, RosSystem] = {}  # what a system that is a variant is part of
        self._packages: dict[Path, PackageSet] = {}
        self._beside: dict[Path, PackageSet] = {}
        self._generated: set[Path] = set()
        self._launch_files: dict[Path, LaunchFile] = {}
        for folder in folders:
            self._know(files_in(Path(folder), PACKAGES))

    def add(self, path: Path) -> None:
        """Add a file, a project or a folder of files."""
        try:
            if path.suffix == _LAUNCH:
                self._add_launch_file(path)
                return
            if path.name == FILE_NAME or os.path.isfile(path / FILE_NAME):
                self.add_project(self._load(path if os.path.isdir(path) else path.parent))
                return
            found = models_at(path)
        except ModelError as error:
            self._refuse(error)
            return
        for file in found:
            self._add_file(file)
        if not os.path.isdir(path):
            self._know(sorted(path.parent.glob(f"*{PACKAGES}")))

    def add_project(self, project: Project) -> None:
        """Add a project that is loaded, with its `.ros` models."""
        self._projects[project.folder] = project
        for file in files_in(project.source.path.parent, PACKAGES):
            self._add_file(file)
            if file in self._packages and self._packages[file].header.startswith(MARK):
                self._generated.add(file)

    @property
    def projects(self) -> tuple[Project, ...]:
        """The projects that were added and could be loaded."""
        return tuple(self._projects.values())

    def findings(self) -> list[Finding]:
        """Return all that is wrong, file by file."""
        models = {**self._beside, **self._packages}
        # Models of observers that are generated do not show that the modeller has models of the robot's nodes.
        known = models.values() if models.keys() - self._generated else ()
        installed = InstalledPackages()
        sources = Library(package for packages in known if not packages.is_observed for package in packages.packages)
        library = Library((package for packages in known for package in packages.packages), installed)
        found = [*self._refused]
        found += [finding for path, finding in self._unknown.items() if path not in self._asked]
        for path, packages in self._packages.items():
            if path not in self._generated:  # what is wrong there is wrong in metacontrol.yaml
                found += check_packages(packages, library)
        for path, system in self._systems.items():
            found += check_system(system, self._wholes.get(path), library, installed, sources)
        for launch in self._launch_files.values():
            found += check_launch_file(launch, installed)
        for family in families(self._systems.values()):
            found += check_family(family)
        for project in self._projects.values():
            found += check_project(project, library, sources)
        return [*dict.fromkeys(found)]

    def _add_launch_file(self, path: Path) -> None:
        from ros_model.io.launch_files import read_launch_file  # imported when asked for: roslaunch takes its time

        self._launch_files[path] = read_launch_file(path)

    def _add_file(self, path: Path) -> None:
        self._asked.add(real_path(path))
        try:
            model = read_all(path)
        except ModelError as error:
            self._refuse(error)
            return
        if isinstance(model, PackageSet):
            self._packages[path] = model
            return
        self._systems[path] = model
        project = self._project_around(path)
        if project is not None:
            self._know(files_in(project.source.path.parent, PACKAGES))
            if real_path(path) != real_path(project.source.inside("base")):
                self._wholes[path] = compose(project.base, model)

    def _project_around(self, path: Path) -> Project | None:
        """Return the project that a model belongs to, by the folder that it is in or the one above."""
        here = path.parent
        for folder in (here, here / ".." if here.name in {"", ".."} else here.parent):
            if os.path.isfile(folder / FILE_NAME):
                try:
                    return self._load(folder)
                except ModelError:  # it is told where the project itself is checked
                    return None
        return None

    def _load(self, folder: Path) -> Project:
        from ros_model.io.project import load_project

        key = real_path(folder)
        if key not in self._loaded:
            self._loaded[key] = load_project(folder)
        return self._loaded[key]

    def _know(self, paths: Iterable[Path]) -> None:
        """Read packages that references may lead to."""
        for path in paths:
            if path not in self._beside and path not in self._packages:
                try:
                    self._beside[path] = read_packages(path)
                except ModelError as error:
                    self._unknown[real_path(path)] = _warning(path, error)

    def _refuse(self, error: ModelError) -> None:
        known = {str(finding) for finding in self._refused}
        self._refused += [found for found in map(Finding.of, error.all) if str(found) not in known]


def _warning(path: Path, error: ModelError) -> Finding:
    """Return what is told of a file that was not asked for: its own errors would hide those of the ones that were."""
    count = f"{len(error.all)} error{'s' * (len(error.all) != 1)}"
    message = f"{path} can't be read: {count}; its packages are unknown: check it by itself"
    return Finding(message, None, "unreadable", WARNING)
