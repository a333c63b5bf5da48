"""Reads a ROS package from its folder: name, dependencies, executables and their sources."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from catkin_pkg.package import InvalidPackage, parse_package_string
from node_kit.io.input_files import real_path
from ros_model.errors import ModelError
from ros_model.language.metamodel import Position

from ros_model_extraction.io.source_files import read_source, read_xml
from ros_model_extraction.io.workspace import package_folder
from ros_model_extraction.node_facts import Configurations, Remark, SourceError
from ros_model_extraction.packages.cmake import Command, commands, sections
from ros_model_extraction.packages.nodelet_files import nodelets_of
from ros_model_extraction.packages.reconfigure_files import read_configurations

MANIFEST = "package.xml"
_CMAKE = "CMakeLists.txt"
_IGNORED_FOLDERS = {"build", "devel", "install", "node_modules", "__pycache__"}
_NOT_SEARCHED = {"test", "tests", "cfg"}
_NO_SCRIPTS = {".cfg", ".pyc", ".so"}
_SOURCES = {".cpp", ".cc", ".cxx", ".c", ".C"}
_MAX_DEPENDENCIES = 500
"""Of a package.xml: catkin_pkg compares each with all others, and 3,000 take it 7 s."""
_DEPENDENCY = re.compile(rb"<\w*depend\b")
_PYTHON = re.compile(rb"#!.*\bpython[0-9.]*\b|#!.*@PYTHON")
_INSTALL_WORDS = ("PROGRAMS", "FILES", "TARGETS", "DIRECTORY", "DESTINATION", "RUNTIME", "PATTERN", "OPTIONAL")
_LIBRARY_WORDS = ("STATIC", "SHARED", "MODULE", "OBJECT", "EXCLUDE_FROM_ALL", "WIN32", "ALIAS", "INTERFACE")
_LINK_WORDS = ("PUBLIC", "PRIVATE", "INTERFACE", "LINK_PUBLIC", "LINK_PRIVATE")


@dataclass(frozen=True)
class Executable:
    """A program of a package: a Python script, or what is compiled from C++ sources; or a nodelet.

    Attributes:
        nodelet: the class of a nodelet, with its namespaces; "" for a program.
        loaded_as: the name that a nodelet is loaded by, `package/Class`.
    """

    name: str
    sources: tuple[Path, ...]
    is_python: bool
    position: Position
    nodelet: str = ""
    loaded_as: str = ""


@dataclass(frozen=True)
class CatkinPackage:
    """What a package's folder tells.

    Attributes:
        external_dependencies: what is depended on and is no ROS package that is installed.
        plugins: classes that its own executables may load by name, `module:Class`, from its exports to itself.
        configurations: the parameters of dynamic_reconfigure.
        remarks: what could not be read or understood.
    """

    name: str
    folder: Path
    dependencies: tuple[str, ...]
    external_dependencies: tuple[str, ...]
    executables: tuple[Executable, ...]
    plugins: tuple[str, ...]
    configurations: Configurations
    remarks: tuple[Remark, ...]


def find_packages(path: Path) -> tuple[tuple[Path, ...], tuple[Remark, ...]]:
    """Return the folders of the packages at or below a path, and which folders below it can't be read.

    Each package comes once; links are followed, but never in a circle.

    Raises:
        ModelError: there is none, or the path can't be read.
    """
    try:
        path.stat()
        if path.is_dir():
            _enter(path)
    except (OSError, ValueError) as error:  # ValueError: a null character in the path
        reason = getattr(error, "strerror", None) or error
        what = "no such folder" if isinstance(error, FileNotFoundError) else f"not read: {reason}"
        raise ModelError(f"{path}: {what}: give the folder of a ROS package, or of several") from error
    if not path.is_dir():
        raise ModelError(f"{path}: is no folder: give the folder of a ROS package, or of several")
    remarks: list[Remark] = []
    found = tuple(_packages_below(path, remarks))
    if not found:
        said = "".join(f"; {remark.position.file}: {remark.text}" for remark in remarks)
        raise ModelError(f"{path}: no {MANIFEST} here or below: give the folder of a ROS package, or of several{said}")
    return found, tuple(remarks)


def read_package(folder: Path) -> CatkinPackage:
    """Return what a package's folder tells.

    Raises:
        ModelError: its package.xml can't be read.
    """
    manifest = folder / MANIFEST
    data = read_xml(manifest, f"a {MANIFEST}")
    if (count := len(_DEPENDENCY.findall(data))) > _MAX_DEPENDENCIES:
        problem = f"{count} dependencies are too many (at most {_MAX_DEPENDENCIES}): leave out what is not needed"
        raise ModelError(problem, Position(str(manifest), 1, 1))
    try:
        package = parse_package_string(data.decode("utf-8"), str(manifest))
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise ModelError("it is not UTF-8: save it as UTF-8 text", Position(str(manifest), line, 1)) from error
    except InvalidPackage as error:
        raise ModelError(_first_line(error), Position(str(manifest), *_place(error))) from error
    except AssertionError as error:
        problem = "its format is none that catkin_pkg knows: correct the attribute `format`"
        raise ModelError(problem, Position(str(manifest), 1, 1)) from error
    except (ValueError, RecursionError) as error:  # an encoding that is none, or one that the text does not have
        problem = f"it can't be read ({error}): save it as well-formed UTF-8 XML"
        raise ModelError(problem, Position(str(manifest), 1, 1)) from error
    found = _Executables(folder)
    described = [e.attributes["plugin"] for e in package.exports if e.tagname == "nodelet" and "plugin" in e.attributes]
    found.read(described)
    configurations, said = read_configurations(folder)
    dependencies = sorted({d.name for d in (*package.exec_depends, *package.build_depends, *package.run_depends)})
    installed = {name: path for name in dependencies if (path := package_folder(name))}
    for below in installed.values():
        configurations = {**read_configurations(below)[0], **configurations}
    plugins = tuple(
        value
        for export in package.exports
        if export.tagname == package.name
        for value in export.attributes.values()
        if re.fullmatch(r"[\w.]+:\w+", value)
    )
    return CatkinPackage(
        package.name,
        folder,
        tuple(name for name in dependencies if name in installed),
        tuple(name for name in dependencies if name not in installed),
        tuple(sorted(found.executables.values(), key=lambda executable: executable.name)),
        plugins,
        configurations,
        (*found.remarks, *said),
    )


class _Executables:
    """Collects the executables of a package, from CMakeLists.txt and from what the file system says."""

    def __init__(self, folder: Path) -> None:
        self.executables: dict[str, Executable] = {}
        self.remarks: list[Remark] = []
        self._folder = folder
        self._libraries: dict[str, list[Path]] = {}
        self._compiled: dict[str, tuple[list[Path], Position]] = {}
        self._links: dict[str, list[str]] = {}
        self._outputs: dict[str, str] = {}

    def read(self, nodelets: Sequence[str] = ()) -> None:
        """Collect them.

        Args:
            nodelets: the files that describe the package's nodelets, as package.xml names them.
        """
        path = self._folder / _CMAKE
        if path.is_file():
            for command in commands(self._text(path), self._folder, self._text):
                self._command(command)
        for name, (sources, position) in self._compiled.items():
            linked = [source for library in self._reachable(name) for source in self._libraries.get(library, ())]
            output = self._outputs.get(name, name)
            every = tuple(dict.fromkeys([*sources, *linked]))
            self.executables[output] = Executable(output, every, False, position)
        used = {library for name in self._compiled for library in self._reachable(name)}
        for described in nodelets:
            used |= self._nodelets(described.replace("${prefix}/", ""))
        for library in sorted(self._libraries.keys() - used):
            if self._libraries[library]:
                text = f"the library {library} is linked by no executable here, and not looked at (a plug-in, perhaps)"
                self.remarks.append(Remark(Position(_CMAKE, 1, 1), text))
        for script in _scripts(self._folder, self.remarks):
            relative = str(script.relative_to(self._folder))
            self.executables.setdefault(script.name, Executable(script.name, (script,), True, Position(relative, 1, 1)))

    def _nodelets(self, described: str) -> set[str]:
        """Collect the nodelets that a file describes, and return the libraries that have them."""
        path = Path(os.path.normpath(self._folder / described))
        if not path.is_relative_to(self._folder) or not os.path.isfile(path):
            self.remarks.append(Remark(Position(MANIFEST, 1, 1), f"not read: {described}, which describes nodelets"))
            return set()
        try:
            nodelets = nodelets_of(path, described)
        except SourceError as error:
            self.remarks.append(error.remark)
            return set()
        used = set()
        for found in nodelets:
            names = [name for name in self._libraries if self._outputs.get(name, name) == found.library]
            every = list(dict.fromkeys(library for name in names for library in (name, *self._reachable(name))))
            sources = tuple(dict.fromkeys(source for library in every for source in self._libraries[library]))
            if not sources:
                text = f"not read: the nodelet {found.name}: no source of the library {found.library} is known"
                self.remarks.append(Remark(found.position, text))
                continue
            used |= set(every)
            short = found.name.rpartition("/")[2]
            name = short if short not in self.executables else f"{short}_nodelet"
            self.executables[name] = Executable(name, sources, False, found.position, found.type, found.name)
        return used

    def _text(self, path: Path) -> str:
        """Return a CMakeLists.txt of the package; nothing, and a remark, where it can't be read."""
        if not path.is_relative_to(self._folder) or not os.path.isfile(path):
            return ""
        try:
            return read_source(path, str(path.relative_to(self._folder))).decode("utf-8", "replace")
        except SourceError as error:
            self.remarks.append(error.remark)
            return ""

    def _command(self, command: Command) -> None:
        arguments = command.arguments
        match command.name:
            case "catkin_install_python" | "install":
                for program in sections(arguments, _INSTALL_WORDS).get("PROGRAMS", ()):
                    self._program(program, command)
            case "add_executable" | "cs_add_executable" | "catkin_add_executable" if arguments:
                self._compiled[arguments[0]] = (self._sources(arguments[1:], command), self._position(command))
            case "add_library" | "cs_add_library" | "catkin_add_library" if arguments:
                self._libraries[arguments[0]] = self._sources(arguments[1:], command)
            case "target_link_libraries" if arguments:
                linked = [argument for argument in arguments[1:] if argument not in _LINK_WORDS]
                self._links.setdefault(arguments[0], []).extend(linked)
            case "set_target_properties":
                parts = sections(arguments, ("PROPERTIES",))
                properties = parts.get("PROPERTIES", [])
                if "OUTPUT_NAME" in properties[:-1]:
                    for target in parts[""]:
                        self._outputs[target] = properties[properties.index("OUTPUT_NAME") + 1]

    def _program(self, program: str, command: Command) -> None:
        position = self._position(command)
        path = self._inside(program, command)
        if path is None or not os.path.isfile(path):  # which says no where the folder can't be entered
            self.remarks.append(Remark(position, f"not read: the program {program} is not in the package"))
        elif _is_python(path):
            self.executables[path.name] = Executable(path.name, (path,), True, position)
        else:
            self.remarks.append(Remark(position, f"the program {program} is not read: its first line names no Python"))

    def _sources(self, names: Sequence[str], command: Command) -> list[Path]:
        found = []
        for name in names:
            if name in _LIBRARY_WORDS or (Path(name).suffix and Path(name).suffix not in _SOURCES):
                continue
            path = self._inside(name, command)
            if path is None or not os.path.isfile(path):
                text = f"not read: the source {name} of {command.arguments[0]} is not in the package"
                self.remarks.append(Remark(self._position(command), text))
            else:
                found.append(path)
        return found

    def _position(self, command: Command) -> Position:
        return Position(str((command.folder / _CMAKE).relative_to(self._folder)), command.line, 1)

    def _inside(self, name: str, command: Command) -> Path | None:
        """Return the path of a file of the package, None for one that is outside or not known."""
        if "${" in name or "$<" in name:
            return None
        path = Path(os.path.normpath(command.folder / name))
        return path if path.is_relative_to(self._folder) else None

    def _reachable(self, target: str) -> list[str]:
        found: list[str] = []
        todo = list(self._links.get(target, ()))
        while todo:
            library = todo.pop(0)
            if library not in found and library in self._libraries:
                found.append(library)
                todo += self._links.get(library, ())
        return found


