"""The command `metacontrol campaign` for a file of missions of D1."""

from __future__ import annotations

import csv
import io
import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from node_kit.io.input_files import InputFileError, read_text
from node_kit.io.output_files import write_file

from metacontrol_experiments.campaign.matrix import CampaignError, refuse_unusable
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.io.campaign_folder import RUNS
from metacontrol_experiments.io.campaign_on_ros import drive_command
from metacontrol_experiments.io.display import tell
from metacontrol_experiments.managers.manager import MROS
from metacontrol_experiments.mission.settings import BAG_NAME, SUMMARY_NAME
from metacontrol_experiments.pyramid.campaign import PyramidRun, levels, parse_pyramids, read_summary, report, rows

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

REPORT, TABLE, LEVELS = "report.md", "missions.csv", "qa.csv"
_DEADLINE_S = 1200.0
"""Wall s for a mission: a simulated second may take two."""
_TRIES = 2


def drive_pyramids(content: Any, file: Path, folder: Path) -> bool:
    """Drive the missions that a file asks for and that the folder lacks; return whether all were driven.

    Of each mission, summary, figure and logs are kept; the bag, too, where the meta-controller had no success, or a
    block that was in place was lost. Where designs built without disturbance, their measured levels are in qa.csv.

    Args:
        content: of the file.
        file: its path.
        folder: of the campaign.

    Raises:
        CampaignError: the file makes no sense, or a summary in the folder can't be used.
    """
    runs = parse_pyramids(content, str(file))
    missing = [run for run in runs if not _summary(folder, run).exists()]
    _, unusable = _read(folder, runs)
    try:
        refuse_unusable(unusable)
        for number, run in enumerate(missing, start=1):
            tell(f"{number} of {len(missing)}: {run.name}: {_drive(folder, run)}")
    finally:
        driven, unusable = _read(folder, runs)
        if driven:
            write_file(folder / REPORT, report(driven))
            _write(folder / TABLE, rows(driven))
            _write(folder / LEVELS, levels(driven))
    refuse_unusable(unusable)
    tell(f"{len(driven)} of {len(runs)} missions are in {folder / REPORT}")
    if any((folder / RUNS).glob(f"*/{BAG_NAME}")):
        tell(f"the bags that were kept, as a page: metacontrol view {shlex.quote(str(folder / RUNS))}")
    return len(driven) == len(runs)


def _write(path: Path, table: Sequence[Mapping[str, Any]]) -> None:
    """Write a table with rows; write none without."""
    if table:
        text = io.StringIO()
        writer = csv.DictWriter(text, list(table[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
        write_file(path, text.getvalue())


def _summary(folder: Path, run: PyramidRun) -> Path:
    return folder / RUNS / run.name / SUMMARY_NAME


def _drive(folder: Path, run: PyramidRun) -> str:
    """Drive a mission, once more where it did not come to an end; return in words what became of it."""
    output = folder / RUNS / run.name
    program = [sys.executable, "-m", "metacontrol_experiments.cli.main", "run", "--quiet"]
    for _ in range(_TRIES):
        began = time.monotonic()
        attempt, summary = drive_command([*program, *run.arguments, "--output", str(output)], output, _DEADLINE_S)
        if attempt.status is Status.DONE:
            if (summary["success"] and not summary["placed_lost"]) or run.manager != MROS:
                (output / BAG_NAME).unlink(missing_ok=True)
            outcome = "success" if summary["success"] else f"no success: {summary['reason']}"
            return f"{outcome} ({summary['duration_s']:.0f} s, {time.monotonic() - began:.0f} s of wall time)"
        _summary(folder, run).unlink(missing_ok=True)
    return attempt.problem


def _read(folder: Path, runs: Iterable[PyramidRun]) -> tuple[dict[PyramidRun, dict[str, Any]], tuple[str, ...]]:
    """Return the summaries that are there, and a line for each that can't be used."""
    found: dict[PyramidRun, dict[str, Any]] = {}
    unusable = []
    for run in runs:
        path = _summary(folder, run)
        if path.exists():
            try:
                found[run] = read_summary(read_text(path), str(path))
            except (CampaignError, InputFileError) as error:
                unusable.append(str(error))
    return found, tuple(unusable)
