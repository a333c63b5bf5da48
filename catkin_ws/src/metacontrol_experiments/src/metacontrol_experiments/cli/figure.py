"""The command `metacontrol figure`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from metacontrol_bags.bag import BagError, read_record
from metacontrol_bags.metrics import MetricsError

from metacontrol_experiments.io.display import refusing
from metacontrol_experiments.mission.settings import FIGURE_NAME
from metacontrol_experiments.pyramid.record import is_of_pyramid, read_pyramid
from metacontrol_experiments.pyramid.summary import summarise_pyramid

if TYPE_CHECKING:
    from metacontrol_bags.record import MissionRecord

    from metacontrol_experiments.pyramid.record import PyramidRecord


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Beside the bag by default.")
def figure(bag: Path, output: Path | None) -> None:
    """Draw a mission's BAG: the way and its qualities, or who built the pyramid and why."""
    target = output or bag.with_name(FIGURE_NAME)
    with refusing(BagError, MetricsError):
        if is_of_pyramid(bag):
            draw_pyramid_figure(read_pyramid(bag), target)
        else:
            draw_figure(read_record(bag), target)
    click.echo(target)


def draw_figure(record: MissionRecord, path: Path) -> None:
    """Draw a record to a file."""
    from metacontrol_bags.figure import draw  # matplotlib takes a while to import

    draw(record, path)


def draw_pyramid_figure(record: PyramidRecord, path: Path) -> None:
    """Draw a record of D1 to a PNG file."""
    from metacontrol_experiments.pyramid.figure import draw_pyramid  # matplotlib and PyBullet take a while to import

    draw_pyramid(record, summarise_pyramid(record), path)
