"""The parameters that dynamic_reconfigure makes of a package's `.cfg` files, read without running them."""

from __future__ import annotations

from pathlib import Path

from ros_model.language.metamodel import Position
from ros_model.language.reconfigure import ReconfigureError, parse_reconfigure

from ros_model_extraction.io.source_files import read_source
from ros_model_extraction.node_facts import Configurations, FoundParameter, Remark, SourceError


def read_configurations(folder: Path) -> tuple[Configurations, tuple[Remark, ...]]:
    """Return the parameters of each file in a package's folder `cfg`, and what in them is not understood."""
    found: dict[str, tuple[FoundParameter, ...]] = {}
    remarks: list[Remark] = []
    for path in sorted((folder / "cfg").glob("*.cfg")):
        shown = f"cfg/{path.name}"
        try:
            code = read_source(path, shown).decode("utf-8", "replace")
            name, parameters, said = configuration(code, shown, path.stem)
        except SourceError as error:
            remarks.append(error.remark)
            continue
        found[name] = parameters
        remarks += said
    return found, tuple(remarks)


def configuration(code: str, shown: str, stem: str) -> tuple[str, tuple[FoundParameter, ...], tuple[Remark, ...]]:
    """Return what one file makes: the name of the class, its parameters, and what is not understood.

    Args:
        code: the content of the file.
        shown: its path for people.
        stem: its name without `.cfg`, which names the class where the file does not.

    Raises:
        SourceError: the file is no Python.
    """
    try:
        found = parse_reconfigure(code)
    except ReconfigureError as error:
        raise SourceError(Remark(Position(shown, error.line, 1), f"not read: {error}")) from error
    parameters = (FoundParameter(p.name, p.default, Position(shown, *p.place), p.kind) for p in found.parameters)
    remarks = (Remark(Position(shown, *place), text) for place, text in found.unknown)
    return f"{found.name or stem}Config", tuple(parameters), tuple(remarks)
