"""The command `metacontrol yardstick`."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import rospkg
from node_kit.io.output_files import write_file
from pybullet_simulator.robot.motion_sensors import JOLT, JOLT_SPACING, VIBRATION
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

from metacontrol_experiments.campaign.definition import QUANTILES
from metacontrol_experiments.campaign.yardstick import Target, Vibration, fit, loss, targets
from metacontrol_experiments.io.display import CONSOLE, refusing, tell
from metacontrol_experiments.io.ground_files import read_ground, routes_file
from metacontrol_experiments.io.input_files import PackageError, route_names, simulation_package
from metacontrol_experiments.io.yardstick_runs import TraceError, drive, read_trace, trace_file
from metacontrol_experiments.managers.manager import NONE
from metacontrol_experiments.mission.settings import DEFAULT_THRESHOLDS

if TYPE_CHECKING:
    from collections.abc import Sequence

FIRST_SEED = 101
"""Campaigns derive their seeds from a hash (campaign/matrix.py), calibration takes 1, 2, ...: these are their own."""
CLUTTERS = (7, 14, 20)
TRIED_QUANTILES = (0.9, 0.95, 0.975)
BULKS = (0.0, 1.0, 2.0, 3.0)


@click.command()
@click.option("--seeds", type=click.IntRange(1), default=1, show_default=True, help=f"How many: {FIRST_SEED}, ...")
@click.option("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Missions driven side by side.")
@click.option("--fit", "fitting", is_flag=True, help="Also look for the constants that fit best, for several bulks.")
@click.option(
    "--runs",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results/yardstick"),
    show_default=True,
    help="Folder of the traces; delete it when floor, routes or navigation change.",
)
@click.option(
    "--output", type=click.Path(dir_okay=False, path_type=Path), help="Also write the table to this Markdown file."
)
def yardstick(seeds: int, jobs: int, fitting: bool, runs: Path, output: Path | None) -> None:
    """Compare D2's baseline with the published one: how well do floor, vibration and routes fit?

    Drives baseline missions in lockstep: all variants on all routes, and the nine starts with clutter. Missions whose
    traces are there are not driven again. No mission has a meta-controller.
    """
    with refusing(PackageError, TraceError, OSError):
        package = simulation_package()
        variants = sorted(path.stem for path in (package / "models" / "variants").glob("*.rossystem"))
        routes = route_names(routes_file(read_ground(None, None)))
        numbers = range(FIRST_SEED, FIRST_SEED + seeds)
        starts = [variant for variant in variants if "_v2_" in variant]
        others = [variant for variant in variants if variant not in starts]
        clutters = (0, *CLUTTERS)
        asked = [(v, r, seed, clutter) for seed in numbers for clutter in clutters for v in starts for r in routes]
        asked += [(variant, route, seed, 0) for seed in numbers for variant in others for route in routes]
        missing = sum(not trace_file(runs, job).exists() for job in asked)
        with Progress(BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=CONSOLE) as bar:
            task = bar.add_task("missions", total=missing)
            for _ in drive(asked, runs, jobs):
                bar.update(task, advance=1)
        traces = [read_trace(trace_file(runs, job)) for job in asked]
        facts = _published()
    present = Vibration(VIBRATION, JOLT_SPACING, JOLT)
    lines = [
        f"{len(traces)} missions, {sum(trace.reached for trace in traces)} reached their goal; "
        f"v2 variants without clutter take {_duration(traces):.1f} s on average.",
        "",
    ]
    for share in TRIED_QUANTILES:
        found = targets(traces, present, *facts, dict.fromkeys(QUANTILES, share))
        risks, energies = (_rms(found, group) for group in ("expected safety risk", "expected energy"))
        lines.append(
            f"- Expected levels as the {share:.1%} quantile: root mean square residual of safety {risks:.3f}, "
            f"of energy {energies:.3f}"
        )
    found = targets(traces, present, *facts, QUANTILES)
    lines += ["", f"Loss with the constants in force ({present}): {loss(found):.2f}", "", *_table(found)]
    if fitting:
        lines += ["", "| bulk | spacing, m | jolt | loss |", "|---|---|---|---|"]
        for bulk in BULKS:
            best = fit(traces, bulk, present, *facts, QUANTILES)
            reached = loss(targets(traces, best, *facts, QUANTILES))
            lines.append(f"| {bulk:g} | {best.spacing:.2f} | {best.jolt:.1f} | {reached:.2f} |")
    text = "\n".join(lines) + "\n"
    tell(text)
    if output is not None:
        write_file(output, text)


def _published() -> tuple[Any, Any, dict[str, float]]:
    """Return the published baseline in per cent, the published expected levels, and the limits."""
    from metacontrol_experiments.io.report_files import read_published  # drawing takes a while to import

    baseline = {
        table: {row: 100.0 * told[NONE] for row, told in rows.items() if row.split()[0] in ("clutter", "power")}
        for table, rows in read_published().rows.items()
    }
    file = Path(rospkg.RosPack().get_path("metacontrol_experiments")) / "config" / "published_levels.csv"
    with file.open(encoding="utf-8", newline="") as lines:
        expected = {row["name"]: (float(row["safety"]), float(row["energy"])) for row in csv.DictReader(lines)}
    return baseline, expected, dict(DEFAULT_THRESHOLDS)


def _table(found: Sequence[Target]) -> list[str]:
    lines = ["| fact | | published | ours | residual |", "|---|---|---|---|---|"]
    for one in found:
        digits = 1 if "%" in one.group else 3
        figures = (f"{value:.{digits}f}" for value in (one.published, one.ours, one.residual))
        lines.append(f"| {one.group} | {one.name} | {' | '.join(figures)} |")
    return lines


def _rms(found: Sequence[Target], group: str) -> float:
    return float(np.sqrt(np.mean([one.residual**2 for one in found if one.group == group])))


def _duration(traces: Sequence[Any]) -> float:
    return float(np.mean([one.duration_s for one in traces if "_v2_" in one.variant and not one.clutter]))
