"""Reads CMakeLists.txt as far as executables need it: runs its commands, loops, functions, and plain variables."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

_TOKEN = re.compile(
    r"""\#[^\n]* | "(?P<quoted>(?:[^"\\]|\\.)*+)" | (?P<open>\() | (?P<close>\)) | (?P<bare>(?:[^\s()"\#\\]|\\.)++)""",
    re.DOTALL | re.VERBOSE,
)
_BRACKET = re.compile(r"#?\[(=*)\[")
_VARIABLE = re.compile(r"\$\{([A-Za-z0-9_./+-]+)\}")
_MAX_WORDS = 10_000
_MAX_LENGTH = 100_000
_MAX_TOTAL = 1_000_000
"""Characters of all words of a command."""
_MAX_DEPTH = 3
"""Variables within variables' names, `${${PROJECT_NAME}_SOURCES}`; values are expanded when they are set."""
_MAX_EFFORT = 10_000
"""Of all commands of a file: see `_effort`."""
_MAX_CALLS = 32
_BLOCKS = ("foreach", "function", "macro", "if", "while")
_TESTING = ("CATKIN_ENABLE_TESTING", "BUILD_TESTING")
_OUTER = ";outer"
"""Names of variables that a function sets for its caller; no variable of a file has a semicolon in its name."""


@dataclass(frozen=True)
class Command:
    """A command with its arguments, variables replaced; what could not be replaced still holds `${...}`.

    Attributes:
        folder: of the CMakeLists.txt that has the command; its relative paths start there.
        line: of that file; of the call, where a function of the file has the command.
    """

    name: str
    arguments: tuple[str, ...]
    line: int
    folder: Path


def commands(text: str, folder: Path, read: Callable[[Path], str] | None = None) -> Iterator[Command]:
    """Yield the commands of a CMakeLists.txt in the order in which CMake runs them.

    Loops and the file's own functions and macros are run. Branches are taken as if they were not there, but for what is
    built only for tests.

    Args:
        text: its content.
        folder: where it lies, for `file(GLOB ...)`.
        read: gives the content of a CMakeLists.txt by its path, for `add_subdirectory`; without it, those are left out.
    """
    yield from _Run(folder, read).run(_lines(text), folder)


def sections(arguments: Sequence[str], keywords: Collection[str]) -> dict[str, list[str]]:
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


_Words = list[tuple[str, bool]]
_Line = tuple[str, _Words, int, int]
"""Name, words and line of a command, and how many commands further its block ends; 0 where it begins none."""


