"""The project of a robot: `metacontrol.yaml` and the models that it names, checked and read."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ros_model.errors import Gathered, ModelError
from ros_model.language.library import Library
from ros_model.language.metamodel import Position, RosSystem
from ros_model.language.model_files import PACKAGES, files_in
from ros_model.language.packages_reader import read_packages
from ros_model.language.reader import read_system
from ros_model.project.columns import Columns, parse_columns
from ros_model.project.settings import FILE_NAME, Settings, locate, read_settings
from ros_model.project.tables import read_table
from ros_model.project.variants import make_systems, without
from ros_model.project.wiring import required_by_parameters, required_components

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ros_model.project.columns import Where
    from ros_model.project.schema_check import Keys
    from ros_model.project.tables import Table

__all__ = ["DIRECTIONS", "FILE_NAME", "Project", "load_project"]

DIRECTIONS = ("lower_is_better", "higher_is_better")


@dataclass(frozen=True)
class Project:
    """A base system, its variants and what metacontrol.yaml says about them.

    Attributes:
        folder: the folder of metacontrol.yaml; the paths in it are relative to this.
        settings: the content of metacontrol.yaml, checked.
        base: the system without the choices that variants make, and without the components that some of them lack.
        variants: one partial system each, composed with the base (metamodel.compose).
        source: metacontrol.yaml, for positions in errors.
        whole_base: the system as its file has it.
        by_table: names of the variants that a table gives; the others are files of their own.
        packages_folder: where each variant is to become a catkin package, the published layout; None: plain files.
    """

    folder: Path
    settings: dict[str, Any]
    base: RosSystem
    variants: tuple[RosSystem, ...]
    source: Settings = field(repr=False, compare=False)
    whole_base: RosSystem = field(repr=False)
    by_table: frozenset[str] = frozenset()
    packages_folder: Path | None = None

    @cached_property
    def library(self) -> Library:
        """What the `.ros` models beside metacontrol.yaml, and below, declare.

        Raises:
            ModelError: one can't be read.
        """
        return read_library(files_in(self.folder, PACKAGES))

    @property
    def package(self) -> str:
        """Name of the catkin package that holds the models and what is generated from them."""
        return str(self.settings["package"])

    @property
    def base_file(self) -> str:
        """Name of the file, in the folder of the models, that holds `base`."""
        name = str(self.settings["base"])
        return name if self.base == self.whole_base else f"{Path(name).stem}.core.rossystem"

    def designs(self, function: str) -> tuple[RosSystem, ...]:
        """Return the variants that solve a function."""
        names = self.settings["functions"][function]["designs"]
        return tuple(v for v in self.variants if names == "all" or v.name in names)

    def function_of(self, variant: str) -> str:
        """Return the function that a variant solves.

        Raises:
            ModelError: no function names it among its designs.
        """
        for function in self.settings["functions"]:
            if any(design.name == variant for design in self.designs(function)):
                return str(function)
        raise self.source.error(f"none has {variant} among its designs: add it to one", "functions")

    def required_functions(self, variant: str) -> tuple[str, ...]:
        """Return the functions that must be provided for a variant to work.

        Raises:
            ModelError: no function names the variant among its designs.
        """
        required = self.settings["functions"][self.function_of(variant)].get("requires", [])
        return tuple(required.get(variant, ()) if isinstance(required, dict) else required)

    def required_components(self) -> dict[str, frozenset[str]]:
        """Return, for each variant, the components that it can't do without: by its wiring, and by `requires`."""
        by_value = self.settings["requires"]
        return {
            variant.name: required_components(self.base, variant) | required_by_parameters(variant, by_value)
            for variant in self.variants
        }


def read_library(paths: Iterable[Path]) -> Library:
    """Return what `.ros` models declare.

    Raises:
        ModelError: one can't be read.
    """
    return Library(package for path in paths for package in read_packages(path).packages)


def load_project(folder: str | Path) -> Project:
    """Read a folder's metacontrol.yaml, or that file itself, and the models that it names.

    Variants come from the tables or files that it names; without one, from the `.rossystem` files of `variants/`.

    Raises:
        ModelError: files are missing or wrong; says which, and where, of each table and each row.
    """
    source = read_settings(locate(folder))
    whole_base = read_system(source.inside("base"))
    with _ruled(source):
        columns = {keys: parse_columns(family, position_within(source, keys)) for keys, family in source.families}
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
                found = _from_files(source, keys)
            variants += found
    wrong.tell()
    project = Project(
        folder=source.path.parent.resolve(),
        settings=source.content,
        base=base,
        variants=tuple(variants),
        source=source,
        whole_base=whole_base,
        by_table=frozenset(by_table),
    )
    wrong.add(_wrong_names(project))
    wrong.add(_wrong_levels(project))
    wrong.add(_levels_of_nothing(project, levels))
    wrong.tell()
    wrong.add(_two_meanings(project))
    wrong.tell()
    return project


