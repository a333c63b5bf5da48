"""Reads metacontrol.yaml and what it names: the base, tables, variants."""

from __future__ import annotations

import os
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from node_kit.io.input_files import real_path

from ros_model.checks.projects import (
    levels_of_nothing,
    two_meanings,
    wrong_levels,
    wrong_names,
    wrong_repairs,
    wrong_requirements,
    wrong_roles,
    wrong_surroundings,
)
from ros_model.errors import Gathered, ModelError, first_of
from ros_model.io.files import read_text
from ros_model.io.models import files_in, read_library, read_system
from ros_model.language.any_language import PACKAGES
from ros_model.project.columns import parse_columns
from ros_model.project.corrections import wrong_corrections
from ros_model.project.project import Project
from ros_model.project.settings import FILE_NAME, parse_settings
from ros_model.project.tables import FORMATS, parse_table
from ros_model.project.variants import make_systems, with_levels, without

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ros_model.language.library import Library
    from ros_model.language.metamodel import RosSystem
    from ros_model.project.columns import Columns
    from ros_model.project.schema_check import Keys
    from ros_model.project.settings import Settings
    from ros_model.project.tables import Table


def load_project(folder: str | Path) -> Project:
    """Read a folder's metacontrol.yaml, or that file itself, and the models that it names.

    Variants come from the tables or files that it names; without one, from the `.rossystem` files of `variants/`.

    Raises:
        ModelError: files are missing or wrong; says which, and where, of each table and each row.
    """
    source = read_settings(locate(folder))
    whole_base = read_system(source.inside("base"))
    with _ruled(source):
        columns = {keys: parse_columns(family, source.within(keys)) for keys, family in source.families}
    optional = frozenset().union(*(found.optional for found in columns.values()))
    base = without(whole_base, optional)
    variants: list[RosSystem] = []
    by_table: set[str] = set()
    levels: list[Table] = []
    wrong = Gathered()
    for keys, family in source.families:
        with wrong.step():
            if "table" in family:
                found, expected = _from_table(source, keys, whole_base, columns[keys])
                by_table.update(variant.name for variant in found)
                levels += expected
            else:
                found, expected = _from_files(source, keys)
                levels += expected
            variants += found
    wrong.tell()
    project = Project(
        folder=real_path(source.path.parent),
        settings=source.content,
        base=base,
        variants=tuple(variants),
        source=source,
        whole_base=whole_base,
        by_table=frozenset(by_table),
        read_library=partial(library_beside, source.path.parent),
    )
    wrong.add(wrong_names(project))
    wrong.add(wrong_levels(project))
    wrong.add(wrong_requirements(project))
    wrong.add(wrong_repairs(project))
    wrong.add(wrong_surroundings(project))
    wrong.add(wrong_roles(project))
    wrong.add(wrong_corrections(project))
    wrong.add(levels_of_nothing(project, levels))
    wrong.tell()
    wrong.add(two_meanings(project))
    wrong.tell()
    return project


def locate(folder: str | Path) -> Path:
    """Return the path of the metacontrol.yaml of a folder, or of that file itself.

    Raises:
        ModelError: the file is no YAML by its name.
    """
    path = Path(folder)
    if os.path.isfile(path) and path.suffix not in {".yaml", ".yml"}:
        raise ModelError(f"{path}: is no project: give the folder of {FILE_NAME}, or that file")
    return path / FILE_NAME if os.path.isdir(path) else path


def read_settings(path: Path, sections: Sequence[str] = ()) -> Settings:
    """Read and check a metacontrol.yaml.

    Args:
        path: the file.
        sections: check only these, and let the others be absent; all of them if empty.

    Raises:
        ModelError: it can't be read, or everything that is wrong in it.
    """
    settings, problems = parse_settings(read_text(path), path, sections)
    if problems:
        raise first_of(problems)
    return settings


def problems_of(path: Path) -> tuple[ModelError, ...]:
    """Return everything that is wrong in a metacontrol.yaml by itself, in the order of the file.

    Raises:
        ModelError: it can't be read.
    """
    return parse_settings(read_text(path), path)[1]


def read_table(path: Path) -> Table:
    """Read a table of variants or of expected levels.

    Raises:
        ModelError: the file can't be read, is no such table, or a name stands twice or can't name a file.
    """
    if path.suffix not in FORMATS:
        raise ModelError(f"{path}: is neither .csv nor .yaml: a table of variants is one of these")
    return parse_table(read_text(path), path)


def library_beside(folder: Path) -> Library:
    """Return what the `.ros` models of a folder, and of those below, declare.

    Raises:
        ModelError: one can't be read.
    """
    return read_library(files_in(folder, PACKAGES))


@contextmanager
def _ruled(source: Settings) -> Iterator[None]:
    """Mark errors in what was read as errors of the settings, or of a table."""
    try:
        yield
    except ModelError as error:
        for found in error.all:
            in_settings = found.position is None or found.position.file == str(source.path)
            found.rule = found.rule or ("settings" if in_settings else "table")
        raise


def _from_table(source: Settings, keys: Keys, base: RosSystem, columns: Columns) -> tuple[list[RosSystem], list[Table]]:
    """Return the variants of a family, and the table of their expected levels, where it has one."""
    family = dict(source.families)[keys]
    tables: list[Table] = []
    wrong = Gathered()
    for key in ("table", "qa"):
        if key in family:
            with wrong.step():
                tables.append(read_table(source.inside(*keys, key)))
    wrong.tell()
    with _ruled(source):
        library = library_beside(source.path.parent) if columns.nodes else None
        qa = tables[1] if len(tables) > 1 else None
        return [part for _, part in make_systems(base, columns, tables[0], qa, library)], tables[1:]


def _from_files(source: Settings, keys: Keys) -> tuple[list[RosSystem], list[Table]]:
    """Return the variants of a family that are written by hand, and the table of their levels, where it has one."""
    family = dict(source.families)[keys]
    if "files" in family:
        paths = [source.inside(*keys, "files", number) for number in range(len(family["files"]))]
    else:
        paths = sorted((source.path.parent / "variants").glob("*.rossystem"))
    if not paths:
        raise source.error("names no table, and variants/ holds no .rossystem file: add one", *keys)
    variants = [read_system(path) for path in paths]
    for path, variant in zip(paths, variants, strict=True):
        if path.parent.name == "variants" and path.stem != variant.name:
            raise ModelError(
                f"the variant {variant.name!r} must be in a file of its name: rename one",
                variant.position,
                rule="settings",
            )
    if "qa" not in family:
        return variants, []
    table = read_table(source.inside(*keys, "qa"))
    whole: list[RosSystem] = []
    wrong = Gathered()
    with _ruled(source):
        for variant in variants:
            with wrong.step():
                whole.append(with_levels(variant, table))
        wrong.tell()
    return whole, [table]
