"""Tables of variants and of expected levels: one named row for each variant, from CSV or YAML."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_model.errors import Gathered, ModelError, first_of
from ros_model.file_names import safe_file_name
from ros_model.language.metamodel import Position, Value
from ros_model.project.yaml_file import parse_yaml

if TYPE_CHECKING:
    from pathlib import Path

    from ros_model.project.schema_check import Keys

NAME = "name"
FORMATS = (".csv", ".yaml", ".yml")
"""Extensions of files that can be tables."""
_INTEGER = re.compile(r"[-+]?\d{1,18}")
_DOUBLE = re.compile(r"[-+]?(?:\d++\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?")
_BOOLEANS = {"true": True, "True": True, "false": False, "False": False}
_LARGEST_CELL = 100_000
_LARGEST_NUMBER = 1e300  # NaN is not below it either, nor are integers that no double holds


@dataclass(frozen=True)
class Row:
    """A variant as the table has it. An empty cell is None."""

    name: str
    cells: Mapping[str, Value | None]
    position: Position


@dataclass(frozen=True)
class Table:
    """Rows with the same columns, and names of their own that can name files."""

    path: Path
    columns: tuple[str, ...]
    rows: tuple[Row, ...]

    def row(self, name: str) -> Row | None:
        """Return the row of that name, or None."""
        return next((row for row in self.rows if row.name == name), None)


def parse_table(text: str, path: Path) -> Table:
    """Return the table that a text is.

    A `.csv` file has a line of columns, a `.yaml` file a list of rows or a mapping of names to rows. A cell of a CSV
    file is an integer, a double, `true` or `false` where it looks like one, else text.

    Args:
        text: the content of the file.
        path: the file, whose extension tells the format.

    Raises:
        ModelError: the file is no such table, or a name stands twice or can't name a file.
    """
    wrong = Gathered()
    rows = _csv_rows(text, path, wrong) if path.suffix == ".csv" else _yaml_rows(text, path, wrong)
    wrong.add(_wrong_names(rows))
    wrong.tell()
    if not rows:
        raise _fault("no rows: add one for each variant", Position(str(path), 1, 1))
    columns = dict.fromkeys(column for row in rows for column in row.cells)
    complete = (Row(row.name, {column: row.cells.get(column) for column in columns}, row.position) for row in rows)
    return Table(path, tuple(columns), tuple(complete))


def _wrong_names(rows: list[Row]) -> Iterator[ModelError]:
    seen: set[str] = set()
    for row in rows:
        if row.name in seen:
            yield _fault(f"name {row.name!r} stands twice: rename one", row.position)
        seen.add(row.name)
        try:
            safe_file_name(row.name, "variant")
        except ModelError as error:
            yield _fault(error.message, row.position)


def _fault(message: str, where: Position) -> ModelError:
    """Return an error in the content of a table that can be read."""
    return ModelError(message, where, rule="table")


def _csv_rows(text: str, path: Path, wrong: Gathered) -> list[Row]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[Row] = []
    csv.field_size_limit(_LARGEST_CELL)
    try:
        columns = [column.strip() for column in next(reader, [])]
        if NAME not in columns:
            raise _fault(f"no column {NAME!r}: the first line must name the columns", Position(str(path), 1, 1))
        if twice := [column for column, count in Counter(columns).items() if count > 1 or not column]:
            raise first_of(
                _fault(f"column {column!r} is empty or stands twice", Position(str(path), 1, 1)) for column in twice
            )
        for cells in reader:
            where = Position(str(path), reader.line_num, 1)
            if not cells:
                continue
            if len(cells) != len(columns):
                wrong.add([_fault(f"has {len(cells)} cells, must have {len(columns)}, as line 1", where)])
                continue
            row = dict(zip(columns, cells, strict=True))
            name = row.pop(NAME).strip()
            rows.append(Row(name, {column: typed_cell(cell.strip()) for column, cell in row.items()}, where))
    except csv.Error as error:
        raise ModelError(f"{error}: correct the line", Position(str(path), reader.line_num, 1)) from error
    return rows


def typed_cell(cell: str) -> Value | None:
    """Return what a cell of a CSV file says: None, a boolean, a number, or the text itself."""
    if not cell:
        return None
    if cell in _BOOLEANS:
        return _BOOLEANS[cell]
    if _INTEGER.fullmatch(cell):
        return int(cell)
    return float(cell) if _DOUBLE.fullmatch(cell) and abs(float(cell)) < float("inf") else cell


def _yaml_rows(text: str, path: Path, wrong: Gathered) -> list[Row]:
    content, places = parse_yaml(text, str(path))
    entries: list[tuple[Keys, object, object]]
    if isinstance(content, dict):
        entries = [((key,), {NAME: key, **row} if isinstance(row, dict) else row, key) for key, row in content.items()]
    elif isinstance(content, list):
        entries = [((number,), row, None) for number, row in enumerate(content)]
    else:
        raise _fault("must be a list of rows, or a mapping of names to rows", Position(str(path), 1, 1))
    rows = []
    for keys, entry, key in entries:
        with wrong.step():
            rows.append(_yaml_row(entry, key, places.get(keys, Position(str(path), 1, 1))))
    return rows


def _yaml_row(entry: object, key: object, where: Position) -> Row:
    if not isinstance(entry, dict) or not all(isinstance(column, str) for column in entry):
        raise _fault("a row must be a mapping of columns to values", where)
    name = entry.get(NAME)
    if not isinstance(name, str) or (key is not None and name != key):
        raise _fault(f"a row's name must be text, not {name!r}: put it in quotes", where)
    cells = {column: _value(value, column, where) for column, value in entry.items() if column != NAME}
    return Row(name, cells, where)


def _value(value: object, column: str, where: Position) -> Value | None:
    """Return a value of YAML as a value of the language."""
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, (int, float)) and abs(value) < _LARGEST_NUMBER:
        return value
    if isinstance(value, list) and all(item is not None for item in value):
        return [item for entry in value if (item := _value(entry, column, where)) is not None]
    if isinstance(value, dict) and value and all(isinstance(k, str) and v is not None for k, v in value.items()):
        return {name: item for name, entry in value.items() if (item := _value(entry, column, where)) is not None}
    raise _fault(f"column {column!r} is {value!r}: give a number, true or false, text, a list or a struct", where)
