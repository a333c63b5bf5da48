"""The command `metacontrol compare`."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from metacontrol_experiments.io import comparison_runs
from metacontrol_experiments.io.comparison_runs import ComparisonError
from metacontrol_experiments.io.display import refusing
from metacontrol_experiments.io.processes import RunError
from metacontrol_experiments.mission.settings import SUMMARY_NAME


@click.command(context_settings={"ignore_unknown_options": True})
@click.option("--seeds", type=click.IntRange(1), default=5, show_default=True, help="How many: 1, 2, ...")
@click.option(
    "--runs",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results/compare"),
    show_default=True,
    help="Holds a folder for each mission.",
)
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), help="Write to a file instead.")
@click.argument("options", nargs=-1, type=click.UNPROCESSED)
def compare(seeds: int, runs: Path, output: Path | None, options: tuple[str, ...]) -> None:
    """Run the same mission over seeds on ROS and in lockstep; print how the figures differ as Markdown.

    OPTIONS are those of `metacontrol run`: what the mission is. Missions whose summary is there already are not run
    again, so after an interruption the same command goes on.
    """
    from metacontrol_experiments.campaign import comparison  # scipy takes a while to import

    with refusing(ComparisonError, RunError):
        comparison_runs.claim(runs, options)
        pairs = []
        for seed in range(1, seeds + 1):
            found = []
            for engine in comparison.ENGINES:
                folder = runs / f"{engine}_{seed}"
                if not (folder / SUMMARY_NAME).exists():
                    comparison_runs.drive(engine, seed, folder, options)
                summary = comparison_runs.read_summary(folder / SUMMARY_NAME)
                click.echo(f"seed {seed}, {engine}: {summary['outcome']} after {summary['duration_s']:.1f} s", err=True)
                found.append(summary)
            pairs.append(comparison.Pair(seed, *found))
        text = comparison.markdown(pairs)
        if output:
            asked = shlex.join(["metacontrol", "compare", "--seeds", str(seeds), "--output", str(output), *options])
            output.parent.mkdir(parents=True, exist_ok=True)
            output.write_text(f"# Lockstep beside ROS\n\nMade by `{asked}`.\n\n{text}", encoding="utf-8")
            return
    click.echo(text, nl=False)
