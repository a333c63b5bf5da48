"""Command `./mros soak --simulated`: runs histories for hours; it can be ended and goes on where it was."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import click
from helpers.soaking import FOLDER, Arguments, FiguresError, code, hours, whole

from simulated import systems
from simulated.history import history, run
from simulated.shrinking import as_test, shrink
from simulated.tally import Tally

CODE = ("catkin_ws/src", "tests/simulated", "tests/helpers", *systems.FOLDERS)
"""What a history depends on: figures are of one state of it."""
SAVE_PERIOD = 2.0  # s, wall, between two lines of progress


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status: 1 where something was broken, 130 where it was interrupted."""
    parser = Arguments(__doc__)
    parser.add_argument("--simulated", action="store_true", required=True, help="on a simulated clock and network")
    parser.add_argument("--hours", type=hours, required=True, help="in all, with what was done before on this code")
    parser.add_argument("--seed", type=whole("seed", 0), default=0, help="of the first history (default: 0)")
    parser.add_argument("--output", type=Path, default=FOLDER, help="folder (default: results/soak)")
    options = parser.parse_args(arguments)
    tree = code(*CODE)
    folder = options.output / f"simulated-{tree}-{options.seed}"
    try:
        state = folder / "state.json"
        tally = Tally.read(state) if state.exists() else Tally(tree, options.seed, options.seed)
        tally.write(state)
    except (FiguresError, OSError) as error:
        parser.error(str(error))
    status = soak(tally, folder, options.hours * 3600.0)
    click.echo(tally.report())
    click.echo(f"{folder}: report.md, state.json" + (", failed-*.py" if tally.failed else ""))
    if status:
        click.echo("interrupted: the same command goes on from here", err=True)
    return status or bool(tally.failed)


def soak(tally: Tally, folder: Path, seconds: float) -> int:
    """Run histories until so many s are accumulated; keep the figures. Return 130 where somebody interrupts it."""
    status = 0
    shown = last = time.monotonic()
    try:
        while tally.seconds < seconds:
            told = history(tally.next_seed)
            outcome = run(told)
            now = time.monotonic()
            tally.add(told, outcome)
            tally.seconds += now - last
            last = now
            if outcome.broken:
                _keep(told.seed, folder)
            if now - shown >= SAVE_PERIOD:
                shown = now
                tally.write(folder / "state.json")
                _progress(tally, seconds)
    except KeyboardInterrupt:
        status = 130
    tally.write(folder / "state.json")
    (folder / "report.md").write_text(tally.report())
    click.echo(err=True)
    return status


def _keep(seed: int, folder: Path) -> None:
    """Shrink a history that fails, and write its regression test."""
    shrunk = shrink(history(seed))
    text = as_test(shrunk, run(shrunk).broken[0])
    (folder / f"failed-{seed}.py").write_text(text)
    click.echo(f"\n{text}", err=True)


def _progress(tally: Tally, seconds: float) -> None:
    line = (
        f"{tally.seconds / 3600.0:.2f} of {seconds / 3600.0:g} h, {tally.histories:,} histories, "
        f"{tally.steps:,} steps, {tally.faults:,} faults, {len(tally.failed)} broken"
    )
    click.echo(f"\r{line}", nl=False, err=True)


if __name__ == "__main__":
    sys.exit(main())
