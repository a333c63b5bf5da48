"""Reads C++ sources, with the headers of their package that they include."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import tree_sitter_cpp
from ros_model.language.metamodel import Position
from tree_sitter import Language, Node, Parser

from ros_model_extraction.cpp.declarations import File
from ros_model_extraction.cpp.node_reader import PROGRAM, Entry, node_of
from ros_model_extraction.cpp.syntax import (
    child_of,
    text,
    walk,
)
from ros_model_extraction.io.source_files import read_source
from ros_model_extraction.node_facts import NodeSource, Remark, SourceError

_LANGUAGE = Language(tree_sitter_cpp.language())
_ROS_CALL = re.compile(r"\b(advertise|subscribe|serviceClient|getParam|param)\w*\s*(<|\()|\bSimpleAction")
_MAX_LINES = 20
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
    parser = Parser(_LANGUAGE)
    todo, seen = list(sources), set()
    while todo:
        path = todo.pop(0)
        if path.resolve() in seen:
            continue
        seen.add(path.resolve())
        try:
            files.append(_read(path, package_folder, parser, remarks))
        except SourceError as error:
            remarks.append(error.remark)
            continue
        todo += _included(files[-1], path, package_folder)
    if not files and remarks:
        raise SourceError(remarks[0])
    return files, remarks


def _read(path: Path, folder: Path, parser: Parser, remarks: list[Remark]) -> File:
    shown = str(path.relative_to(folder)) if path.is_relative_to(folder) else str(path)
    root = parser.parse(read_source(path, shown)).root_node
    for bad in _not_understood(root):
        position = Position(shown, bad.start_point[0] + 1, bad.start_point[1] + 1)
        lines = bad.end_point[0] - bad.start_point[0] + 1
        text = f"not read: {lines} line(s) that can't be parsed; look whether they make interfaces or read parameters"
        remarks.append(Remark(position, text))
    return File(shown, root)


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


def _included(file: File, path: Path, folder: Path) -> Iterator[Path]:
    for node in walk(file.root):
        if node.type == "preproc_include":
            name = text(child_of(node, "path")).strip('<>"')
            for place in (path.parent, folder / "include", folder / "src"):
                header = place / name
                if (
                    name.endswith(_HEADERS)
                    and os.path.isfile(header)
                    and header.resolve().is_relative_to(folder.resolve())
                ):
                    yield header
                    break
