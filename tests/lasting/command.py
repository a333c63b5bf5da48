"""Command `./mros soak --lasting --hours H`: one system with faults, for hours; hours of several runs add up."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import click
from helpers.soaking import FOLDER, Arguments, code, hours, whole
from soak.command import own_network
from soak.driving import OWN

from lasting.figures import Run, broken, progress, read, report

REPORT = "report.md"
SHOWN_S = 10.0
"""Wall s between two lines of progress."""
_GRACE_S = 150.0
"""Wall s for a system that was interrupted."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status: 1 where something was broken, 130 where it was interrupted."""
    parser = Arguments(__doc__)
    parser.add_argument("--lasting", action="store_true", required=True)
    parser.add_argument("--hours", type=hours, required=True, help="in all, with those that ran before on this code")
    parser.add_argument("--seed", type=whole("seed", 0), default=0, help="of all faults and goals (default: 0)")
    parser.add_argument(
        "--output", type=Path, default=FOLDER, help="of the folder lasting-CODE-SEED (default: results/soak)"
    )
    options = parser.parse_args(arguments)
    tree = code("catkin_ws/src", "tests/soak", "tests/lasting", "tests/helpers")
    folder = (options.output / f"lasting-{tree}-{options.seed}").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    runs = [read(path) for path in _paths(folder)]
    left = options.hours - sum(run.lasted for run in runs) / 3600.0

    def show() -> None:
        runs = [read(path) for path in _paths(folder)]
        click.echo(f"\r{progress(runs, options.hours)}", nl=False, err=True)

    interrupted = left > 0.0 and drive(options.seed, len(runs), folder, left, show)
    runs = [read(path) for path in _paths(folder)]
    told = report(runs, tree, options.seed)
    (folder / REPORT).write_text(told)
    click.echo(f"{told}{folder}: {REPORT}, a file of lines for each system")
    if interrupted:
        click.echo("interrupted: the same command goes on with another system", err=True)
    return 130 if interrupted else int(any(broken(run) for run in runs))


def drive(seed: int, run: int, folder: Path, hours: float, show: Callable[[], None]) -> bool:
    """Have a system live, and show meanwhile how far it is; return whether somebody interrupted it."""
    words = [sys.executable, "-m", "lasting.driving", str(seed), str(run), str(folder), str(hours)]
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _interrupt)
    process = subprocess.Popen([*OWN, *own_network(), *words], stdin=subprocess.DEVNULL, start_new_session=True)
    try:
        while process.poll() is None:
            with suppress(subprocess.TimeoutExpired):
                process.wait(SHOWN_S)
            show()
        click.echo(err=True)
    except KeyboardInterrupt:
        click.echo(err=True)
        process.send_signal(signal.SIGINT)
        try:
            process.wait(_GRACE_S)
        except subprocess.TimeoutExpired:
            process.kill()
        return True
    for one in folder.glob("system-*"):
        if not broken(_of(folder, one)):
            shutil.rmtree(one, ignore_errors=True)
    return False


def _of(folder: Path, system: Path) -> Run:
    return read(folder / f"run-{system.name.removeprefix('system-')}.jsonl")


def _paths(folder: Path) -> list[Path]:
    return sorted(folder.glob("run-*.jsonl"), key=lambda path: int(path.stem.removeprefix("run-")))


def _interrupt(_number: int, _frame: object) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
