"""The command `metacontrol variants`."""

from __future__ import annotations

from pathlib import Path

import click
from node_kit.io.output_files import write_file

from metacontrol_experiments.campaign.calibration import CalibrationError
from metacontrol_experiments.cli.calibrate import runs_option
from metacontrol_experiments.io.display import refusing
from metacontrol_experiments.io.tables import read_runs


@click.command()
@runs_option
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to a file instead.")
def variants(runs: Path, output: Path | None) -> None:
    """Print tables of a calibration's runs as Markdown, with 95 % confidence intervals over seeds."""
    from metacontrol_experiments.campaign.variant_table import markdown  # scipy takes a while to import

    with refusing(CalibrationError):
        done = read_runs(runs)
        if not done:
            raise CalibrationError(f"{runs}: no runs; metacontrol calibrate makes some")
        text = markdown(done)
        if output:
            text = f"# Variants\n\nMade by `metacontrol variants --output {output}`.\n\n{text}"
            write_file(output, text)
            return
    click.echo(text, nl=False)
