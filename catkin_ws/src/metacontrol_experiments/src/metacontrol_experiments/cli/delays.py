"""The command `metacontrol delays`."""

from __future__ import annotations

from pathlib import Path

import click

from metacontrol_experiments.io.comparison_runs import ComparisonError, read_summary
from metacontrol_experiments.io.display import refusing, tell
from metacontrol_experiments.io.tables import write_delays
from metacontrol_experiments.lockstep.delays import KINDS, DelayError, delays_of
from metacontrol_experiments.lockstep.system import LockstepError
from metacontrol_experiments.mission.settings import Settings


@click.command()
@click.argument("summaries", nargs=-1, required=True, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), required=True, help="The CSV file to write.")
def delays(summaries: tuple[Path, ...], output: Path) -> None:
    """Collect how long detection, decision and reconfiguration took, for lockstep to draw from.

    SUMMARIES are those of missions on ROS at real-time factor 1, with failures of components and with changes of
    parameters.
    """
    from metacontrol_experiments.io.lockstep_setup import restarts_between  # the reasoner takes a while to import

    with refusing(DelayError, LockstepError, ComparisonError):
        restarts = restarts_between(Settings.launch_package, "metacontrol_sim_reasoner.launch")
        found = [delay for path in summaries for delay in delays_of(read_summary(path), restarts)]
        lacking = [kind for kind in KINDS if kind not in {delay[0] for delay in found}]
        if lacking:
            raise DelayError(f"no sample of {', '.join(lacking)} in {len(summaries)} summaries: give more of them")
        write_delays(output, found)
    counts = ", ".join(f"{sum(delay[0] == kind for delay in found)} of {kind}" for kind in KINDS)
    tell(f"{output}: {counts}")
