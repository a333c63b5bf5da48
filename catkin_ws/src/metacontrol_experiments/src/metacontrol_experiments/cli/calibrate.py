"""The command `metacontrol calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from metacontrol_bags.bag import BagError
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from ros_model.errors import ModelError

from metacontrol_experiments.campaign.calibration import CalibrationError, check_alike, missing_runs, plan
from metacontrol_experiments.campaign.definition import DefinitionError, parse_definition
from metacontrol_experiments.cli.options import ground_options
from metacontrol_experiments.io.calibration_runs import drive
from metacontrol_experiments.io.code_version import current_commit
from metacontrol_experiments.io.display import CONSOLE, refusing, tell
from metacontrol_experiments.io.ground_files import read_ground, read_routes, routes_file
from metacontrol_experiments.io.input_files import PackageError, route_names, simulation_package
from metacontrol_experiments.io.tables import append_runs, read_runs, write_levels
from metacontrol_experiments.mission.routes import RouteError

if TYPE_CHECKING:
    from metacontrol_experiments.campaign.calibration import Run

RUNS = Path("results/calibration/runs.csv")

runs_option = click.option(
    "--runs", type=click.Path(dir_okay=False, path_type=Path), default=RUNS, show_default=True, help="File of runs."
)


@click.command()
@click.option("--seeds", type=click.IntRange(1), default=5, show_default=True, help="How many: 1, 2, ...")
@click.option("--route", "only_routes", multiple=True, help="Only this one; any number of times.  [default: all]")
@click.option("--variant", "variants", multiple=True, help="Only this one; any number of times.  [default: all]")
@click.option("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Missions driven side by side.")
@runs_option
@click.option(
    "--levels",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Where the measured levels go, when all variants are measured.  [default: metacontrol_sim/models/qa.csv; of "
    "another world or other routes: qa.csv beside the file of runs]",
)
@click.option(
    "--quantile",
    "quantiles",
    multiple=True,
    metavar="QUALITY=SHARE",
    help="The level that a quality keeps for a share of the time, such as 0.95, or mean; any number of times.",
)
@ground_options
@click.option("--bags", "from_bags", is_flag=True, help="Measure from these bags of a robot, and drive nothing.")
@click.argument("bags", metavar="[BAG...]", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--project",
    type=click.Path(path_type=Path),
    help="Of --bags: metacontrol.yaml or its folder.  [default: that of D2]",
)
@click.option("--initial", default="", metavar="NAME", help="Of --bags: what runs in bags without configurations.")
@click.option("--namespace", default="/", show_default=True, help="Of --bags: of the robot.")
def calibrate(seeds: int, jobs: int, runs: Path, levels: Path | None, **options: Any) -> None:
    """Measure the expected quality levels: drive every variant over routes and seeds, in lockstep.

    A line is added to the file of runs for each mission; what is in it already is not driven again. Then run
    `rosmodel generate all` to take the levels into variants and ontology.

    With --bags, nothing is driven: which variant ran when, and what its levels were, comes from the bags. Exit status 1
    says that a bag could not be used.
    """
    with refusing(BagError, CalibrationError, DefinitionError, ModelError, RouteError, PackageError):
        definition = parse_definition(options["quantiles"])
        if options["from_bags"] or options["bags"]:
            if not (options["from_bags"] and options["bags"]):
                raise CalibrationError("give bags and --bags together, or neither")
            from metacontrol_experiments.cli.calibrate_bags import calibrate_from_bags  # scipy takes a while to import

            asked = {name: options[name] for name in ("project", "initial", "namespace")}
            raise click.exceptions.Exit(calibrate_from_bags(options["bags"], definition, **asked, levels=levels))
        package = simulation_package()
        known = sorted(path.stem for path in (package / "models" / "variants").glob("*.rossystem"))
        ground = read_ground(options["world"], options["routes"])
        variants = _chosen("--variant", options["variants"], known)
        routes = _chosen("--route", options["only_routes"], route_names(routes_file(ground)))
        read_routes(ground, routes)
        done = read_runs(runs)
        check_alike(done, ground.mark, definition, str(runs))
        driven = {run.job for run in done}
        missing = [job for job in plan(variants, routes, seeds) if job not in driven]
        with _progress() as bar:
            task = bar.add_task("missions", total=len(missing))
            for run in append_runs(runs, drive(missing, ground, definition, current_commit(), jobs)):
                done.append(run)
                bar.update(task, advance=1, description=f"{run.variant} {run.route} seed {run.seed}: {run.outcome}")
        _tell_runs(done, len(missing), runs)
        lacking = missing_runs(done, known)
        if lacking:
            first = ", ".join(map(str, lacking[:3]))
            tell(f"no levels written: {len(lacking)} missions are missing, {first} ...")
            return
        target = levels or (runs.with_name("qa.csv") if ground.mark else package / "models" / "qa.csv")
        write_levels(target, done)
    tell(f"measured levels are in {target}" + ("" if ground.mark else "; now: rosmodel generate all"))


def _chosen(option: str, asked: tuple[str, ...], known: list[str]) -> list[str]:
    """Return what was asked for, all without any.

    Raises:
        CalibrationError: something of it is not there.
    """
    for name in asked:
        if name not in known:
            raise CalibrationError(f"{option}: no {name!r}; there are {', '.join(known)}")
    return list(asked) or known


def _progress() -> Progress:
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    return Progress(*columns, console=CONSOLE)


def _tell_runs(done: list[Run], driven: int, path: Path) -> None:
    bad = [run for run in done if not run.reached or run.collisions]
    tell(f"{driven} missions driven, {len(done)} in {path}, {len(bad)} of them without success or with a collision")
    for run in bad[:10]:
        tell(f"  {run.job}: {run.outcome}, {run.collisions} collisions")
    if len({run.commit for run in done}) > 1:
        tell(f"{path} holds runs of different commits: delete it to measure one", "yellow")
