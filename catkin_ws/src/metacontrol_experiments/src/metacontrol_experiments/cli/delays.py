"""The command `metacontrol delays`."""

from __future__ import annotations

from pathlib import Path

import click

from metacontrol_experiments.io.display import refusing, tell
from metacontrol_experiments.io.tables import write_delays
from metacontrol_experiments.lockstep.delays import KINDS, DelayError, delays_of
from metacontrol_experiments.lockstep.system import LockstepError
from metacontrol_experiments.mission.settings import ROS, Settings


@click.command()
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(dir_okay=False, path_type=Path), required=True, help="The CSV file to write.")
def delays(results: tuple[Path, ...], output: Path) -> None:
    """Collect how long detection, decision and reconfiguration took, for lockstep to draw from.

    RESULTS are folders or tables of campaigns on ROS, with failures of components and with changes of parameters.
    """
    # The reasoner, statistics and drawing take a while to import.
    from metacontrol_experiments.io.lockstep_setup import restarts_between
    from metacontrol_experiments.io.report_files import find_table, read_table
    from metacontrol_experiments.report.missions import OURS, ReportError

    with refusing(DelayError, LockstepError, ReportError):
        restarts = restarts_between(Settings.launch_package, "metacontrol_sim_reasoner.launch")
        missions = [mission for path in results for mission in read_table(find_table(path)).missions]
        used = [one for one in missions if one.done and one.run.engine == ROS and one.manager == OURS]
        found = [delay for mission in used for delay in delays_of(mission.summary, restarts)]
        lacking = [kind for kind in KINDS if kind not in {delay[0] for delay in found}]
        if lacking:
            raise DelayError(
                f"no sample of {', '.join(lacking)} in {len(used)} missions of {OURS} on ROS: give more of them"
            )
        write_delays(output, found)
    counts = ", ".join(f"{sum(delay[0] == kind for delay in found)} of {kind}" for kind in KINDS)
    tell(f"{output}: {counts}")
