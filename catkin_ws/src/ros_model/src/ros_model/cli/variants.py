"""`rosmodel variants`: a family of systems from a base and a table."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ros_model.errors import ModelError
from ros_model.generators import write_files
from ros_model.generators.family import origin
from ros_model.io.models import read_system
from ros_model.io.project import library_beside, locate, read_settings, read_table
from ros_model.language.remappings import with_header
from ros_model.language.system_writer import write_system
from ros_model.project.columns import Columns, parse_columns
from ros_model.project.schema_check import dotted, load_schema, violations
from ros_model.project.settings import FILE_NAME
from ros_model.project.variants import make_systems

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.language.metamodel import RosSystem

_SYSTEM, _TABLE = ".rossystem", ".csv"
_SET = re.compile(r"(?P<column>[^=]+)=(?:(?P<component>[^:*=]+):)?(?P<name>[^:*=]+)(?:\*(?P<factor>[-+0-9.eE]+))?")
_CONNECT = re.compile(r"(?P<column>[^:=]+):(?P<value>[^=]*)=(?P<source>[^>]*?)(?:->(?P<target>.+))?")
_PAIR = re.compile(r"(?P<column>[^=]+)=(?P<name>.+)")


@click.command()
@click.argument("base", metavar="BASE|MODELS")
@click.argument("table", required=False)
@click.option("-o", "--output", metavar="FOLDER", help="Where to write NAME.rossystem; default: variants/ by the base.")
@click.option("--qa", metavar="FILE", help="Table of expected levels: a column for each quality attribute.")
@click.option("--component", metavar="NAME", help="The component that varies.")
@click.option(
    "--set",
    "sets",
    multiple=True,
    metavar="COLUMN=[COMPONENT:]PARAMETER[*FACTOR]",
    help="The column sets the parameter.",
)
@click.option(
    "--connect",
    "connects",
    multiple=True,
    metavar="COLUMN:VALUE=[COMPONENT.PORT[->COMPONENT.PORT]]",
    help="The value of the column connects a publisher or server; nothing after = connects none.",
)
@click.option(
    "--present", "presents", multiple=True, metavar="COLUMN=COMPONENT", help="The component is there where it is true."
)
@click.option("--expect", "expects", multiple=True, metavar="COLUMN=QA", help="The column is an expected level.")
@click.option("--ignore", "ignores", multiple=True, metavar="COLUMN", help="The column sets nothing.")
@click.option("--whole", is_flag=True, help="Write whole systems, not only what each variant brings.")
def variants(
    base: str,
    table: str | None,
    output: str | None,
    qa: str | None,
    component: str | None,
    sets: tuple[str, ...],
    connects: tuple[str, ...],
    presents: tuple[str, ...],
    expects: tuple[str, ...],
    ignores: tuple[str, ...],
    whole: bool,
) -> None:
    """Make a family of .rossystem files from a base and a TABLE (.csv or .yaml), one row a variant.

    BASE is a .rossystem file; the options say what the columns set. A column may also name its parameter itself,
    COMPONENT.PARAMETER, or be a level, qa_NAME. In place of BASE, the folder of a metacontrol.yaml, whose sections
    base and variants say all of that.

    \b
    rosmodel variants base.rossystem table.csv -o variants --component move_base \\
        --set 'max_vel=TrajectoryPlannerROS/max_vel_x' --set 'max_vel=TrajectoryPlannerROS/acc_lim_x*12' \\
        --connect sensor:scan=front_laser.scan --connect sensor:cloud=camera.points
    """  # noqa: D301
    options: dict[str, Any] = _section(component, sets, connects, presents, expects, ignores)
    if not base.endswith(_SYSTEM):
        if base.endswith(_TABLE):
            raise click.UsageError(
                f"{base} is a table: give the base .rossystem before it, or the folder of {FILE_NAME}"
            )
        if options:
            raise click.UsageError(f"metacontrol.yaml says what columns set: take out --{next(iter(options))}")
        found, default, header = _from_project(Path(base), table, qa)
    else:
        if table is None:
            raise click.UsageError("Missing argument 'TABLE'.")
        found = _make(read_system(base), _checked(options, base), Path(table), Path(qa) if qa else None)
        default, header = Path(base).parent / "variants", origin(Path(base).name, [Path(table).name])
    folder = Path(output) if output else default
    systems = [(complete if whole else part) for complete, part in found]
    texts = {
        folder / f"{system.name}{_SYSTEM}": write_system(with_header(system, header, system)) for system in systems
    }
    written = write_files(texts, folder)
    click.echo(f"variants: {len(written)} file{'s' * (len(written) != 1)} in {folder}")


Pairs = list[tuple["RosSystem", "RosSystem"]]


def _make(base: RosSystem, columns: Columns, table: Path, qa: Path | None, models: Path | None = None) -> Pairs:
    library = library_beside(models) if models and columns.nodes else None
    return list(make_systems(base, columns, read_table(table), read_table(qa) if qa else None, library))


def _from_project(path: Path, table: str | None, qa: str | None) -> tuple[Pairs, Path, str]:
    """Return the systems of all tables of a metacontrol.yaml, of which other sections may be missing."""
    settings = read_settings(locate(path), ("base", "variants"))
    base = read_system(settings.inside("base"))
    found: Pairs = []
    tables = []
    families = [(keys, family) for keys, family in settings.families if "table" in family or table]
    if not families:
        raise settings.error("names no table: give one as TABLE", "variants")
    if table and len(families) > 1:
        raise settings.error("has several families: name their tables there, not as TABLE", "variants")
    for keys, family in families:
        chosen = Path(table) if table else settings.inside(*keys, "table")
        levels = Path(qa) if qa else settings.inside(*keys, "qa") if "qa" in family else None
        found += _make(base, parse_columns(family, settings.within(keys)), chosen, levels, settings.path.parent)
        tables.append(table or family["table"])
    return found, settings.path.parent / "variants", origin(settings.content["base"], tables)


def _checked(section: dict[str, Any], base: str) -> Columns:
    """Return what the options say of columns, checked as the section of metacontrol.yaml is."""
    schema = load_schema("metacontrol")
    for violation in violations(section, {**schema["$defs"]["family"], "$defs": schema["$defs"]}):
        raise ModelError(f"{base}: option {dotted(violation.keys)}: {violation.message}")
    return parse_columns(section)


def _section(
    component: str | None,
    sets: Iterable[str],
    connects: Iterable[str],
    presents: Iterable[str],
    expects: Iterable[str],
    ignores: Iterable[str],
) -> dict[str, Any]:
    """Return the options as a family of metacontrol.yaml has them."""
    section: dict[str, Any] = {"component": component} if component else {}
    for text in sets:
        match = _matched(_SET, text, "--set", "COLUMN=[COMPONENT:]PARAMETER[*FACTOR]")
        entry: dict[str, Any] = {"name": match["name"]}
        if match["component"]:
            entry["component"] = match["component"]
        if match["factor"]:
            entry["factor"] = _number(match["factor"], text)
        section.setdefault("parameters", {}).setdefault(match["column"], []).append(entry)
    for text in connects:
        match = _matched(_CONNECT, text, "--connect", "COLUMN:VALUE=[COMPONENT.PORT[->COMPONENT.PORT]]")
        choices = section.setdefault("connections", {}).setdefault(match["column"], {})
        wires = choices.setdefault(match["value"], [])
        if match["source"]:
            source, target = match["source"], match["target"]
            wires.append({"from": source, "to": target} if target else source)
    for option, key, texts in (("--present", "components", presents), ("--expect", "expected", expects)):
        for text in texts:
            match = _matched(_PAIR, text, option, "COLUMN=NAME")
            columns = section.setdefault(key, {})
            if key == "expected":
                columns[match["column"]] = match["name"]
            else:
                columns.setdefault(match["column"], []).append(match["name"])
    if ignores := list(ignores):
        section["ignore"] = ignores
    return section


def _matched(pattern: re.Pattern[str], text: str, option: str, form: str) -> re.Match[str]:
    match = pattern.fullmatch(text)
    if not match:
        raise click.UsageError(f"{option} {text!r} is not {form}")
    return match


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise click.UsageError(f"--set {option!r}: {text!r} is no number") from None
