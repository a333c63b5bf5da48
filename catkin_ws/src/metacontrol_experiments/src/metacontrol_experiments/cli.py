"""The command `metacontrol`: run a mission, summarise a bag, draw it."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import click
import rospkg
import yaml
from rich.console import Console

from metacontrol_experiments.bag import BagError, read_record
from metacontrol_experiments.commit import current_commit
from metacontrol_experiments.display import Display
from metacontrol_experiments.metrics import DEFAULT_THRESHOLDS, MetricsError, summarise
from metacontrol_experiments.mission import FAILURE_AT, TIMEOUT_S, Outcome
from metacontrol_experiments.routes import RouteError, read_route
from metacontrol_experiments.runner import BAG_NAME, RunError, run_mission
from metacontrol_experiments.settings import Settings

SUMMARY_NAME = "summary.json"
FIGURE_NAME = "mission.png"

_FAILED, _REFUSED, _INTERRUPTED = 1, 2, 130


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def metacontrol() -> None:
    """Missions of a robot that adapts, and what their bags tell."""


class _Number(click.FloatRange):
    """A finite number within a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return float(number)


@metacontrol.command()
@click.option("--no-metacontrol", is_flag=True, help="The baseline: everything but the reasoner.")
@click.option("--seed", default=1, show_default=True, help="Of everything random in the simulation.")
@click.option("--route", default="r1", show_default=True, help="One of metacontrol_sim's worlds/routes.yaml.")
@click.option("--initial-configuration", default="f2_v2_r2", show_default=True, help="The variant deployed first.")
@click.option("--failure", default="front_laser", show_default=True, help="Component whose node is killed, or none.")
@click.option(
    "--failure-at", type=_Number(0, 1), default=FAILURE_AT, show_default=True, help="Share of the way done at which."
)
@click.option(
    "--power-factor",
    type=_Number(0),
    default=1.0,
    show_default=True,
    help="Of the power load, from the same moment on.",
)
@click.option(
    "--real-time-factor",
    type=_Number(0),
    default=1.0,
    show_default=True,
    help="Simulated per wall second; 0: as fast as it can.",
)
@click.option(
    "--timeout", type=_Number(0, min_open=True), default=TIMEOUT_S, show_default=True, help="Simulated seconds."
)
@click.option(
    "--nfr-safety", type=_Number(0, 1), default=DEFAULT_THRESHOLDS["safety"], show_default=True, help="Required level."
)
@click.option(
    "--nfr-energy", type=_Number(0, 1), default=DEFAULT_THRESHOLDS["energy"], show_default=True, help="Required level."
)
@click.option(
    "--output", type=click.Path(file_okay=False, path_type=Path), default=Path("results/mission"), show_default=True
)
@click.option("--port", type=click.IntRange(1, 65535), help="Of the run's own ROS master; a free one by default.")
@click.option("--gui", is_flag=True, help="Show the simulator's window.")
@click.option("--rviz", is_flag=True, help="Show RViz.")
@click.option("--quiet", is_flag=True, help="Say nothing but errors.")
def run(quiet: bool, output: Path, **options: Any) -> None:
    """Run a mission and leave its bag, summary and figure in a folder.

    Exit status: 0 the goal was reached, 1 it was not, 2 bad input or a system that did not start, 130 interrupted.
    """
    console = Console(highlight=False)
    try:
        settings = _settings(output, options)
        for name in (SUMMARY_NAME, FIGURE_NAME):  # those of an earlier run
            (output / name).unlink(missing_ok=True)
        with Display(console, quiet) as display:
            state = run_mission(settings, display)
        record = read_record(output / BAG_NAME)
        summary = summarise(record)
        _write_summary(summary, output / SUMMARY_NAME)
        _draw(record, output / FIGURE_NAME)
    except (RunError, RouteError, BagError, MetricsError, OSError) as error:
        _refuse(error)
    except KeyboardInterrupt:
        click.echo("metacontrol: interrupted; every process was ended", err=True)
        sys.exit(_INTERRUPTED)
    display.summary(summary)
    for name in (BAG_NAME, SUMMARY_NAME, FIGURE_NAME):
        display.say(str(output / name))
    sys.exit(0 if state.outcome is Outcome.REACHED else _FAILED)


