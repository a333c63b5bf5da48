"""Terminal output of the commands: notes, errors, and a mission's progress, timeline and closing tables."""

from __future__ import annotations

import os
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import click
from metacontrol_bags.metrics import verdict
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType

    from metacontrol_bags.timeline import Entry

REFUSED, INTERRUPTED = 2, 130
"""Exit status of a command."""


class LastingConsole(Console):
    """A console for what a command says while it works: what can't be shown is left out, and the command goes on.

    The reader may leave, as `head` does: then nothing is shown any more. The disk may be full, maybe for a while.
    """

    def print(self, *objects: Any, **options: Any) -> None:
        """Show something."""
        try:
            super().print(*objects, **options)
        except OSError:
            with suppress(OSError), self.capture():  # takes it, or it would be shown together with what comes next
                pass

    def on_broken_pipe(self) -> None:
        """Write nowhere from now on; Rich's own way is to end the program."""
        self.quiet = True
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.file.fileno())  # also for what is still in the file's buffer
        os.close(nowhere)

    def finish(self) -> None:
        """Write what is still in the file's buffer, if that can be; Python's own way is another exit status."""
        try:
            self.file.flush()
        except OSError:
            self.on_broken_pipe()


CONSOLE = LastingConsole(highlight=False)
_STYLES = {"R1": "yellow", "R2": "cyan", "R3": "cyan", "R4": "green", "!": "bold red", "-": "bold"}


def tell(text: str, style: str = "") -> None:
    """Show a line."""
    CONSOLE.print(Text(text, style), soft_wrap=True)


@contextmanager
def refusing(*kinds: type[Exception]) -> Iterator[None]:
    """End a command with one line if one of these errors, a file system error or Ctrl-C ends the body."""
    refused: tuple[type[Exception], ...] = (*kinds, OSError)
    try:
        yield
    except refused as error:
        said = str(error) or type(error).__name__
        if isinstance(error, OSError) and error.filename:
            said = f"{error.filename}: {error.strerror}"
        click.echo(f"metacontrol: {' '.join(said.split())}", err=True)
        raise click.exceptions.Exit(REFUSED) from error
    except KeyboardInterrupt as interrupt:
        click.echo("metacontrol: interrupted; every process was ended", err=True)
        raise click.exceptions.Exit(INTERRUPTED) from interrupt


class Display:
    """A mission: with a live bar on a terminal, else plain lines; silent if quiet."""

    def __init__(self, quiet: bool = False) -> None:
        """Prepare a bar if there is a terminal."""
        self._quiet = quiet
        self._bar: Progress | None = None
        self._start = 0.0
        self._tenth = 0
        if CONSOLE.is_terminal and not quiet:
            self._bar = Progress(
                TextColumn("done"),
                BarColumn(None),
                TaskProgressColumn(),
                TextColumn("{task.description}"),
                console=CONSOLE,
            )
            self._task = self._bar.add_task("starting", total=1.0)

    def __enter__(self) -> Display:
        """Show the bar."""
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the bar."""
        if self._bar:
            self._bar.stop()

    def say(self, text: str) -> None:
        """Show a line."""
        self._print(Text(text))

    def _print(self, shown: Text | Table) -> None:
        if not self._quiet:
            CONSOLE.print(shown, soft_wrap=isinstance(shown, Text))

    def start(self, stamp: float) -> None:
        """Count times from this stamp on: the mission starts."""
        self._start = stamp

    def entry(self, entry: Entry) -> None:
        """Show a line of the timeline."""
        line = Text(f"{entry.stamp - self._start:7.2f} s  ")
        line.append(f"{entry.step:<2}", _STYLES.get(entry.step, ""))
        line.append("  " + entry.text, "red" if entry.bad else "")
        self._print(line)

    def progress(self, share: float, stamp: float, left: str) -> None:
        """How much is done (0..1), and in words what is left."""
        if self._bar:
            text = f"{stamp - self._start:5.1f} s, {left} left"
            self._bar.update(self._task, completed=share, description=text)
        elif int(share * 10) > self._tenth:
            self._tenth = int(share * 10)
            self.say(f"{stamp - self._start:7.2f} s  ..  {self._tenth * 10} % done")

    def show(self, *tables: Table) -> None:
        """Show tables."""
        for table in tables:
            self._print(table)

    def summary(self, summary: dict[str, Any]) -> None:
        """Show the closing tables."""
        self.show(_figures(summary))
        if summary["reconfigurations"]:
            self.show(reconfigurations_table(summary["reconfigurations"]))


def _figures(summary: dict[str, Any]) -> Table:
    table = Table(
        show_header=False, title=f"Mission {summary['mission']}, route {summary['route']}, seed {summary['seed']}"
    )
    table.add_column("")
    table.add_column("", justify="right")
    above, mean, goal = summary["time_above_threshold"], summary["mean_qa"], summary["goal_reached"]
    configurations = dict.fromkeys((summary["initial_configuration"], summary["final_configuration"]))
    rows: list[tuple[str, str]] = [
        ("goal reached", "yes" if goal else f"no ({summary['outcome']})"),
        ("success (paper's four conditions)", verdict(summary, "\n")),
        ("duration", _with_unit(summary["duration_s"], "s")),
        ("way driven", _with_unit(summary["path_length_m"], "m")),
        ("collisions", "-" if summary["collisions"] is None else str(summary["collisions"])),
        ("configuration", " -> ".join(map(str, configurations))),
    ]
    rows += [(f"time above the {name} threshold", _percent(share)) for name, share in above.items()]
    rows += [(f"mean {name}", _with_unit(level, "")) for name, level in mean.items()]
    rows.append(("control periods missed", _percent(summary["control"]["periods_missed"])))
    rows.append(("simulated / wall time", _with_unit(summary["real_time_factor"], "")))
    for row in rows:
        table.add_row(*row)
    return table


def reconfigurations_table(entries: list[dict[str, Any]]) -> Table:
    """Return a table of adaptations, narrow enough for 80 columns."""
    table = Table(title="Reconfigurations (s)", box=None, padding=(0, 1))
    for title in ("at", "trigger", "from", "to", "detect", "decide", "execute"):
        table.add_column(title, justify="left" if title in ("trigger", "from", "to") else "right", no_wrap=True)
    for entry in entries:
        spans = (_with_unit(entry[key], "") for key in ("detect_s", "decide_s", "execute_s"))
        table.add_row(_with_unit(entry["stamp_s"], ""), entry["trigger"], entry["from"], entry["to"], *spans)
    return table


def _with_unit(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.2f} {unit}".strip()


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{share:.2%}"
