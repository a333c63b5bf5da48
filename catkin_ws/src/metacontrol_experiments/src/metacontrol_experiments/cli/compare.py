"""The commands `metacontrol compare` and `metacontrol delays`."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from metacontrol_experiments.cli.display import refusing, tell
from metacontrol_experiments.lockstep.delays import KINDS, DelayError, delays_of, write_delays
from metacontrol_experiments.mission.settings import Settings
from metacontrol_experiments.ros.runner import RunError


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

    with refusing(comparison.ComparisonError, RunError):
        comparison.claim(runs, options)
        pairs = []
        for seed in range(1, seeds + 1):
            found = []
            for engine in comparison.ENGINES:
                folder = runs / f"{engine}_{seed}"
                if not (folder / comparison.SUMMARY).exists():
                    comparison.drive(engine, seed, folder, options)
                summary = comparison.read_summary(folder / comparison.SUMMARY)
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


@click.command()
@click.argument("summaries", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), required=True, help="The CSV file to write.")
def delays(summaries: tuple[Path, ...], output: Path) -> None:
    """Collect how long detection, decision and reconfiguration took, for lockstep to draw from.

    SUMMARIES are those of missions on ROS at real-time factor 1, with failures of components and with changes of
    parameters.
    """
    from metacontrol_experiments.campaign.comparison import ComparisonError, read_summary
    from metacontrol_experiments.io.lockstep_setup import restarts_between  # the reasoner takes a while to import
    from metacontrol_experiments.lockstep.system import LockstepError

    with refusing(DelayError, LockstepError, ComparisonError):
        restarts = restarts_between(Settings.launch_package, "metacontrol_sim_reasoner.launch")
        found = [delay for path in summaries for delay in delays_of(read_summary(path), restarts)]
        lacking = [kind for kind in KINDS if kind not in {delay[0] for delay in found}]
        if lacking:
            raise DelayError(f"no sample of {', '.join(lacking)} in {len(summaries)} summaries: give more of them")
        write_delays(output, found)
    counts = ", ".join(f"{sum(delay[0] == kind for delay in found)} of {kind}" for kind in KINDS)
    tell(f"{output}: {counts}")
