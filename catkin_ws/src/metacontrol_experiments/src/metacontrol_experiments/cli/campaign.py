"""The command `metacontrol campaign`."""

from __future__ import annotations

import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from mros1_reasoner.loop.settings import setting_names
from node_kit.io.input_files import InputFileError, read_text, read_yaml
from node_kit.plugins import find
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

from metacontrol_experiments.campaign.matrix import (
    CampaignError,
    Known,
    ground_files,
    parse_campaign,
    refuse_unusable,
)
from metacontrol_experiments.campaign.progress import Status, check_same, remaining
from metacontrol_experiments.cli.options import ground_options
from metacontrol_experiments.cli.pyramid_campaign import drive_pyramids
from metacontrol_experiments.io.campaign_folder import RUNS, read_results, results_of, write_result, write_table
from metacontrol_experiments.io.code_version import current_commit
from metacontrol_experiments.io.display import CONSOLE, refusing, tell
from metacontrol_experiments.io.ground_files import read_ground, read_routes, routes_file
from metacontrol_experiments.io.input_files import PackageError, read_components, route_names, simulation_package
from metacontrol_experiments.io.processes import RunError, alone_in, signals_as_interrupts
from metacontrol_experiments.managers.manager import PACKAGE
from metacontrol_experiments.mission.routes import RouteError
from metacontrol_experiments.mission.settings import BAG_NAME, ENGINES
from metacontrol_experiments.pyramid.campaign import asks_for_pyramids

if TYPE_CHECKING:
    from rich.progress import Task

    from metacontrol_experiments.campaign.matrix import Campaign, Run
    from metacontrol_experiments.campaign.progress import Result

_FAILED = 1
"""Exit status of a campaign with runs that crashed or hung."""


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of the runs and their table.  [default: results/campaign/ and the name of FILE]",
)
@click.option(
    "--from",
    "tables",
    multiple=True,
    metavar="TABLE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="A results.parquet whose missions are not driven again, such as one of another machine. May be repeated.",
)
@click.option("--engine", type=click.Choice(ENGINES), help="What drives, in place of what FILE names.")
@click.option("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Worker processes on this machine.")
@click.option("--scheduler", metavar="ADDRESS", help="Drive by the workers of this scheduler of Dask instead.")
@ground_options
def campaign(
    file: Path,
    output: Path | None,
    tables: tuple[Path, ...],
    engine: str | None,
    jobs: int,
    scheduler: str | None,
    **ground: Path | None,
) -> None:
    """Drive the missions that a FILE asks for, and leave a table of their results.

    For a FILE of missions of D1 (mission: manipulation), --output is the only option that counts.

    What is there already is not driven again: after an interruption, the same command goes on. --world and --routes
    take the place of what FILE names.

    Exit status: 0 all missions were driven, 1 some crashed or hung twice, 2 bad input, 130 interrupted.
    """
    with refusing(CampaignError, PackageError, RouteError, RunError):
        content = _content(file)
        folder = output or Path("results/campaign") / file.stem
        if asks_for_pyramids(content):
            folder.mkdir(parents=True, exist_ok=True)
            with alone_in(folder), signals_as_interrupts():
                is_complete = drive_pyramids(content, file, folder)
            raise click.exceptions.Exit(0 if is_complete else _FAILED)
        asked = _read(content, file, engine, ground)
        folder.mkdir(parents=True, exist_ok=True)
        with alone_in(folder), signals_as_interrupts():
            results, unusable = _known(asked, folder, tables)
            missing = remaining(asked.runs, results)
            try:
                refuse_unusable(unusable)
                _drive(asked, missing, results, folder, jobs, scheduler)
            finally:
                about = {"campaign": read_text(file), "commit": current_commit()}
                table = write_table(folder, asked.runs, results, about) if results else None
        _tell(asked, results, len(missing), table, folder)
    raise click.exceptions.Exit(0 if all(result.status is Status.DONE for result in results.values()) else _FAILED)


def _content(file: Path) -> Any:
    """Return the content of a campaign's file.

    Raises:
        CampaignError: it cannot be read.
    """
    try:
        return read_yaml(file)
    except InputFileError as error:
        raise CampaignError(str(error)) from error