@metacontrol.command("summary")
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to a file instead.")
def summary_command(bag: Path, output: Path | None) -> None:
    """Print the summary of a mission's BAG as JSON."""
    try:
        summary = summarise(read_record(bag))
        if output:
            _write_summary(summary, output)
            return
    except (BagError, MetricsError, OSError) as error:
        _refuse(error)
    click.echo(json.dumps(summary, indent=2))


@metacontrol.command("figure")
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Beside the bag by default.")
def figure_command(bag: Path, output: Path | None) -> None:
    """Draw the map, the path and the quality series of a mission's BAG."""
    target = output or bag.with_name(FIGURE_NAME)
    try:
        _draw(read_record(bag), target)
    except (BagError, MetricsError, OSError) as error:
        _refuse(error)
    click.echo(target)


def main() -> None:
    """Runs the command."""
    metacontrol(prog_name="metacontrol")


def _settings(output: Path, options: dict[str, Any]) -> Settings:
    """The mission that the options ask for.

    Raises:
        RunError: metacontrol_sim is missing, or has no such configuration or component.
        RouteError: there is no such route.
    """
    try:
        simulation = Path(rospkg.RosPack().get_path("metacontrol_sim"))
    except rospkg.ResourceNotFound as error:
        raise RunError("package metacontrol_sim not found; source the workspace's devel/setup.bash first") from error
    name = options["initial_configuration"]
    variants = sorted(path.stem for path in (simulation / "launch" / "variants").glob("*.launch"))
    if name not in variants:
        known = ", ".join(variants) or "none generated yet"
        raise RunError(f"--initial-configuration: no configuration {name!r}; there are {known}")
    failure = None if options["failure"] == "none" else options["failure"]
    return Settings(
        route=read_route(simulation / "worlds" / "routes.yaml", options["route"]),
        output=output,
        metacontrol=not options["no_metacontrol"],
        seed=options["seed"],
        initial_configuration=name,
        failure=failure,
        failure_node=_node_of(failure, simulation / "models" / "metacontrol.yaml") if failure else "",
        power_factor=options["power_factor"],
        failure_at=options["failure_at"],
        real_time_factor=options["real_time_factor"],
        timeout_s=options["timeout"],
        thresholds={"safety": options["nfr_safety"], "energy": options["nfr_energy"]},
        gui=options["gui"],
        rviz=options["rviz"],
        port=options["port"],
        commit=current_commit(),
    )


def _node_of(component: str, path: Path) -> str:
    """The node behind a component, as the project's metacontrol.yaml maps it.

    Raises:
        RunError: the file cannot be read or maps no such component to a node.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise RunError(f"{path}: cannot be read as YAML: {' '.join(str(error).split())}") from error
    components = content.get("components") if isinstance(content, dict) else None
    nodes = {
        name: entry["node"]
        for name, entry in (components.items() if isinstance(components, dict) else ())
        if isinstance(entry, dict) and "node" in entry
    }
    if component not in nodes:
        raise RunError(
            f"--failure: {path} maps no component {component!r} to a node; there are {', '.join(nodes)}, none"
        )
    return str(nodes[component])


def _write_summary(summary: dict[str, Any], path: Path) -> None:
    path.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")


def _draw(record: Any, path: Path) -> None:
    from metacontrol_experiments.figure import draw  # matplotlib takes a while to import

    draw(record, path)


def _refuse(error: Exception) -> None:
    click.echo(f"metacontrol: {' '.join(str(error).split())}", err=True)
    sys.exit(_REFUSED)