class _Run:
    """Runs a CMakeLists.txt, and those of the folders below that it adds."""

    def __init__(self, folder: Path, read: Callable[[Path], str] | None) -> None:
        self._read = read
        self._variables = {f"{name}_SOURCE_DIR": str(folder) for name in ("CMAKE", "PROJECT")}
        self._functions: dict[str, tuple[bool, list[str], list[_Line]]] = {}
        self._left = _MAX_EFFORT
        self._added: set[Path] = set()

    def run(self, lines: Sequence[_Line], folder: Path, call: int = 0, depth: int = 0) -> Iterator[Command]:
        """Run commands.

        Args:
            lines: the commands.
            folder: of the file that has them.
            call: line of the call, 0 outside of functions.
            depth: of calls and loops.
        """
        at = 0
        while at < len(lines) and self._left > 0 and depth <= _MAX_CALLS:
            name, words, line, span = lines[at]
            self._variables["CMAKE_CURRENT_SOURCE_DIR"] = str(folder)
            end = min(at + span, len(lines))
            inner = lines[at + 1 : end]
            arguments = tuple(_expanded(words, self._variables))
            self._left -= _effort(name, arguments)
            at = end + 1
            if name == "foreach" and arguments:
                if inner and depth < _MAX_CALLS:
                    yield from self._loop(arguments, inner, folder, call, depth)
            elif name in ("function", "macro") and arguments:
                self._functions[arguments[0].lower()] = (name == "macro", list(arguments[1:]), list(inner))
            elif name in _BLOCKS:
                if name == "if" and _is_for_tests(words):
                    self._left -= len(inner) // 100  # to look for its end takes time, too
                    inner = inner[_otherwise(inner) :]
                yield from self.run(inner, folder, call, depth + 1)
            elif name in self._functions:
                yield from self._call(name, arguments, folder, call or line, depth)
            elif name == "add_subdirectory" and arguments:
                yield from self._add(arguments[0], folder, depth)
            else:
                self._assign(name, arguments, folder)
                yield Command(name, arguments, call or line, folder)

    def _loop(
        self, arguments: Sequence[str], inner: Sequence[_Line], folder: Path, call: int, depth: int
    ) -> Iterator[Command]:
        variable, before = arguments[0], self._variables.get(arguments[0])
        for item in self._items(arguments[1:]):
            if self._left <= 0:
                break
            self._variables[variable] = item
            yield from self.run(inner, folder, call, depth + 1)
        self._restore({variable: before})

    def _items(self, words: Sequence[str]) -> list[str]:
        """Return what a loop goes through."""
        if words[:1] == ("RANGE",):
            if len(words) not in (2, 3, 4) or not all(word.isdecimal() for word in words[1:]):
                return []
            first, *rest = (int(word[:6]) for word in words[1:])
            start, stop, step = (0, first, 1) if not rest else (first, rest[0], max(1, (*rest, 1)[1]))
            return [str(number) for number in range(start, stop + 1, step)[:_MAX_WORDS]]
        if words[:1] != ("IN",):
            return list(words)
        parts = sections(words[1:], ("LISTS", "ITEMS"))
        listed = (item for name in parts.get("LISTS", ()) for item in self._variables.get(name, "").split(";") if item)
        return [*islice(listed, _MAX_WORDS), *parts.get("ITEMS", ())]

    def _call(self, name: str, arguments: tuple[str, ...], folder: Path, call: int, depth: int) -> Iterator[Command]:
        is_macro, parameters, body = self._functions[name]
        given = dict(zip(parameters, arguments, strict=False))
        given |= {f"ARGV{number}": argument for number, argument in enumerate(arguments)}
        given |= {
            "ARGV": ";".join(arguments),
            "ARGC": str(len(arguments)),
            "ARGN": ";".join(arguments[len(parameters) :]),
        }
        if is_macro:
            before: dict[str, str | None] = {key: self._variables.get(key) for key in given}
            self._variables |= given
            yield from self.run(body, folder, call, depth + 1)
            self._restore(before)
            return
        self._left -= len(self._variables) // 1000
        outer, self._variables = self._variables, self._variables | given | {_OUTER: ""}
        yield from self.run(body, folder, call, depth + 1)
        inner, self._variables = self._variables, outer
        for key in filter(None, inner[_OUTER].split(";")):
            self._variables[key] = inner[f"{_OUTER}{key}"]

    def _add(self, name: str, folder: Path, depth: int) -> Iterator[Command]:
        below = Path(os.path.normpath(folder / name))
        if self._read is None or "${" in name or below in self._added:
            return
        self._added.add(below)
        outer, self._variables = self._variables, dict(self._variables)
        yield from self.run(_lines(self._read(below / "CMakeLists.txt")), below, 0, depth + 1)
        self._variables = outer

    def _restore(self, before: dict[str, str | None]) -> None:
        for key, value in before.items():
            if value is None:
                self._variables.pop(key, None)
            else:
                self._variables[key] = value

    def _append(self, variable: str, values: Sequence[str]) -> None:
        """Append to a list; leave it as it is where it would be too long."""
        before = [self._variables[variable]] if self._variables.get(variable) else []
        appended = ";".join([*before, *values])
        if len(appended) <= _MAX_LENGTH:
            self._variables[variable] = appended

    def _assign(self, name: str, arguments: Sequence[str], folder: Path) -> None:
        """Set the variables that a command sets."""
        variables = self._variables
        match name, arguments:
            case "set", (variable, *values):
                kept = values[: values.index("CACHE")] if "CACHE" in values else values
                if kept[-1:] == ["PARENT_SCOPE"] and _OUTER in variables:
                    self._append(_OUTER, [variable])
                    variables[f"{_OUTER}{variable}"] = ";".join(kept[:-1])
                else:
                    variables[variable] = ";".join(value for value in kept if value != "PARENT_SCOPE")
            case "unset", (variable, *_):
                variables.pop(variable, None)
            case "qt4_wrap_cpp" | "qt5_wrap_cpp" | "qt4_add_resources" | "qt5_add_resources", (variable, *_):
                variables[variable] = ""  # files that it makes
            case "list", ("APPEND", variable, *values):
                self._append(variable, values)
            case "project", (project, *_):
                variables["PROJECT_NAME"] = project
            case "file", ("GLOB" | "GLOB_RECURSE" as kind, variable, *patterns):
                variables[variable] = ";".join(_glob(patterns, folder, recurse=kind == "GLOB_RECURSE"))
            case "cmake_parse_arguments", (prefix, options, single, several, *rest) if rest[:1] != ["PARSE_ARGV"]:
                flags = frozenset(options.split(";"))
                keywords = flags | {*single.split(";"), *several.split(";")}
                for keyword, values in sections(rest, keywords - {""}).items():
                    is_option = keyword in flags
                    variables[f"{prefix}_{keyword or 'UNPARSED_ARGUMENTS'}"] = "TRUE" if is_option else ";".join(values)


