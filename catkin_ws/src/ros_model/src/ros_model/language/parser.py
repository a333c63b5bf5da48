"""Parses the text of a model by its language's grammar, and says what is wrong in it."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lark import Lark
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from ros_model.errors import ModelError, first_of, short
from ros_model.language.builder import MAX_ERRORS
from ros_model.language.comments import header
from ros_model.language.metamodel import MAX_SIZE, Position
from ros_model.language.recovery import Recovery

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.language.builder import Builder

_REPAIRABLE = 500_000  # characters of a text, and that are read again all in all, to find more errors than one

_GRAMMARS = Path(__file__).parent / "grammar"
_SKIPPED = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|'(?:[^'\\]|\\.)*+'|"(?:[^"\\]|\\.)*+"|(?:(?!/\*)[^\s{}(),'"])++""", re.DOTALL
)
_ENDS_OF_FILE = {"$END", "<END-OF-FILE>"}  # lark's parser and lexer each have a name for it
_DESCRIBED = {
    "WORD": "a name or value",
    "FIELD_WORD": "a type or name",
    "CONSTANT": "a value",
    "STRING": "a string",
    "BRACKETS": "'[]'",
    "PRIMITIVE": "a type",
}
_UNTOLD = {  # what could stand in a place, but nobody writes today
    "COMMENT",
    "_ANY_VALUE",
    "_ARTIFACTS",
    "_GLOBAL",
    "_MEMBER",
    "_MEMBER_TYPE",
    "_NODE",
    "_PACKAGES",
    "_PRIVATE",
    "_RELATIVE",
    "_SEQUENCE",
    "_STRUCT_MEMBERS",
    "_STRUCT_VALUE",
}
_SPELLINGS = re.compile(r'^(\w+)(?:\.2)?: \(?((?:"[^"]+"(?: \| )?)+)\)?(?: _END)?$', re.MULTILINE)  # in a grammar


class Parser:
    """Parses a language by its grammar; a builder makes the model while the parser reduces.

    Args:
        grammar: name of the grammar's file, which the words, types and values that both languages share complete.
        start: the rule of a whole file.
        builder: has one method for each rule.
    """

    def __init__(self, grammar: str, start: str, builder: Builder) -> None:
        text = "\n".join((_GRAMMARS / name).read_text(encoding="utf-8") for name in (grammar, "common.lark"))
        self._builder = builder
        self._words = {name: re.findall('"([^"]+)"', words) for name, words in _SPELLINGS.findall(text)}
        self._parser = Lark(text, start=start, parser="lalr", lexer="contextual", transformer=builder)

    def parse(self, text: str, file: str) -> Any:
        """Return the model that a text is; `file` is its name in positions and errors.

        Raises:
            ModelError: the first thing that is wrong, with the others in the file as far as it could be read.
        """
        if len(text) > MAX_SIZE:
            raise ModelError(f"{len(text)} characters are too many for a model ({MAX_SIZE})", Position(file, 1, 1))
        errors: list[ModelError] = []
        model = self._read(text, file, errors)
        if errors:
            raise first_of(errors)
        return model

    def _read(self, text: str, file: str, errors: list[ModelError]) -> Any:
        """Read; where a statement is wrong, add its error, read again without it, and so on."""
        recovery = Recovery(text)
        remaining = text
        read = 0
        while True:
            self._builder.begin(file, header(text))
            try:
                model = self._parser.parse(remaining)
            except UnexpectedInput as error:
                offset = _offset(error, text)
                if not recovery.is_consequence(offset):
                    errors.append(self._syntax_error(error, offset, text, file))
                read += offset
                if len(errors) >= MAX_ERRORS or max(read, len(text)) > _REPAIRABLE:
                    return None
                repaired = recovery.without(
                    offset, {word for name in _expected(error) for word in self._words.get(name, ())}
                )
                if repaired is None:
                    return None
                remaining = repaired
            except ModelError as error:  # of what can't be repaired
                errors += [*self._builder.errors, error]
                return None
            else:
                errors += [*self._builder.errors, *(() if errors else self._builder.doubtful)]
                return model

    def _syntax_error(self, error: UnexpectedInput, offset: int, text: str, file: str) -> ModelError:
        """Return the error that says in one line what was expected, and near what."""
        position = Position(file, *line_and_column(text, offset))
        names = _expected(error)
        hint = ""
        if offset >= len(text.rstrip()):
            near = "the end of the file"
            position = Position(file, *line_and_column(text, len(text.rstrip())))
        elif isinstance(error, UnexpectedToken):
            near = f"'{short(str(error.token))}'"
            hint = _of_an_open_quote(text, offset) or self._similar(str(error.token), names)
        else:
            near = repr(short(text[offset:].split("\n", 1)[0]))
            if text[offset] in "'\"":
                near = f"a string that is never closed, {near}"
            elif text.startswith("/*", offset):
                return ModelError("this comment is never closed: add '*/'", position)
        expected = sorted({self._described(name) for name in names - _UNTOLD - _ENDS_OF_FILE}, key=_words_first)
        if names & _ENDS_OF_FILE:
            expected.append("the end of the file")
        return ModelError(f"expected {' or '.join(expected) or 'something else'} near {near}{hint}", position)

    def _described(self, terminal: str) -> str:
        """Return a terminal as a user writes it, in the first of its spellings."""
        return _DESCRIBED.get(terminal) or f"'{self._words[terminal][0] if terminal in self._words else '='}'"

    def _similar(self, word: str, names: Iterable[str]) -> str:
        """Return the hint that another word was meant, where the one found is almost an expected one."""
        words = [word for name in sorted(names) for word in self._words.get(name, ())]
        found = difflib.get_close_matches(word, words, n=1, cutoff=0.75) if len(word) < 40 else []
        return f": did you mean '{found[0]}'?" if found else ""


def line_and_column(text: str, offset: int) -> tuple[int, int]:
    """Return line and column, from 1, of an offset."""
    return text.count("\n", 0, offset) + 1, offset - (text.rfind("\n", 0, offset) + 1) + 1


def _offset(error: UnexpectedInput, text: str) -> int:
    """Return where an error is; the end of the text where something is missing there."""
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        return int(error.token.start_pos or 0)
    return (error.pos_in_stream or 0) if isinstance(error, UnexpectedCharacters) else len(text)


def _of_an_open_quote(text: str, offset: int) -> str:
    """Return the hint that a quote is missing, where the string before an error goes on over the end of a line."""
    last = None
    for match in _SKIPPED.finditer(text, 0, offset if offset <= _REPAIRABLE else 0):
        last = match
    if last is None or last[0][0] not in "'\"" or "\n" not in last[0]:
        return ""
    return f": the string before it begins in line {line_and_column(text, last.start())[0]}, is its quote missing?"


def _expected(error: UnexpectedInput) -> set[str]:
    """Return the names of the terminals that could stand where an error is."""
    if isinstance(error, UnexpectedToken):
        return set(error.accepts or error.expected)
    return set(error.allowed or ()) if isinstance(error, UnexpectedCharacters) else set()


def _words_first(described: str) -> tuple[bool, str]:
    return not described[1].isalpha(), described
