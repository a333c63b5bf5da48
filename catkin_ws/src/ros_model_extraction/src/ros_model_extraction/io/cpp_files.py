"""Reads C++ sources, with the headers of their package that they include."""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import tree_sitter_cpp
from node_kit.io.input_files import real_path
from ros_model.language.metamodel import Position
from tree_sitter import Language, Node, Parser

from ros_model_extraction.cpp.declarations import File
from ros_model_extraction.cpp.node_reader import PROGRAM, Entry, node_of
from ros_model_extraction.cpp.syntax import child_of, text
from ros_model_extraction.io.source_files import read_source
from ros_model_extraction.io.workspace import package_folder
from ros_model_extraction.node_facts import NodeSource, Remark, SourceError

_LANGUAGE = Language(tree_sitter_cpp.language())
_ROS_CALL = re.compile(r"\b(advertise|subscribe|serviceClient|getParam|param)\w*\s*(<|\()|\bSimpleAction")
_BODIES = ("function_definition", "class_specifier", "struct_specifier", "comment")
_CLASS_LOADER = b"pluginlib::ClassLoader"
_PLUGIN = re.compile(rb'"([a-z]\w*)(?:/|::)([A-Za-z]\w*)"')
_MAX_LINES = 20
_SOURCES = (".cpp", ".cc", ".cxx")
_HEADERS = (".h", ".hpp", ".hh", ".hxx")


def read_cpp_node(
    sources: Iterable[Path],
    package_folder: Path,
    parameters: Callable[[str], Any] | None = None,
    entry: Entry = PROGRAM,
) -> NodeSource:
    """Return what C++ sources make of a node.

    Args:
        sources: of the executable and of the package's libraries that it links.
        package_folder: its package; positions name files relative to it.
        parameters: the value of a parameter by its name as the code has it, or KeyError; without it, defaults count.
        entry: where its code starts.

    Raises:
        SourceError: none of the sources can be read.
    """
    files, remarks = _read_files(sources, package_folder)
    return node_of(files, remarks, parameters, entry)


def _read_files(sources: Iterable[Path], package_folder: Path) -> tuple[list[File], list[Remark]]:
    """Return the sources and then the headers, and remarks about those that can't be read.

    Raises:
        SourceError: none of the sources can be read.
    """
    files: list[File] = []
    remarks: list[Remark] = []
    todo, seen = list(sources), set()
    others = _OtherPackages(package_folder)
    while todo or (todo := [path for path in _plugins(files, others) if real_path(path) not in seen]):
        path = todo.pop(0)
        if real_path(path) in seen:
            continue
        seen.add(real_path(path))
        try:
            files.append(_read(path, others.shown(path), remarks))
        except SourceError as error:
            remarks.append(error.remark)
            continue
        todo += _included(files[-1], path, package_folder)
        todo += _of_other_packages(files[-1], others)
    if not files and remarks:
        raise SourceError(remarks[0])
    return files, remarks


def _read(path: Path, shown: str, remarks: list[Remark]) -> File:
    file, said = _parsed(path, shown, path.stat().st_mtime_ns if os.path.isfile(path) else 0)
    remarks += said
    return file


@functools.lru_cache(maxsize=512)  # the executables of packages share libraries and headers
def _parsed(path: Path, shown: str, _changed: int) -> tuple[File, tuple[Remark, ...]]:
    root = Parser(_LANGUAGE).parse(read_source(path, shown)).root_node
    remarks = []
    for bad in _not_understood(root):
        position = Position(shown, bad.start_point[0] + 1, bad.start_point[1] + 1)
        lines = bad.end_point[0] - bad.start_point[0] + 1
        said = f"not read: {lines} line(s) that can't be parsed; look whether they make interfaces or read parameters"
        remarks.append(Remark(position, said))
    return File(shown, root), tuple(remarks)


