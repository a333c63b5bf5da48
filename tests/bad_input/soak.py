"""Command `./mros soak --bad-input`: gives bad inputs to all that reads; it can be ended and goes on where it was."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Thread

import click
from helpers.soaking import FOLDER, Arguments, FiguresError, code, whole

from bad_input.subjects import slug
from bad_input.tally import Tally
from bad_input.trial import ACCEPTED, BROKEN, LAST, REFUSED, Verdict, made

SAVE_PERIOD = 2.0  # s, wall, between two lines of progress
BATCH = 500  # inputs that a worker is asked for at once
LIFE = 20_000  # inputs after which a worker is replaced by a new one
_WAITS = 300.0  # s, wall, after which a worker that computes nothing is ended
_WARM_UP = 900.0  # s, wall, the same for a worker that has not begun

Answer = tuple[int, str, Verdict]


class WorkerError(RuntimeError):
    """A worker can't begin; the message says how to see why."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status: 1 where something was broken, 130 where it was interrupted."""
    parser = Arguments(__doc__)
    parser.add_argument("--bad-input", action="store_true", required=True, help="bad files and messages")
    parser.add_argument(
        "--count", type=whole("count", 1), required=True, help="inputs, with those that were tried before"
    )
    parser.add_argument("--seed", type=whole("seed", 0), default=0, help="of the inputs (default: 0)")
    parser.add_argument("--output", type=Path, default=FOLDER, help="folder (default: results/soak)")
    options = parser.parse_args(arguments)
    tree = code("catkin_ws/src", "tests/bad_input", "tests/helpers", "examples")
    folder = options.output / f"bad-input-{tree}-{options.seed}"
    try:
        state = folder / "state.json"
        tally = Tally.read(state) if state.exists() else Tally(tree, options.seed)
        tally.write(state)
    except (FiguresError, OSError) as error:
        parser.error(str(error))
    try:
        status = soak(tally, folder, options.count)
    except WorkerError as error:
        parser.error(str(error))
    click.echo(tally.report())
    click.echo(f"{folder}: report.md, state.json" + (", broken/" if tally.broken else ""))
    if status:
        click.echo("interrupted: the same command goes on from here", err=True)
    return status or bool(tally.broken)


def soak(tally: Tally, folder: Path, count: int) -> int:
    """Try inputs until so many were tried; keep the figures. Return 130 where somebody interrupts it."""
    status = 0
    shown = last = time.monotonic()
    answers = trials(tally.seed, tally.done, count)
    try:
        for number, subject, verdict in answers:
            is_new = tally.add(number, subject, verdict)
            tally.done = number + 1
            now = time.monotonic()
            tally.seconds += now - last
            last = now
            if is_new:
                _keep(tally.seed, number, verdict, folder / "broken")
            if now - shown >= SAVE_PERIOD:
                shown = now
                tally.write(folder / "state.json")
                _progress(tally, count)
    except KeyboardInterrupt:
        status = 130
    finally:
        answers.close()
    tally.write(folder / "state.json")
    (folder / "report.md").write_text(tally.report())
    click.echo(err=True)
    return status


def trials(seed: int, first: int, last: int) -> Iterator[Answer]:
    """Try the inputs of some numbers in processes of their own, and yield what came of each, in order."""
    while first < last:
        worker, begun = start_worker(seed), first
        try:
            for number, subject, verdict in worker.trials(first, min(last, first + LIFE)):
                yield number, subject, verdict
                first = number + 1
        finally:
            worker.close()
        if first == begun:
            raise WorkerError(f"a worker ends before input {first}: run python -m bad_input.worker {seed}")


class Worker:
    """A process that makes trials."""

    def __init__(self, seed: int, program: Sequence[str]) -> None:
        """Start it."""
        self._seed = seed
        one = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
        self._process = subprocess.Popen(
            program,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **one},
            start_new_session=True,  # Ctrl-C is for this process
        )
        self._lines: SimpleQueue[str] = SimpleQueue()
        Thread(target=self._listen, daemon=True).start()

    def trials(self, first: int, last: int) -> Iterator[Answer]:
        """Yield what came of inputs, up to one that has ended the process."""
        for begin in range(first, last, BATCH):
            end = min(last, begin + BATCH)
            if not self._ask(begin, end):
                return
            for number in range(begin, end):
                answer = self._answer(number)
                yield answer
                if self._process.poll() is not None and answer[2].outcome == BROKEN:
                    return

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put("")

    def _ask(self, begin: int, end: int) -> bool:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{begin} {end}\n")
            self._process.stdin.flush()
        except OSError:
            return False
        return True

    def _answer(self, number: int) -> Answer:
        begun = self._line(_WARM_UP)
        if not begun:
            raise WorkerError(f"a worker ends before input {number}: run python -m bad_input.worker {self._seed}")
        line = self._line(_WAITS)
        if line:
            outcome, subject, cpu, memory, problem = line.rstrip("\n").split("\t")
            return number, subject, Verdict(outcome, problem, "", float(cpu), int(memory))
        status = self._process.wait()
        subject, _ = made(self._seed, number)
        if status == -signal.SIGVTALRM:
            return number, subject.name, Verdict(BROKEN, f"takes more than {LAST} s", cpu=float(LAST))
        return number, subject.name, Verdict(BROKEN, f"the process ends ({status})")

    def _line(self, patience: float) -> str:
        """Return the next line; an empty text where the process has ended, or does nothing any more."""
        try:
            return self._lines.get(timeout=patience)
        except Empty:
            self._process.kill()
            return ""


def start_worker(seed: int) -> Worker:
    """Return a new process for the inputs of a seed."""
    return Worker(seed, [sys.executable, "-m", "bad_input.worker", str(seed)])


def _keep(seed: int, number: int, verdict: Verdict, folder: Path) -> None:
    """Keep an input that breaks its subject as none before."""
    subject, data = made(seed, number)
    home = folder / slug(subject.name)
    home.mkdir(parents=True, exist_ok=True)
    (home / str(number)).write_bytes(data)
    click.echo(f"\n{subject.name}: {verdict.problem} ({home / str(number)})", err=True)


def _progress(tally: Tally, count: int) -> None:
    totals = {which: sum(getattr(row, which) for row in tally.rows.values()) for which in (ACCEPTED, REFUSED, BROKEN)}
    told = ", ".join(f"{value:,} {which}" for which, value in totals.items())
    rate = tally.done / tally.seconds if tally.seconds else 0.0
    click.echo(f"\r{tally.done:,} of {count:,} inputs, {told}, {rate:.0f}/s", nl=False, err=True)


if __name__ == "__main__":
    sys.exit(main())
