"""The command `metacontrol run --mission manipulation`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from metacontrol_bags.bag_file import BagError
from metacontrol_bags.metrics import MetricsError
from rich.table import Table

from metacontrol_experiments.cli.figure import draw_pyramid_figure
from metacontrol_experiments.cli.missions import mission_option
from metacontrol_experiments.cli.options import MAPPING, run_options
from metacontrol_experiments.cli.summary import write_summary
from metacontrol_experiments.io.code_version import current_commit
from metacontrol_experiments.io.display import Display, reconfigurations_table, refusing
from metacontrol_experiments.io.processes import ProcessTree, RunError
from metacontrol_experiments.mission.settings import BAG_NAME, FIGURE_NAME, SUMMARY_NAME
from metacontrol_experiments.pyramid.record import read_pyramid
from metacontrol_experiments.pyramid.scenarios import TITLES
from metacontrol_experiments.pyramid.settings import PyramidSettings
from metacontrol_experiments.pyramid.summary import summarise_pyramid
from metacontrol_experiments.ros.runner import run_mission

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_experiments.ros.pyramid_mission import PyramidMission

_FAILED = 1
"""Exit status of a mission that did not do what it was to do."""


@click.command()
@click.option(
    "--scenario",
    type=click.IntRange(min(TITLES), max(TITLES)),
    default=2,
    show_default=True,
    help="; ".join(f"{number}: {title}" for number, title in TITLES.items()) + ".",
)
@click.option("--no-metacontrol", is_flag=True, help="The baseline: everything but the reasoner.")
@click.option(
    "--seed", type=click.IntRange(0), default=1, show_default=True, help="Of places, moments, levels and all noise."
)
@click.option(
    "--parameters", type=MAPPING, default="", help="YAML mapping of parameters of the reasoner, e.g. '{cool_down: 3}'."
)
@click.option(
    "--initial-configuration",
    "configurations",
    default="",
    metavar="NAME,...",
    help="What is deployed at the start, one of each function.  [default: as the scenario has it]",
)
@run_options
def build(quiet: bool, output: Path, no_metacontrol: bool, **options: Any) -> None:
    """Have D1 build its pyramid while a scenario strikes, and leave bag, summary and figure in a folder.

    Exit status: 0 it stands (where no design is left: the robot has stopped safely and says why), 1 it does not, 2 bad
    input, a system that did not start or a bag that is not whole, 130 interrupted.
    """
    with refusing(BagError, MetricsError, RunError):
        settings = PyramidSettings(output, metacontrol=not no_metacontrol, commit=current_commit(), **options)
        with Display(quiet) as display:
            display.say(f"scenario {settings.scenario}: {TITLES[settings.scenario]}")
            run_mission(settings, display, _maker(settings))
            record = read_pyramid(output / BAG_NAME)
        summary = summarise_pyramid(record)
        write_summary(summary, output / SUMMARY_NAME)
        draw_pyramid_figure(record, output / FIGURE_NAME)
    display.show(_figures(summary))
    if summary["reconfigurations"]:
        display.show(reconfigurations_table(summary["reconfigurations"]))
    for name in (BAG_NAME, SUMMARY_NAME, FIGURE_NAME):
        display.say(str(output / name))
    display.say(f"as a page: metacontrol view {shlex.quote(str(output / BAG_NAME))}")
    raise click.exceptions.Exit(0 if summary["success"] else _FAILED)


build.params.insert(0, mission_option())


def _maker(settings: PyramidSettings) -> Callable[[ProcessTree, Display, Callable[[], None]], PyramidMission]:
    def make(tree: ProcessTree, display: Display, check: Callable[[], None]) -> PyramidMission:
        from metacontrol_experiments.ros.pyramid_mission import (
            PyramidMission,  # rospy reads the environment when imported
        )

        return PyramidMission(settings, tree, display, check)

    return make


def _figures(summary: dict[str, Any]) -> Table:
    title = f"Mission {summary['mission']}, scenario {summary['scenario']}, seed {summary['seed']}"
    table = Table(show_header=False, title=title)
    table.add_column("")
    table.add_column("", justify="right")
    rows = [
        ("success", "yes" if summary["success"] else f"no ({summary['reason']})"),
        ("blocks in place", f"{summary['placed']} of 6"),
        ("largest error of a block in place", f"{summary['placed_error_mm']:.1f} mm"),
        ("blocks in place that were lost", str(summary["placed_lost"])),
        ("duration", f"{summary['duration_s']:.1f} s"),
    ]
    for strike in summary["strikes"]:
        after = "" if strike["recover_s"] is None else f", next motion after {strike['recover_s']:.2f} s"
        rows.append((strike["name"], f"at {strike['stamp_s']:.1f} s{after}"))
    rows += [(f"largest force on the {arm} arm", f"{force:.0f} N") for arm, force in summary["force_max_n"].items()]
    rows.append(("simulated / wall time", f"{summary['real_time_factor']:.2f}"))
    for row in rows:
        table.add_row(*row)
    return table
