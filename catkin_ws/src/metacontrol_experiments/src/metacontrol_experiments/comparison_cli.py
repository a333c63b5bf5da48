"""The commands `metacontrol compare` and `metacontrol delays`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from metacontrol_experiments.delays import KINDS, DelayError, delays_of, write_delays
from metacontrol_experiments.package import refused, simulation_package
from metacontrol_experiments.runner import RunError

_SUMMARY = "summary.json"


@click.command(context_settings={"ignore_unknown_options": True})
@click.option("--seeds", type=click.IntRange(1), default=5, show_default=True, help="How many: 1, 2, ...")
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results/compare"),
    show_default=True,
    help="A folder for each mission, and comparison.md.",
)
@click.argument("options", nargs=-1, type=click.UNPROCESSED)
def compare(seeds: int, output: Path, options: tuple[str, ...]) -> None:
    """Run the same mission over seeds on ROS and in lockstep, and report how the figures differ.

    OPTIONS are those of `metacontrol run`: what the mission is. Missions whose summary is there already are not run
    again.
    """
    from metacontrol_experiments import comparison  # scipy takes a while to import

    console = Console(highlight=False)
    pairs = []
    try:
        for seed in range(1, seeds + 1):
            found = []
            for engine in comparison.ENGINES:
                folder = output / f"{engine}_{seed}"
                if not (folder / _SUMMARY).exists():
                    console.print(f"seed {seed}, {engine}")
                    comparison.drive(engine, seed, folder, options)
                found.append(_read(folder / _SUMMARY))
            pairs.append(comparison.Pair(seed, *found))
        text = comparison.markdown(pairs)
        told = " ".join(["metacontrol compare", "--seeds", str(seeds), *options])
        (output / "comparison.md").write_text(f"Made by `{told}`.\n\n{text}", encoding="utf-8")
    except (RunError, OSError, ValueError, KeyError) as error:
        raise refused(error) from error
    click.echo(text, nl=False)


@click.command()
@click.argument("summaries", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), required=True, help="The CSV file to write.")
def delays(summaries: tuple[Path, ...], output: Path) -> None:
    """Collect how long detection, decision and reconfiguration took, for lockstep to draw from.

    SUMMARIES are those of missions on ROS at real-time factor 1, with failures of components and with changes of
    parameters.
    """
    from metacontrol_experiments.lockstep_manager import observation_sources  # the reasoner takes a while to import

    try:
        package = simulation_package()
        known = (path.stem for path in (package / "models" / "variants").glob("*.rossystem"))
        sources = {name: observation_sources(package, name) for name in known}
        found = [delay for path in summaries for delay in delays_of(_read(path), sources)]
        lacking = [kind for kind in KINDS if kind not in {delay[0] for delay in found}]
        if lacking:
            raise DelayError(f"no sample of {', '.join(lacking)} in {len(summaries)} summaries: give more of them")
        write_delays(output, found)
    except (DelayError, RunError, OSError, ValueError, KeyError) as error:
        raise refused(error) from error
    counts = ", ".join(f"{sum(delay[0] == kind for delay in found)} of {kind}" for kind in KINDS)
    click.echo(f"{output}: {counts}")


def _read(path: Path) -> dict[str, Any]:
    content = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(content, dict) or "reconfigurations" not in content:
        raise ValueError(f"{path}: is no summary of a mission")
    return content
