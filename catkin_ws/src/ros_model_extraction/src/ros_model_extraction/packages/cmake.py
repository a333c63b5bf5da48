"""Reads CMakeLists.txt as far as executables need it: commands with arguments, and variables that are set plainly."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

_TOKEN = re.compile(
    r"""\#\[(?P<comment_marks>=*)\[.*?\](?P=comment_marks)\] | \#[^\n]*
      | \[(?P<marks>=*)\[(?P<bracket>.*?)\](?P=marks)\]
      | "(?P<quoted>(?:[^"\\]|\\.)*)" | (?P<open>\() | (?P<close>\)) | (?P<bare>(?:[^\s()"\#\\]|\\.)+)""",
    re.DOTALL | re.VERBOSE,
)
_VARIABLE = re.compile(r"\$\{([A-Za-z0-9_./+-]+)\}")
_MAX_WORDS = 10_000
_MAX_LENGTH = 100_000
_MAX_DEPTH = 3
"""Variables within variables' names, `${${PROJECT_NAME}_SOURCES}`; values are expanded when they are set."""


@dataclass(frozen=True)
class Command:
    """A command with its arguments, variables replaced; what could not be replaced still holds `${...}`."""

    name: str
    arguments: tuple[str, ...]
    line: int


def commands(text: str, folder: Path) -> Iterator[Command]:
    """Yield the commands of a CMakeLists.txt in order. Branches and loops are taken as if they were not there.

    Args:
        text: its content.
        folder: where it lies, for `file(GLOB ...)`.
    """
    variables = {name: str(folder) for name in ("CMAKE_CURRENT_SOURCE_DIR", "CMAKE_SOURCE_DIR", "PROJECT_SOURCE_DIR")}
    for name, words, line in _raw(text):
        arguments = tuple(_expanded(words, variables))
        if name == "set" and arguments:
            values = [a for a in arguments[1:] if a not in ("CACHE", "PARENT_SCOPE")]
            variables[arguments[0]] = ";".join(values)
        elif name == "list" and arguments[:1] == ("APPEND",) and len(arguments) > 1:
            before = [variables[arguments[1]]] if variables.get(arguments[1]) else []
            variables[arguments[1]] = ";".join([*before, *arguments[2:]])
        elif name == "project" and arguments:
            variables["PROJECT_NAME"] = arguments[0]
        elif name == "file" and arguments[:1] in (("GLOB",), ("GLOB_RECURSE",)) and len(arguments) > 1:
            variables[arguments[1]] = ";".join(_glob(arguments[2:], folder, recurse=arguments[0] == "GLOB_RECURSE"))
        yield Command(name, arguments, line)


def sections(arguments: Sequence[str], keywords: Sequence[str]) -> dict[str, list[str]]:
    """Return the arguments after each keyword; those before the first under ""."""
    found: dict[str, list[str]] = {"": []}
    current = ""
    for argument in arguments:
        if argument in keywords:
            current = argument
            found.setdefault(current, [])
        else:
            found[current].append(argument)
    return found


def _raw(text: str) -> Iterator[tuple[str, list[tuple[str, bool]], int]]:
    """Yield (name, [(word, whether it was quoted)], line) of each command."""
    name, depth, start = "", 0, 1
    words: list[tuple[str, bool]] = []
    line, at = 1, 0
    for match in _TOKEN.finditer(text):
        line += text.count("\n", at, match.start())
        at = match.start()
        kind = match.lastgroup
        if kind == "open":
            depth += 1
        elif kind == "close":
            depth = max(depth - 1, 0)
            if depth == 0 and name:
                yield name.lower(), words, start
                name, words = "", []
        elif kind == "bare" and depth == 0:
            name, words, start = match["bare"], [], line
        elif kind in ("bare", "quoted", "bracket") and depth:
            words.append((match[kind], kind != "bare"))


def _expanded(words: Sequence[tuple[str, bool]], variables: dict[str, str]) -> Iterator[str]:
    count = 0
    for word, is_quoted in words:
        text = word
        for _ in range(_MAX_DEPTH):
            replaced = _replaced(text, variables)
            if replaced == text:
                break
            text = replaced
        for part in [text] if is_quoted else text.split(";"):
            count += 1
            if count > _MAX_WORDS:
                return
            if part or is_quoted:
                yield part


def _replaced(text: str, variables: dict[str, str]) -> str:
    """Return a text with its variables replaced; the text as it is where that would be too long."""
    parts, length, end = [], 0, 0
    for match in _VARIABLE.finditer(text):
        parts += [text[end : match.start()], variables.get(match[1], match[0])]
        end = match.end()
        length += len(parts[-2]) + len(parts[-1])
        if length > _MAX_LENGTH:
            return text
    return "".join([*parts, text[end:]])


def _glob(patterns: Sequence[str], folder: Path, *, recurse: bool) -> list[str]:
    found = []
    for pattern in patterns:
        relative = pattern.removeprefix(f"{folder}/")
        if relative.startswith("/") or ".." in relative or "${" in relative or not relative:
            continue
        try:
            matches = folder.rglob(relative) if recurse else folder.glob(relative)
            found += sorted(str(path) for path in matches)[:_MAX_WORDS]
        except (ValueError, NotImplementedError, OSError):
            continue
    return found