def _packages_below(top: Path, remarks: list[Remark]) -> Iterator[Path]:
    seen: set[Path] = set()
    todo = [top]
    while todo:
        folder = todo.pop()
        real = real_path(folder)
        if real in seen:
            continue
        seen.add(real)
        try:
            entries = _enter(folder)
            is_left_out, is_package = os.path.exists(folder / "CATKIN_IGNORE"), (folder / MANIFEST).is_file()
        except OSError as error:
            remarks.append(Remark(Position(str(folder), 1, 1), f"not read: {error.strerror or error}"))
            continue
        if is_left_out:
            continue
        if is_package:
            yield folder
            continue
        searched = (entry for entry in reversed(entries) if entry.name not in _IGNORED_FOLDERS)
        todo += [entry for entry in searched if os.path.isdir(entry) and not entry.name.startswith(".")]


def _scripts(package: Path, remarks: list[Remark]) -> Iterator[Path]:
    """Yield the executable Python files of a package; links to folders are not followed."""
    todo = [package]
    while todo:
        folder = todo.pop()
        try:
            entries = _enter(folder)
        except OSError as error:
            shown = str(folder.relative_to(package))
            remarks.append(Remark(Position(shown, 1, 1), f"not read: {error.strerror or error}"))
            continue
        if folder != package and (folder / MANIFEST).exists():
            continue
        for entry in entries:
            if os.path.isdir(entry):
                searched = not entry.is_symlink() and entry.name not in _NOT_SEARCHED | _IGNORED_FOLDERS
                if searched and not entry.name.startswith("."):
                    todo.append(entry)
            elif entry.suffix not in _NO_SCRIPTS and entry.name != "setup.py" and _is_script(entry):
                yield entry


def _enter(folder: Path) -> list[Path]:
    """Return what is in a folder, in order.

    Raises:
        OSError: it can't be listed, or what is in it can't be looked at.
    """
    (folder / MANIFEST).exists()  # refused where listing alone is allowed
    return sorted(folder.iterdir())


def _is_script(path: Path) -> bool:
    try:
        return path.is_file() and os.access(path, os.X_OK) and _is_python(path)
    except OSError:
        return False


def _is_python(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return _PYTHON.match(file.readline(200)) is not None
    except OSError:
        return False


def _first_line(error: InvalidPackage) -> str:
    text = " ".join(str(error).split())
    return re.sub(r"^Error\(s\) in package '[^']*':\s*", "", text)


def _place(error: InvalidPackage) -> tuple[int, int]:
    match = re.search(r"line (\d+), column (\d+)", str(error))
    return (int(match[1]), int(match[2]) + 1) if match else (1, 1)
