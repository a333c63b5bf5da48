"""The command `metacontrol compare`."""

from __future__ import annotations

import shlex
from pathlib import Path

import click
from node_kit.io.output_files import write_file

from metacontrol_experiments.io.display import refusing


@click.command()
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to a file instead.")
def compare(results: tuple[Path, ...], output: Path | None) -> None:
    """Print how missions on ROS differ from the same missions in lockstep, as Markdown.

    RESULTS are folders or tables of campaigns that hold both: one campaign, driven by --engine ros and by --engine
    lockstep.
    """
    from metacontrol_experiments.io.report_files import find_table, read_table  # these take a while to import
    from metacontrol_experiments.report.engines import markdown
    from metacontrol_experiments.report.missions import ReportError

    with refusing(ReportError):
        text = markdown([mission for path in results for mission in read_table(find_table(path)).missions])
        if output:
            asked = shlex.join(["metacontrol", "compare", *map(str, results), "--output", str(output)])
            output.parent.mkdir(parents=True, exist_ok=True)
            write_file(output, f"# Lockstep beside ROS\n\nMade by `{asked}`.\n\n{text}")
            return
    click.echo(text, nl=False)
