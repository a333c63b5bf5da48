"""The group `bag`: `metacontrol bag` where the project is installed, `metacontrol-bag` where only this package is."""

from __future__ import annotations

import click

from metacontrol_bags.cli.compare import compare
from metacontrol_bags.cli.decisions import decisions
from metacontrol_bags.cli.info import info
from metacontrol_bags.cli.metrics import metrics
from metacontrol_bags.cli.plot import plot


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
def bag() -> None:
    """Tell what the bags of missions hold.

    A bag that is damaged, not closed or of another robot is read as far as possible; a line on stderr says what is
    missing. Exit status: 0, 2 if nothing can be told of a bag.
    """


for _command in (info, metrics, plot, decisions, compare):
    bag.add_command(_command)


def main() -> None:
    """Run the command `metacontrol-bag`."""
    bag(prog_name="metacontrol-bag")


if __name__ == "__main__":
    main()
