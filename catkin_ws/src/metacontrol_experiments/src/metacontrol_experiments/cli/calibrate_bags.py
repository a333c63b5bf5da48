"""`metacontrol calibrate --bags`: expected levels from bags of real robots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from metacontrol_bags.bag import BagError, salvage
from rich.table import Table
from ros_model.io.project import load_project

from metacontrol_experiments.campaign.bag_levels import BagLevels, levels_of_bag, measure_bags
from metacontrol_experiments.campaign.calibration import CalibrationError
from metacontrol_experiments.io.display import CONSOLE, tell
from metacontrol_experiments.io.input_files import simulation_package
from metacontrol_experiments.io.tables import write_bag_intervals, write_bag_levels

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ros_model.language.metamodel import RosSystem

    from metacontrol_experiments.campaign.bag_levels import Measured
    from metacontrol_experiments.campaign.definition import Definition

_TOPICS = ("/diagnostics", "/rosgraph_manipulator/active_configuration", "/mission/event")
_LEFT_OUT = 1
"""Exit status where a bag could not be used."""
_NAMED = 4
"""Names that a line lists."""


def calibrate_from_bags(
    bags: Sequence[Path],
    definition: Definition,
    *,
    project: Path | None,
    initial: str,
    namespace: str,
    levels: Path | None,
) -> int:
    """Measure the levels of a project's variants from bags, write them, and return the exit status.

    Args:
        bags: paths.
        definition: of a level.
        project: metacontrol.yaml or its folder; that of D2 by default.
        initial: configuration that ran all the time in bags that tell of none.
        namespace: of the robot in the bags.
        levels: file of the levels; qa.csv by default. Beside it comes a file of intervals.

    Raises:
        CalibrationError: no bag tells of a variant's levels.
        ModelError: the project cannot be used.
        PackageError: metacontrol_sim is not there.
    """
    models = load_project(project or simulation_package() / "models" / "metacontrol.yaml")
    qualities = models.settings["quality_attributes"]
    higher = {name: entry["direction"] == "higher_is_better" for name, entry in qualities.items()}
    usual = {entry["typical"]: name for name, entry in qualities.items() if "typical" in entry}
    definition = replace(definition, quantiles={**definition.quantiles, **dict.fromkeys(usual, 0.5)})
    expected = {variant.name: _levels_of(variant) for variant in models.variants}
    if initial and initial not in expected:
        raise CalibrationError(f"--initial: no variant {initial!r} in the project; there are {', '.join(expected)}")
    found, unused = _read(bags, definition, higher, initial, namespace, usual)
    foreign = sorted({entry.configuration for entry in found} - expected.keys())
    if foreign:
        tell(f"{_some(foreign)}: no variant of the project: left out", "yellow")
    found = [entry for entry in found if entry.configuration in expected]
    measured = {name: own for name, own in measure_bags(found).items() if own}
    if not measured:
        raise CalibrationError("no bag tells levels of a variant for long enough: nothing is written")
    target = levels or Path("qa.csv")
    intervals = target.with_name(f"{target.stem}_intervals.csv")
    write_bag_levels(target, expected, measured)
    write_bag_intervals(intervals, measured, found)
    _show(measured, found, definition)
    _tell_kept(expected, measured)
    tell(f"measured levels are in {target}, their intervals in {intervals}")
    return _LEFT_OUT if unused else 0


def _levels_of(variant: RosSystem) -> dict[str, float]:
    """Return the expected levels that a variant has in the project."""
    values = {p.name.removeprefix("qa_"): p.value for p in variant.parameters if p.name.startswith("qa_")}
    return {name: float(value) for name, value in values.items() if isinstance(value, int | float)}


def _read(
    bags: Sequence[Path],
    definition: Definition,
    higher: Mapping[str, bool],
    initial: str,
    namespace: str,
    usual: Mapping[str, str],
) -> tuple[list[BagLevels], int]:
    """Return what bags tell, and how many of them tell nothing; a line says why."""
    found: list[BagLevels] = []
    unused = 0
    for bag in bags:
        try:
            salvaged = salvage(bag, _TOPICS, namespace)
            found += levels_of_bag(salvaged.record, str(bag), definition, higher, initial, usual)
        except (BagError, CalibrationError, OSError) as error:
            tell(" ".join(str(error).split()), "yellow")
            unused += 1
        else:
            if salvaged.problems:
                tell(f"{bag}: {'; '.join(salvaged.problems)}", "yellow")
    return found, unused


def _show(measured: Mapping[str, Mapping[str, Measured]], found: Sequence[BagLevels], definition: Definition) -> None:
    """Show the levels with their intervals."""
    qualities = sorted({quality for own in measured.values() for quality in own})
    table = Table(title=f"Expected levels ({definition.describe(qualities)}), 95 % interval over bags")
    for title in ("variant", "bags", "s", *qualities):
        table.add_column(title, justify="left" if title == "variant" else "right")
    for name, own in measured.items():
        entries = [entry for entry in found if entry.configuration == name and entry.levels]
        cells = [_cell(own.get(quality)) for quality in qualities]
        table.add_row(name, str(len(entries)), f"{sum(entry.seconds for entry in entries):.0f}", *cells)
    CONSOLE.print(table)


def _cell(measured: Measured | None) -> str:
    if measured is None:
        return "-"
    estimate = measured.estimate
    interval = "" if estimate.low is None else f" ({estimate.low:.3f} to {estimate.high:.3f})"
    return f"{estimate.value:.3f}{interval}"


def _tell_kept(expected: Mapping[str, Mapping[str, float]], measured: Mapping[str, Mapping[str, Measured]]) -> None:
    """Say of what the bags tell nothing: these levels are those of the project."""
    absent = [name for name in expected if name not in measured]
    if absent:
        only = f"only {next(iter(measured))} ran" if len(measured) == 1 else f"{len(measured)} variants ran"
        tell(f"{only}; {_some(absent)} keep their levels: record bags in which they run", "yellow")
    if any(estimate.estimate.low is None for own in measured.values() for estimate in own.values()):
        tell("a variant that ran in one bag only has no interval: record more bags", "yellow")
    seen = {quality for own in measured.values() for quality in own}
    unseen = sorted({quality for own in expected.values() for quality in own} - seen)
    if unseen:
        tell(f"nobody observes {', '.join(unseen)}: levels stay as they are in the project", "yellow")


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more