def _lines(text: str) -> list[_Line]:
    """Return the commands of a file; a block that does not end goes on to the end of what has it."""
    found = list(_raw(text))
    ends: dict[int, int] = {}
    begun: dict[str, list[int]] = {block: [] for block in _BLOCKS}
    for at, (name, _, _) in enumerate(found):
        if name in begun:
            begun[name].append(at)
        elif name.startswith("end") and begun.get(name[3:]):
            ends[begun[name[3:]].pop()] = at
    spans = (ends.get(at, len(found)) - at if name in begun else 0 for at, (name, _, _) in enumerate(found))
    return [(*line, span) for line, span in zip(found, spans, strict=True)]


def _otherwise(inner: Sequence[_Line]) -> int:
    """Return where a condition's other branch starts; the number of lines if it has none."""
    depth = 0
    for at, (name, *_) in enumerate(inner):
        depth += (name == "if") - (name == "endif")
        if depth == 0 and name in ("else", "elseif"):
            return at
    return len(inner)


def _is_for_tests(words: _Words) -> bool:
    condition = [word for word, _ in words]
    return condition[:1] != ["NOT"] and any(word.strip("${}") in _TESTING for word in condition)


def _raw(text: str) -> Iterator[tuple[str, list[tuple[str, bool]], int]]:
    """Yield (name, [(word, whether it was quoted)], line) of each command."""
    name, depth, start = "", 0, 1
    words: list[tuple[str, bool]] = []
    line, at = 1, 0
    for kind, word, start_of_token in _tokens(text):
        line += text.count("\n", at, start_of_token)
        at = start_of_token
        if kind == "open":
            depth += 1
        elif kind == "close":
            depth = max(depth - 1, 0)
            if depth == 0 and name:
                yield name.lower(), words, start
                name, words = "", []
        elif kind == "bare" and depth == 0:
            name, words, start = word, [], line
        elif kind in ("bare", "quoted", "bracket") and depth:
            words.append((word, kind != "bare"))


def _tokens(text: str) -> Iterator[tuple[str, str, int]]:
    """Yield (kind, word, place) of each token: bare, quoted, bracket, open or close. Comments are left out."""
    unclosed: set[str] = set()  # closing brackets that are nowhere in the rest of the text
    at = 0
    while match := _TOKEN.search(text, at):
        bracket = _BRACKET.match(text, match.start())
        closing = f"]{bracket[1]}]" if bracket else ""
        if bracket and closing not in unclosed:
            end = text.find(closing, bracket.end())
            if end >= 0:
                if not bracket[0].startswith("#"):
                    yield "bracket", text[bracket.end() : end], match.start()
                at = end + len(closing)
                continue
            unclosed.add(closing)
        if match.lastgroup:
            yield match.lastgroup, match[match.lastgroup], match.start()
        at = match.end()


def _effort(name: str, arguments: Sequence[str]) -> int:
    """Return how much a command costs: a glob for each of its patterns, any command for many words or a long text."""
    patterns = len(arguments) if name == "file" else 0
    return 1 + patterns + len(arguments) // 100 + sum(map(len, arguments)) // 10_000


def _expanded(words: Sequence[tuple[str, bool]], variables: dict[str, str]) -> Iterator[str]:
    count = length = 0
    for word, is_quoted in words:
        text = word
        for _ in range(_MAX_DEPTH):
            replaced = _replaced(text, variables)
            if replaced == text:
                break
            text = replaced
        for part in [text] if is_quoted else text.split(";"):
            count += 1
            length += len(part)
            if count > _MAX_WORDS or length > _MAX_TOTAL:
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
        if relative.startswith("/") or ".." in relative or "${" in relative or not Path(relative).parts:
            continue
        try:
            matches = folder.rglob(relative) if recurse else folder.glob(relative)
            found += sorted(str(path) for path in matches)[:_MAX_WORDS]
        except (ValueError, NotImplementedError, RecursionError, OSError):
            continue
    return found
