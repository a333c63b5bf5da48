"""Command `./mros soak --faults N`: real missions on ROS, until so many faults have struck; goes on where it was."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import click
from helpers.soaking import FOLDER, Arguments, code, whole

from soak.driving import OWN
from soak.records import Record, RecordsError, faults, parsed, read, report, write

RECORDS, REPORT = "missions.jsonl", "report.md"
FAILURES = 3
"""Missions in a row without a record, after which the soak ends: the fault is its own."""
_POLL_S = 0.2
_GRACE_S = 90.0
"""Wall s for a mission that was interrupted: it ends its processes one after the other."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status: 1 where something was broken, 130 where it was interrupted."""
    parser = Arguments(__doc__)
    parser.add_argument(
        "--faults", type=whole("number", 1), required=True, help="in all, with what was done before on this code"
    )
    parser.add_argument("--seed", type=whole("seed", 0), default=0, help="of all missions (default: 0)")
    parser.add_argument("--jobs", type=whole("number", 1), default=1, help="missions beside each other (default: 1)")
    parser.add_argument(
        "--output", type=Path, default=FOLDER, help="of the folder real-CODE-SEED (default: results/soak)"
    )
    options = parser.parse_args(arguments)
    tree = _tree()
    folder = (options.output / f"real-{tree}-{options.seed}").resolve()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        records = read(folder / RECORDS)
    except (RecordsError, OSError) as error:
        parser.error(str(error))
    soak = Soak(options.seed, folder, records)
    status = soak.run(options.faults, options.jobs)
    told = report(sorted(records, key=lambda record: record.number), tree, options.seed)
    (folder / REPORT).write_text(told)
    click.echo(f"{told}{folder}: {REPORT}, {RECORDS}, a folder for each mission")
    if status:
        click.echo("interrupted: the same command goes on from here", err=True)
    return status or int(any(record.broken for record in records))


class Soak:
    """Runs missions, each in a process of its own."""

    def __init__(self, seed: int, folder: Path, records: list[Record]) -> None:
        """Take what was done before; new records are added to it."""
        self._seed, self._folder, self._records = seed, folder, records
        self._running: dict[int, subprocess.Popen[str]] = {}

    def run(self, wanted: int, jobs: int) -> int:
        """Run missions until so many faults have struck; return 130 where somebody interrupts it."""
        began = time.monotonic()
        former = {number: signal.signal(number, _interrupt) for number in (signal.SIGTERM, signal.SIGHUP)}
        try:
            while self._is_to_go_on(wanted) or self._running:
                while len(self._running) < jobs and self._is_to_go_on(wanted):
                    self._start()
                self._collect()
                self._progress(wanted, time.monotonic() - began)
                time.sleep(_POLL_S)
        except KeyboardInterrupt:
            self._end()
            return 130
        finally:
            click.echo(err=True)
            for number, handler in former.items():
                signal.signal(number, handler)
        return 0

    def _is_to_go_on(self, wanted: int) -> bool:
        last = self._records[-FAILURES:]
        return faults(self._records) < wanted and not (len(last) == FAILURES and all(one.wall_s == 0.0 for one in last))

    def _start(self) -> None:
        done = {record.number for record in self._records} | set(self._running)
        number = next(one for one in range(len(done) + 1) if one not in done)
        folder = self._folder / f"mission-{number}"
        with (self._folder / "driving.log").open("a") as log:
            self._running[number] = subprocess.Popen(
                drive_command(self._seed, number, folder),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                start_new_session=True,
            )

    def _collect(self) -> None:
        """Keep the records of the missions that are over."""
        for number, process in list(self._running.items()):
            if process.poll() is None:
                continue
            del self._running[number]
            said = (process.stdout.read() if process.stdout else "").strip().splitlines()
            try:
                record = parsed(said[-1])
            except (IndexError, ValueError):
                why = f"the soak itself failed, status {process.returncode}: see driving.log"
                record = Record(number, "no record", 0.0, 1.0, (), (why,))
            write(self._folder / RECORDS, record)
            self._records.append(record)
            for what in record.broken:
                click.echo(f"\nmission {number}: {what}", err=True)
            (self._folder / REPORT).write_text(report(self._records, _tree(), self._seed))

    def _end(self) -> None:
        """Have the missions end that are under way; they are not kept."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        for process in self._running.values():
            os.kill(process.pid, signal.SIGINT)
        for process in self._running.values():
            try:
                process.wait(_GRACE_S)
            except subprocess.TimeoutExpired:
                process.kill()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def _progress(self, wanted: int, seconds: float) -> None:
        broken = sum(bool(record.broken) for record in self._records)
        done = f"{faults(self._records)} of {wanted} faults, {len(self._records)} missions, {broken} broken"
        click.echo(f"\r{done}, {seconds:.0f} s", nl=False, err=True)


def drive_command(seed: int, number: int, folder: Path) -> list[str]:
    """Return the command that drives one mission and prints its record."""
    words = [sys.executable, "-m", "soak.driving", str(seed), str(number), str(folder)]
    return [*OWN, *own_network(), *words]


@cache
def own_network() -> tuple[str, ...]:
    """Return the command before another one by which that gets a network of its own; nothing where it is not allowed.

    Callers of other ROS systems of this machine, whose nodes have ended, try their ports again and again: such a port
    may be given to a node of the mission.
    """
    for words in (("unshare", "--net"), ("unshare", "--map-root-user", "--net")):
        if (
            shutil.which(words[0])
            and subprocess.run([*words, "true"], capture_output=True, check=False).returncode == 0
        ):
            return words
    return ()


def _tree() -> str:
    return code("catkin_ws/src", "tests/soak", "tests/helpers")


def _interrupt(_number: int, _frame: object) -> None:
    raise KeyboardInterrupt


if __name__ == "__main__":
    sys.exit(main())
