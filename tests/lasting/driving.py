"""Drives one system: `python -m lasting.driving SEED RUN FOLDER HOURS` writes FOLDER/run-RUN.jsonl as it goes."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import TextIO

import psutil
import rospkg
from helpers.ports import free_port
from soak import beside
from soak.driving import OWN, begin_network
from soak.observed import Told, read
from soak.plan import Fault
from soak.process_table import MARK, ProcessTable
from soak.recovery import HOLDS_S, is_well
from soak.striking import LeftOutError, Place, Striker, Undo

from lasting.faults import fault
from lasting.figures import line

PACKAGE = "metacontrol_sim"
START_S = 150.0
"""Wall s until all must be well after the start."""
WELL_S = 60.0
"""Wall s until all must be well again after a fault, on a quiet machine."""
READ_S, PERIOD_S = 10.0, 0.2
END_S = 60.0
"""Wall s for all processes of a system that was asked to end."""
PAUSES_S = (3.0, 12.0)
"""Between two faults, wall s."""


def main() -> None:
    """Drive the system."""
    seed, run, folder, hours = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]).resolve(), float(sys.argv[4])
    begin_network()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    place = folder / f"system-{run}"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    with (folder / f"run-{run}.jsonl").open("w", encoding="utf-8") as file:
        Drive(Random(f"lasting {seed} {run}"), place, 3600.0 * hours, Lines(file)).run()


class Lines:
    """Where lines go, from any thread."""

    def __init__(self, file: TextIO) -> None:
        """Write into a file that is open."""
        self._file, self._lock, self._began = file, threading.Lock(), time.monotonic()

    def begin(self) -> None:
        """Count the time from now."""
        self._began = time.monotonic()

    @property
    def t(self) -> float:
        """Time since then, s."""
        return round(time.monotonic() - self._began, 2)

    def write(self, what: str, *content: object) -> None:
        """Write a line."""
        with self._lock:
            self._file.write(line(what, content))
            self._file.flush()


@dataclass
class Drive:
    """A system that lives."""

    draw: Random
    folder: Path
    seconds: float
    lines: Lines
    _told: Told | None = None
    _stretch: float = 1.0
    _broken: list[str] = field(default_factory=list)
    _next_reading: float = 0.0

    def run(self) -> None:
        """Run it, let faults strike, and end it; nothing that was started here stays."""
        port = free_port()
        log = self.folder / "log"
        log.mkdir()
        environment = {**os.environ, MARK: str(log), "ROS_LOG_DIR": str(log), "ROS_HOME": str(log)}
        environment |= {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_HOSTNAME": "localhost"}
        helpers = {key: value for key, value in environment.items() if key != MARK}
        helpers |= {"ROS_LOG_DIR": str(self.folder), "ROS_HOME": str(self.folder)}
        words = [*OWN, "roslaunch", "-p", str(port), PACKAGE, "metacontrol_sim_reasoner.launch"]
        with (self.folder / "said.log").open("wb") as said:
            system = subprocess.Popen(
                [*words, f"seed:={self.draw.randrange(1, 2**31)}"],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        table = ProcessTable(str(log))
        observer = self._helper(["soak.observer"], helpers, self._observe)
        goals = self._helper(["lasting.goals", str(self.draw.random())], helpers, self._take_goal)
        striker = Striker(self._place(port, helpers, observer), ProcessTable(str(log)))
        try:
            self._live(system, table, striker)
        except KeyboardInterrupt:
            pass
        finally:
            self._end(system, table, [*striker.helpers, observer, goals])

    def _place(self, port: int, helpers: dict[str, str], observer: subprocess.Popen[str]) -> Place:
        package = Path(rospkg.RosPack().get_path(PACKAGE))
        return Place(
            self.folder,
            package,
            package,
            self.folder / "control",
            f"http://localhost:{port}",
            helpers,
            beside.teller(observer),
            lambda: self._told,
        )

    def _helper(
        self, words: list[str], environment: dict[str, str], take: Callable[[str], None]
    ) -> subprocess.Popen[str]:
        """Start a helper, and have what it writes taken in a thread."""
        process = beside.start(words, environment, self.folder / f"{words[0]}.log")

        def listen() -> None:
            for text in process.stdout or ():
                take(text)

        threading.Thread(target=listen, daemon=True).start()
        return process

    def _observe(self, text: str) -> None:
        if text.startswith('["told"'):
            self._told = read([text]).told[0]
        elif text.startswith('["beats"'):
            self._stretch = read([text]).beats[0].stretch

    def _take_goal(self, text: str) -> None:
        match text.split():  # whatever libraries write there, too
            case ["goal", outcome, seconds]:
                self.lines.write("goal", self.lines.t, outcome, float(seconds))

    # The life

    def _live(self, system: subprocess.Popen[bytes], table: ProcessTable, striker: Striker) -> None:
        if self._well_after(time.monotonic(), START_S, system, table) is None:
            self._broken.append(f"not well within {START_S:g} s of the start")
            return
        self.lines.begin()
        while self.lines.t < self.seconds and system.poll() is None:
            self._pause(self.draw.uniform(*PAUSES_S), table)
            self._strike(fault(self.draw), system, table, striker)
        if system.poll() is not None:
            self._broken.append(f"the system ended by itself, status {system.returncode}: see said.log")

    def _pause(self, seconds: float, table: ProcessTable) -> None:
        end = time.monotonic() + seconds
        while (now := time.monotonic()) < end:
            self._read(table)
            time.sleep(min(1.0, end - now))

    def _read(self, table: ProcessTable) -> None:
        """Write what each process has, from time to time."""
        if time.monotonic() < self._next_reading:
            return
        self._next_reading = time.monotonic() + READ_S
        self.lines.write("stretch", self._stretch)
        for usage in table.usages():
            with suppress(psutil.Error):
                threads = psutil.Process(usage.pid).num_threads()
                self.lines.write(
                    "reading", self.lines.t, usage.pid, usage.role, usage.memory, usage.descriptors, threads
                )

    def _strike(self, one: Fault, system: subprocess.Popen[bytes], table: ProcessTable, striker: Striker) -> None:
        undo: Undo | None
        struck = self.lines.t
        try:
            note, undo = striker.strike(one)
        except LeftOutError:
            return
        if undo is not None:
            self._pause(one.lasts, table)
            with suppress(OSError, psutil.Error):
                undo()
        over, stretch = time.monotonic(), max(1.0, self._stretch)
        seconds = self._well_after(over, WELL_S * stretch, system, table)
        hit = ", ".join(filter(None, (*one.targets, one.how)))
        self.lines.write("recovery", self.lines.t, one.kind.name, f"{hit}: {note}", seconds, struck)

    def _well_after(
        self, begin: float, longest: float, system: subprocess.Popen[bytes], table: ProcessTable
    ) -> float | None:
        """Wait until all is well and stays so; return how long that took, None where it was too long."""
        since = None
        while time.monotonic() - begin < longest and system.poll() is None:
            now = time.monotonic()
            since = (since or now) if is_well(table.sample(), self._told) else None
            if since is not None and now - since >= HOLDS_S:
                return round(since - begin, 2)
            self._read(table)
            time.sleep(PERIOD_S)
        return None

    def _end(self, system: subprocess.Popen[bytes], table: ProcessTable, helpers: list[subprocess.Popen[str]]) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        lived = self.lines.t
        for helper in helpers:
            if helper.poll() is None:
                helper.kill()
            helper.wait()
        if system.poll() is None:
            system.send_signal(signal.SIGINT)
        end = time.monotonic() + END_S
        while (left := table.commands()) and time.monotonic() < end:
            time.sleep(PERIOD_S)
        self._broken += [f"is left behind: {one}" for one in left]
        for process in table.processes():
            with suppress(psutil.Error):
                process.kill()
        system.wait()
        self.lines.write("end", lived, self._broken)


if __name__ == "__main__":
    main()
