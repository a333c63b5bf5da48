"""Tables as CSV files: delays, the runs of a calibration, measured levels."""

from __future__ import annotations

import csv
import io
import math
import os
from collections import defaultdict
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING

import rospkg
from node_kit.io.input_files import InputFileError, read_text
from node_kit.io.output_files import write_file

from metacontrol_experiments.campaign.calibration import QUALITIES, CalibrationError, Run, measure
from metacontrol_experiments.lockstep.delays import KINDS, DelayError, Delays

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from metacontrol_experiments.campaign.bag_levels import BagLevels, Measured

_COLUMNS = tuple(field.name for field in fields(Run))


def read_delays(path: Path | None = None) -> Delays:
    """Read a file of delays, by default the one of this package. A line is which delay, seconds.

    Raises:
        DelayError: it cannot be read, or a kind has no sample.
    """
    path = path or Path(rospkg.RosPack().get_path("metacontrol_experiments")) / "config" / "delays.csv"
    samples: defaultdict[str, list[float]] = defaultdict(list)
    try:
        for row in csv.DictReader(io.StringIO(read_text(path), newline="")):
            samples[row["delay"]].append(float(row["seconds"]))
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise DelayError(f"{path}: no table of delay and seconds ({error}); make one by: metacontrol delays") from error
    lacking = [kind for kind in KINDS if not samples[kind]]
    if lacking or not all(math.isfinite(value) and value >= 0.0 for values in samples.values() for value in values):
        raise DelayError(f"{path}: times below 0, or none of {', '.join(lacking)}; make it anew by: metacontrol delays")
    return Delays(samples)


def write_delays(path: Path, found: Iterable[tuple[str, float]]) -> None:
    """Write a file of delays, in the order of kind and time."""
    in_order = sorted(found, key=lambda d: (KINDS.index(d[0]), d[1]))
    _write(path, ["delay", "seconds"], ((kind, f"{value:.4f}") for kind, value in in_order))


def read_runs(path: Path) -> list[Run]:
    """Read a file of runs; a last line that was cut off by an interruption is left out.

    Raises:
        CalibrationError: it is no such file.
    """
    if not os.path.lexists(path):
        return []
    try:
        text = read_text(path)
    except InputFileError as error:
        raise CalibrationError(str(error)) from error
    whole = text[: text.rfind("\n") + 1]
    rows = csv.DictReader(whole.splitlines())
    try:
        if whole and tuple(rows.fieldnames or ()) != _COLUMNS:
            raise CalibrationError(f"{path}: its columns are not {', '.join(_COLUMNS)}; name another file of runs")
        return [_run(row) for row in rows]
    except (TypeError, ValueError, KeyError, csv.Error) as error:
        raise CalibrationError(f"{path}: line {rows.line_num} is no run ({error}); take it out") from error


def append_runs(path: Path, runs: Iterable[Run]) -> Iterator[Run]:
    """Append each run to a file at once, and yield it, so that an interrupted calibration can continue."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    write_file(path, text[: text.rfind("\n") + 1])
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if not file.tell():
            writer.writerow(_COLUMNS)
        file.flush()
        for run in runs:
            writer.writerow(asdict(run).values())
            file.flush()
            yield run


def write_levels(path: Path, runs: Sequence[Run]) -> None:
    """Write the expected levels of all variants, with their spread, as `rosmodel generate all` reads them."""
    seeds = sorted({run.seed for run in runs})
    spreads = [f"{name}_spread" for name in QUALITIES]
    rows = []
    for variant, levels in measure(runs).items():
        own = [run for run in runs if run.variant == variant]
        values = [f"{levels[name].value:.3f}" for name in QUALITIES]
        deviations = [f"{levels[name].spread:.3f}" for name in QUALITIES]
        rows.append([variant, *values, "measured", *deviations, len(own), f"{seeds[0]}-{seeds[-1]}"])
    _write(path, ["name", *QUALITIES, "source", *spreads, "missions", "seeds"], rows)


def write_bag_levels(
    path: Path, expected: Mapping[str, Mapping[str, float]], measured: Mapping[str, Mapping[str, Measured]]
) -> None:
    """Write the expected levels of all variants, as `rosmodel generate all` reads them.

    Args:
        path: of the file.
        expected: variant -> quality -> level of the project, which stays where nothing was measured.
        measured: variant -> quality -> what bags tell.
    """
    qualities = dict.fromkeys(quality for own in (*expected.values(), *measured.values()) for quality in own)
    rows = []
    for variant, known in expected.items():
        own = measured.get(variant, {})
        levels = {**known, **{quality: found.level.value for quality, found in own.items()}}
        bags = max((found.estimate.count for found in own.values()), default=0)
        rows.append(
            [
                variant,
                *(f"{levels[quality]:.3f}" if quality in levels else "" for quality in qualities),
                "measured" if own else "kept",
                *(f"{own[quality].level.spread:.3f}" if quality in own else "" for quality in qualities),
                bags or "",
            ]
        )
    header = ["name", *qualities, "source", *(f"{name}_spread" for name in qualities), "missions"]
    _write(path, header, rows)


def write_bag_intervals(path: Path, measured: Mapping[str, Mapping[str, Measured]], found: Sequence[BagLevels]) -> None:
    """Write the measured levels with their intervals: a line for each variant and quality.

    Args:
        path: of the file.
        measured: variant -> quality -> what bags tell.
        found: what single bags tell.
    """
    rows = []
    for variant, own in measured.items():
        for quality, level in own.items():
            seconds = sum(e.seconds for e in found if e.configuration == variant and quality in e.levels)
            ends = ("" if end is None else f"{end:.4f}" for end in (level.estimate.low, level.estimate.high))
            rows.append(
                [variant, quality, f"{level.estimate.value:.4f}", *ends, level.estimate.count, f"{seconds:.1f}"]
            )
    _write(path, ["name", "quality", "level", "low", "high", "bags", "seconds"], rows)


def _write(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    write_file(path, text.getvalue())


def _run(row: dict[str, str]) -> Run:
    """Return a line's run.

    Raises:
        TypeError, ValueError, KeyError: it is none.
    """
    kinds = {"str": str, "int": int, "float": float}
    return Run(**{field.name: kinds[str(field.type)](row[field.name]) for field in fields(Run)})
