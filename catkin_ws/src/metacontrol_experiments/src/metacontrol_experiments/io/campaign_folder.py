"""The folder of a campaign: a folder for each run with its result, and the table of all of them.

A run is over when its `result.json` is there: it is written last, under another name, and renamed.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from node_kit.io.input_files import InputFileError, read_text
from node_kit.io.output_files import write_file

from metacontrol_experiments.campaign.matrix import CampaignError
from metacontrol_experiments.campaign.progress import Result, Status, from_json, from_row, row, to_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    import pyarrow

    from metacontrol_experiments.campaign.matrix import Run

RESULT, TABLE, RUNS = "result.json", "results.parquet", "runs"


def read_results(folder: Path, runs: Iterable[Run]) -> tuple[dict[str, Result], tuple[str, ...]]:
    """Return the results that are there, by the run's name, and a line for each that cannot be used."""
    found: dict[str, Result] = {}
    unusable = []
    for run in runs:
        path = folder / RUNS / run.name / RESULT
        if path.exists():
            try:
                found[run.name] = from_json(read_text(path), str(path))
            except (CampaignError, InputFileError) as error:
                unusable.append(str(error))
    return found, tuple(unusable)


def read_table(path: Path) -> pyarrow.Table:
    """Return a table of results as it is.

    Raises:
        CampaignError: it is none.
    """
    import pyarrow  # takes a while to import
    from pyarrow import parquet

    try:
        table = parquet.read_table(path)
        table.validate(full=True)
        table.column_names  # noqa: B018, raises where one is no text
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        problem = " ".join(str(error).split())
        raise CampaignError(f"{path}: is no Parquet table ({problem}); name the {TABLE} of a campaign") from error
    return table


def results_of(path: Path) -> dict[str, Result]:
    """Return the missions of a table that were driven to their end, by the run's name.

    Raises:
        CampaignError: it is no table of a campaign.
    """
    rows = read_table(path).to_pylist()
    results = (from_row(content, f"{path}: row {number}") for number, content in enumerate(rows, start=1))
    return {result.run.name: result for result in results if result.status is Status.DONE}


def write_result(folder: Path, result: Result, files: Mapping[str, bytes] | None = None) -> None:
    """Write what became of a run, with the logs of attempts that failed, and the mission's own files by their names."""
    home = folder / RUNS / result.run.name
    home.mkdir(parents=True, exist_ok=True)
    for number, attempt in enumerate(result.attempts, start=1):
        if attempt.log:
            write_file(home / f"attempt-{number}.log", attempt.log)
    for name, content in (files or {}).items():
        write_file(home / name, content)
    write_file(home / RESULT, to_json(result))


def write_table(folder: Path, runs: Iterable[Run], results: Mapping[str, Result], about: Mapping[str, str]) -> Path:
    """Write the table of results in the order of the runs, and return its path.

    Args:
        folder: of the campaign.
        runs: of the campaign.
        results: those that are there, by the run's name.
        about: the campaign, kept in the table's metadata.
    """
    import pyarrow  # takes a while to import
    from pyarrow import parquet

    path = folder / TABLE
    rows = [row(results[run.name]) for run in runs if run.name in results]
    table = pyarrow.Table.from_pylist(rows).replace_schema_metadata(dict(about))
    content = io.BytesIO()
    parquet.write_table(table, content, compression="zstd")
    write_file(path, content.getvalue())
    return path