def position_within(source: Settings, keys: Keys) -> Where:
    """Return what gives the position of a value within a section of the settings."""

    def where(*inner: str | int) -> Position:
        return source.at(*keys, *inner)

    return where


@contextmanager
def _ruled(source: Settings) -> Iterator[None]:
    """Say of errors in what was read that the settings, or a table, are wrong."""
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
        return [part for _, part in make_systems(base, columns, *tables)], tables[1:]


def _from_files(source: Settings, keys: Keys) -> list[RosSystem]:
    family = dict(source.families)[keys]
    if "files" in family:
        paths = [source.inside(*keys, "files", number) for number in range(len(family["files"]))]
    else:
        paths = sorted((source.path.parent.resolve() / "variants").glob("*.rossystem"))
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
    return variants


def _wrong_names(project: Project) -> Iterator[ModelError]:
    source = project.source
    known = [variant.name for variant in project.variants]
    if twice := sorted({name for name in known if known.count(name) > 1}):
        yield source.error(f"two variants bear the name {twice[0]!r}: rename one", "variants")
    for name, function in project.settings["functions"].items():
        for number, design in enumerate(function["designs"] if function["designs"] != "all" else ()):
            if design not in known:
                keys = ("functions", name, "designs", number)
                yield source.error(f"{design!r} is none of the {len(known)} variants", *keys)
        if isinstance(function.get("requires"), dict):
            solving = {design.name for design in project.designs(name)}
            for design in function["requires"]:
                if design not in solving:
                    keys = ("functions", name, "requires", design)
                    yield source.error(f"{design!r} is none of the designs of {name}", *keys)
    components = {component.name for component in project.whole_base.components} | set(project.settings["components"])
    for parameter, choices in project.settings["requires"].items():
        for value, component in choices.items():
            if component not in components:
                yield source.error(
                    f"{component!r} is a component neither of the base nor of components: add it to one",
                    *("requires", parameter, value),
                )


def _wrong_levels(project: Project) -> Iterator[ModelError]:
    """Yield expected levels of no quality attribute that is there, and those outside its range."""
    known = project.settings["quality_attributes"]
    for variant in project.variants:
        for parameter in variant.parameters:
            quality, level = parameter.name.removeprefix("qa_"), parameter.value
            if quality == parameter.name:
                continue
            if quality not in known:
                wrong = f"which is none of quality_attributes: {', '.join(sorted(known))}"
                yield ModelError(
                    f"{variant.name} expects a level of {quality!r}, {wrong}", parameter.position, rule="level"
                )
                continue
            lowest, highest = known[quality].get("range", (-math.inf, math.inf))
            if isinstance(level, (int, float)) and not lowest <= level <= highest:
                yield ModelError(
                    f"{variant.name} expects {level:g} of {quality!r}, whose range is [{lowest:g}, {highest:g}]: "
                    "correct one of them",
                    parameter.position,
                    rule="level",
                )


def _levels_of_nothing(project: Project, tables: Iterable[Table]) -> Iterator[ModelError]:
    """Yield rows of expected levels, which families may share, that are no variant's."""
    known = {variant.name for variant in project.variants}
    for table in tables:
        for row in table.rows:
            if row.name not in known:
                yield ModelError(
                    f"{row.name!r} is none of the {len(known)} variants: take the row out, or add the variant",
                    row.position,
                    rule="table",
                )


def _two_meanings(project: Project) -> Iterator[ModelError]:
    """Yield names that mean two things: in the ontology they would be one."""
    settings, seen = project.settings, dict[str, str]()
    values = [
        *(f"{variant.name}_{quality}" for variant in project.variants for quality in variant.expected_qas),
        *(f"{name}_{quality}" for name, entry in settings["objectives"].items() for quality in entry.get("nfrs", {})),
    ]
    meanings = {
        "a function": settings["functions"],
        "a quality attribute": settings["quality_attributes"],
        "an objective": settings["objectives"],
        "a component": {*settings["components"], *(component.name for component in project.base.components)},
        "a variant": [variant.name for variant in project.variants],
        "an expected or required level": values,
    }
    for meaning, names in meanings.items():
        for name in names:
            if name in seen:
                yield project.source.error(f"{name!r} names {seen[name]} and {meaning}: rename one")
            seen[name] = meaning
