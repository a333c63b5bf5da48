"""The command `metacontrol summary`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from metacontrol_bags.bag import BagError, read_record
from metacontrol_bags.metrics import MetricsError, summarise
from node_kit.io.output_files import write_file

from metacontrol_experiments.io.display import refusing
from metacontrol_experiments.pyramid.record import is_of_pyramid, read_pyramid
from metacontrol_experiments.pyramid.summary import summarise_pyramid


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to a file instead.")
def summary(bag: Path, output: Path | None) -> None:
    """Print the summary of a mission's BAG as JSON."""
    with refusing(BagError, MetricsError):
        told = summarise_pyramid(read_pyramid(bag)) if is_of_pyramid(bag) else summarise(read_record(bag))
        if output:
            write_summary(told, output)
        else:
            click.echo(json.dumps(told, indent=2))


def write_summary(summary: dict[str, Any], path: Path) -> None:
    """Write a summary as JSON."""
    write_file(path, json.dumps(summary, indent=2) + "\n")