def _not_understood(root: Node) -> Iterator[Node]:
    """Yield what can't be parsed, and may be about ROS; macros that the parser does not know are everywhere."""
    todo = [root] if root.has_error else []
    while todo:
        node = todo.pop()
        lines = node.end_point[0] - node.start_point[0]
        if node.is_error and lines < _MAX_LINES:
            if _ROS_CALL.search(text(node)):
                yield node
        else:  # an error of that size is around what was understood
            todo += [child for child in reversed(node.children) if child.has_error or child.is_error]


class _OtherPackages:
    """The packages on ROS_PACKAGE_PATH that have their source there, besides the one that is read."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._folders: dict[str, Path | None] = {}

    def folder(self, name: str) -> Path | None:
        """Return the folder of a package's source; None where there is none, and for the package that is read."""
        if name not in self._folders:
            found = package_folder(name)
            is_source = found is not None and os.path.isfile(found / "CMakeLists.txt") and found != self._folder
            self._folders[name] = found if is_source else None
        return self._folders[name]

    def any_folder(self, name: str) -> Path | None:
        """Return the folder of a package's source, also of the package that is read."""
        own = self._folder
        is_own = f"<name>{name}</name>".encode() in _content(own / "package.xml")
        return own if is_own else self.folder(name)

    def shown(self, path: Path) -> str:
        """Return a path for people: relative to the package that is read, or with the name of another one."""
        if path.is_relative_to(self._folder):
            return str(path.relative_to(self._folder))
        for name, folder in self._folders.items():
            if folder is not None and path.is_relative_to(folder):
                return f"{name}/{path.relative_to(folder)}"
        return path.name


def _plugins(files: Sequence[File], others: _OtherPackages) -> Iterator[Path]:
    """Yield the sources of the plug-ins that a text in the files names, where they load any by pluginlib."""
    contents = [file.root.text or b"" for file in files]
    if not any(_CLASS_LOADER in content for content in contents):
        return
    named = {match for content in contents for match in _PLUGIN.findall(content)}
    for package, name in sorted((package.decode(), name.decode()) for package, name in named):
        folder = others.any_folder(package)
        exported = re.compile(rf"PLUGINLIB_EXPORT_CLASS\(\s*[\w:]*\b{name}\s*,".encode())
        for path in sorted(_files_below(folder)) if folder else ():
            if path.suffix == ".cpp" and os.path.isfile(path) and exported.search(_content(path)):
                yield path


@functools.lru_cache(maxsize=1024)
def _content(path: Path) -> bytes:
    try:
        return read_source(path, path.name)
    except SourceError:
        return b""


def _of_other_packages(file: File, others: _OtherPackages) -> Iterator[Path]:
    """Yield the headers of other packages that a file includes, each with the source of its name."""
    for name in _includes(file):
        folder = others.folder(name.partition("/")[0]) if name.endswith(_HEADERS) else None
        header = folder / "include" / name if folder else None
        if folder is None or header is None or not os.path.isfile(header):
            continue
        yield header
        alike = (path for path in _files_below(folder / "src") if path.name.startswith(f"{header.stem}."))
        yield from sorted(path for path in alike if path.suffix in _SOURCES)


def _files_below(top: Path) -> Iterator[Path]:
    """Yield the files below a folder, in no order; links to folders are not followed."""
    todo = [top]
    while todo:
        folder = todo.pop()
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    if entry.is_dir(follow_symlinks=False):
                        todo.append(folder / entry.name)
                    else:
                        yield folder / entry.name
        except OSError:  # it is missing, or not for us
            continue


def _included(file: File, path: Path, folder: Path) -> Iterator[Path]:
    real = real_path(folder)
    for name in _includes(file):
        for place in (path.parent, folder / "include", folder / "src"):
            header = place / name
            if name.endswith(_HEADERS) and os.path.isfile(header) and real_path(header).is_relative_to(real):
                yield header
                break


def _includes(file: File) -> Iterator[str]:
    """Yield what a file includes, also within conditions of the preprocessor and namespaces."""
    todo = [file.root]
    while todo:
        node = todo.pop()
        if node.type == "preproc_include":
            yield text(child_of(node, "path")).strip('<>"')
        elif node.type not in _BODIES:
            todo += reversed(node.named_children)
