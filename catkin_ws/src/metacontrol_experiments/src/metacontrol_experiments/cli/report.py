"""The command `metacontrol report`."""

from __future__ import annotations

from pathlib import Path

import click

from metacontrol_experiments.io.display import refusing, tell


@click.command()
@click.argument("results", type=click.Path(path_type=Path))
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder of the report.  [default: report/ beside the table]",
)
@click.option(
    "--drive/--no-drive",
    "anew",
    default=True,
    show_default=True,
    help="Drive the pair of the single-run figure anew if its runs left no log.",
)
def report(results: Path, output: Path | None, anew: bool) -> None:
    """Write a report on the RESULTS of a campaign: its folder, or its table results.parquet.

    It leaves report.md, report.html, which needs no other file, and figures/ as PNG and SVG. The paper's tables stand
    beside our figures, with intervals and tests; where the meta-controller loses comes first.
    """
    from metacontrol_experiments.io.report_files import (  # statistics and drawing take a while to import
        find_table,
        read_floor,
        read_published,
        read_table,
        write_report,
    )
    from metacontrol_experiments.io.report_pair import find_pair
    from metacontrol_experiments.report.missions import ReportError
    from metacontrol_experiments.report.published import PublishedError
    from metacontrol_experiments.report.report import make_report

    with refusing(ReportError, PublishedError):
        path = find_table(results)
        table, published = read_table(path), read_published()
        single = find_pair(table.missions, path, tell, anew=anew)
        made = make_report(table, published, single, read_floor())
        written = write_report(made, output or path.parent / "report")
    reached = sum(verdict.reached is True for verdict in made.verdicts)
    tell(f"behind in {len(made.losses)} comparisons; {reached} of {len(made.verdicts)} targets reached")
    for file in written:
        click.echo(file)
