"""The command `metacontrol`: a group with a module for each of its commands."""

from __future__ import annotations

import click
from metacontrol_bags.cli.main import bag
from metacontrol_dashboard.cli.view import view

from metacontrol_experiments.cli.calibrate import calibrate
from metacontrol_experiments.cli.campaign import campaign
from metacontrol_experiments.cli.compare import compare
from metacontrol_experiments.cli.delays import delays
from metacontrol_experiments.cli.figure import figure
from metacontrol_experiments.cli.report import report
from metacontrol_experiments.cli.run import run
from metacontrol_experiments.cli.summary import summary
from metacontrol_experiments.cli.variants import variants
from metacontrol_experiments.cli.yardstick import yardstick
from metacontrol_experiments.io.display import CONSOLE


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def metacontrol() -> None:
    """Missions of a robot that adapts, and what their bags tell."""


for _command in (run, summary, figure, calibrate, variants, compare, delays, campaign, report, yardstick, bag, view):
    metacontrol.add_command(_command)


def main() -> None:
    """Run the command."""
    try:
        metacontrol(prog_name="metacontrol")
    finally:
        CONSOLE.finish()


if __name__ == "__main__":
    main()
