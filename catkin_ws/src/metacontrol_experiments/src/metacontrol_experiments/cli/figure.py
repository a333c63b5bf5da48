"""The command `metacontrol figure`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from metacontrol_bags.bag import BagError, read_record
from metacontrol_bags.metrics import MetricsError

from metacontrol_experiments.io.display import refusing
from metacontrol_experiments.mission.settings import FIGURE_NAME

if TYPE_CHECKING:
    from metacontrol_bags.record import MissionRecord


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Beside the bag by default.")
def figure(bag: Path, output: Path | None) -> None:
    """Draw the map, the path and the quality series of a mission's BAG."""
    target = output or bag.with_name(FIGURE_NAME)
    with refusing(BagError, MetricsError):
        draw_figure(read_record(bag), target)
    click.echo(target)


def draw_figure(record: MissionRecord, path: Path) -> None:
    """Draw a record to a file."""
    from metacontrol_bags.figure import draw  # matplotlib takes a while to import

    draw(record, path)