def _read(content: Any, file: Path, engine: str | None, given: dict[str, Path | None]) -> Campaign:
    """Return the campaign of a file.

    Args:
        content: of the file.
        file: of the campaign.
        engine: takes the place of what the file names.
        given: files of `world` and `routes` that take the place of those that it names.

    Raises:
        CampaignError: it makes no sense.
        RouteError: a world or a route of it cannot be used.
    """
    package = simulation_package()
    named = [None if name is None else file.parent / name for name in ground_files(content, str(file))]
    files = [given[option] or path for option, path in zip(("world", "routes"), named, strict=True)]
    ground = read_ground(*(path and path.absolute() for path in files))
    known = Known(
        routes=route_names(routes_file(ground)),
        configurations=sorted(path.stem for path in (package / "launch" / "variants").glob("*.launch")),
        managers=sorted(find(PACKAGE, "manager")),
        components=list(read_components(package / "models" / "metacontrol.yaml")),
        parameters=setting_names(),
        ground=ground,
    )
    asked = parse_campaign(content, known, str(file), engine)
    read_routes(ground, dict.fromkeys(run.route for run in asked.runs))
    return asked


def _known(asked: Campaign, folder: Path, tables: tuple[Path, ...]) -> tuple[dict[str, Result], tuple[str, ...]]:
    """Return the results that are there, by the run's name: those of the folder, then those of other tables.

    Returns:
        The results, and a line for each in the folder that cannot be used.

    Raises:
        CampaignError: one is that of another mission, or one of another table cannot be used.
    """
    wanted = {run.name for run in asked.runs}
    found: dict[str, Result] = {}
    for table in tables:
        taken = {name: result for name, result in results_of(table).items() if name in wanted}
        check_same(asked.runs, taken, str(table), "leave out --from")
        found = {**taken, **found}
    own, unusable = read_results(folder, asked.runs)
    check_same(asked.runs, own, str(folder / RUNS), "name another folder by --output, or delete it")
    return {**found, **own}, unusable


def _drive(
    asked: Campaign, missing: list[Run], results: dict[str, Result], folder: Path, jobs: int, scheduler: str | None
) -> None:
    """Drive what is missing, and add its results."""
    if not missing:
        return
    from metacontrol_experiments.io.campaign_cluster import drive_all  # Dask takes a while to import

    with _progress() as bar:
        task = bar.add_task("starting", total=len(missing), began=time.monotonic())
        for result, files in drive_all(asked, missing, jobs=jobs, scheduler=scheduler):
            write_result(folder, result, files)
            results[result.run.name] = result
            ended = result.summary["outcome"] if result.summary else result.status.value
            bar.update(task, advance=1, description=f"{result.run.name}: {ended}")


class _RateColumn(ProgressColumn):
    """Missions per hour since the start."""

    def render(self, task: Task) -> Text:
        passed = time.monotonic() - task.fields["began"]
        return Text(f"{task.completed / passed * 3600:.0f}/h" if task.completed else "-/h")


def _progress() -> Progress:
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        _RateColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
        TextColumn("{task.description}"),
    )
    return Progress(*columns, console=CONSOLE, speed_estimate_period=600.0)


def _tell(asked: Campaign, results: dict[str, Result], driven: int, table: Path | None, folder: Path) -> None:
    if any((folder / RUNS).glob(f"**/{BAG_NAME}")):
        tell(f"the missions with a bag, as pages: metacontrol view {shlex.quote(str(folder / RUNS))}")
    bad = [result for result in results.values() if result.status is not Status.DONE]
    tell(f"{driven} missions driven, {len(results)} of {len(asked.runs)} in {table}")
    for result in bad[:10]:
        tell(f"  {result.run.name} {result.status.value}: {result.attempts[-1].problem}", "red")
    if bad:
        tell(f"{len(bad)} missions failed; delete their folders in {folder / RUNS} to drive them again", "yellow")
    if len({result.provenance.get("commit") for result in results.values()}) > 1:
        tell(f"{folder} holds missions of different commits: name another folder to measure one", "yellow")
