"""Drives one mission: `python -m soak.driving SEED NUMBER FOLDER` prints its record, one line.

The command `metacontrol run` is started on a port of its own, the observer beside it; faults strike as the plan says.
All that was observed stays in FOLDER/observed.jsonl; logs and bag stay where something was broken.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median

import psutil
import rospkg
from helpers.ports import free_port

from soak import beside
from soak.checks import broken, excuse_of
from soak.observed import End, Observed, Strike, Told, line, read
from soak.plan import Kind, Mission, mission
from soak.process_table import MARK, ProcessTable
from soak.records import Record, Struck
from soak.recovery import recoveries
from soak.striking import LeftOutError, Place, Striker, Undo

TIMEOUT_S = 240
"""ROS s after which a mission has failed."""
LIMIT_S = 540.0
"""Wall s after which a mission's command is ended, and that is told as broken: start, time-out and end, twice over."""
START_S = 220.0
"""Wall s that it may take to send the goal; the command itself waits for 90 s for each part."""
LAST_S = 45.0
"""Wall s after which a mission without a master must have ended: its parts notice it within 2 s."""
PERIOD_S, USAGE_S = 0.2, 2.0
ENDS_S = 3.0
"""Wall s for processes that were asked to end."""
DISK_MB = 160
PACKAGE = "metacontrol_sim"
_SET_FLAGS, _UP = 0x8914, 0x41
"""Of Linux: SIOCSIFFLAGS, and IFF_UP with IFF_RUNNING."""
OWN = ("setpriv", "--pdeathsig", "INT", "env", "--default-signal=INT")
"""Begins the command of a process that is to end with this one, also where a shell runs that in the background."""


def main() -> None:
    """Drive the mission."""
    seed, number, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]).resolve()
    plan = mission(seed, number)
    begin_network()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    record = Drive(plan, folder).run()
    (folder / "record.json").write_text(json.dumps(asdict(record), indent=1))
    print(json.dumps(asdict(record)))  # noqa: T201
    if not record.broken:
        for name in ("run", "copy", "devel", "bin", "helpers"):
            shutil.rmtree(folder / name, ignore_errors=True)


@dataclass
class Drive:
    """A mission that runs.

    Attributes:
        plan: what strikes.
        folder: for all that it leaves.
    """

    plan: Mission
    folder: Path
    _told: Told | None = None
    _began: float | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _lines: list[str] = field(default_factory=list)
    _undos: dict[int, Undo] = field(default_factory=dict)
    _left_out: dict[int, str] = field(default_factory=dict)

    def run(self) -> Record:
        """Run it; return what is kept of it. Whatever happens, nothing that was started here stays."""
        began = time.monotonic()
        port = free_port()
        output = self.folder / "run"
        output.mkdir()
        mounted = self.plan.small_disk and _mount(output)
        environment = self._environment(port, output)
        helpers = {key: value for key, value in environment.items() if key != MARK}
        helpers |= {"ROS_LOG_DIR": str(self.folder / "helpers"), "ROS_HOME": str(self.folder / "helpers")}
        table = ProcessTable(str(output))
        command = subprocess.Popen(
            [*OWN, *self._command(port, output)],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=(self.folder / "said.log").open("wb"),
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        observer = beside.start(["soak.observer"], helpers, self.folder / "observer.log")
        threading.Thread(target=self._listen, args=(observer,), daemon=True).start()
        striker = Striker(self._place(output, port, helpers, observer), ProcessTable(str(output)))
        try:
            self._follow(command, table, striker)
            self._see_it_end(command, table)
        finally:
            with suppress(KeyboardInterrupt):
                self._clear(command, table, striker, observer)
            if mounted:
                _keep_and_unmount(output)
        return self._judge(began)

    def _environment(self, port: int, output: Path) -> dict[str, str]:
        """Return the environment of the mission, with a copy of the package that it reads."""
        original = Path(rospkg.RosPack().get_path(PACKAGE))
        shutil.copytree(original, self.folder / "copy" / PACKAGE)
        devel = self.folder / "devel"
        devel.mkdir()
        (devel / ".catkin").write_text(str(self.folder / "copy"))
        environment = {**os.environ, MARK: str(output), "ROS_MASTER_URI": f"http://localhost:{port}"}
        environment |= {"ROS_HOSTNAME": "localhost"}
        environment["ROS_PACKAGE_PATH"] = f"{self.folder / 'copy'}:{os.environ['ROS_PACKAGE_PATH']}"
        environment["CMAKE_PREFIX_PATH"] = f"{devel}:{os.environ['CMAKE_PREFIX_PATH']}"
        (self.folder / "helpers").mkdir()
        if self.plan.proxied:
            programs = self.folder / "bin"
            programs.mkdir()
            shim = programs / "rosmaster"
            shim.write_text(
                f'#!/bin/sh\nexec "{sys.executable}" -m soak.master_proxy {free_port()} "{self.folder}/control" "$@"\n'
            )
            shim.chmod(0o755)
            environment["PATH"] = f"{programs}:{os.environ['PATH']}"
        return environment

    def _command(self, port: int, output: Path) -> list[str]:
        plan = self.plan
        words = ["metacontrol", "run", "--quiet", "--port", str(port), "--output", str(output), "--failure", "none"]
        words += ["--route", plan.route, "--seed", str(plan.seed), "--initial-configuration", plan.configuration]
        words += ["--timeout", str(TIMEOUT_S)]
        return words + (["--parameters", "{reasoner: rules}"] if plan.engine == "rules" else [])

    def _place(self, output: Path, port: int, helpers: dict[str, str], observer: subprocess.Popen[str]) -> Place:
        return Place(
            output,
            self.folder / "copy" / PACKAGE,
            Path(rospkg.RosPack().get_path(PACKAGE)),
            self.folder / "control",
            f"http://localhost:{port}",
            helpers,
            beside.teller(observer),
            lambda: self._told,
        )

    def _listen(self, observer: subprocess.Popen[str]) -> None:
        """Take in what the observer writes."""
        for text in observer.stdout or ():
            with self._lock:
                self._lines.append(text)
            if text.startswith('["told"'):
                self._told = read([text]).told[0]
            elif text.startswith('["events"'):
                event = read([text]).events[0]
                if event.kind == "MISSION_START":
                    self._began = event.t

    def _follow(self, command: subprocess.Popen[bytes], table: ProcessTable, striker: Striker) -> None:
        """Sample, and let faults strike, until the command ends or its time is up."""
        started, used, struck = time.monotonic(), 0.0, 0
        limit = LIMIT_S
        at_work: threading.Thread | None = None
        while command.poll() is None and time.monotonic() - started < limit:
            turn = time.monotonic()
            self._write("samples", table.sample())
            if turn - used > USAGE_S:
                used = turn
                for usage in table.usages():
                    self._write("usages", usage)
            if self._began is None and turn - started > START_S:
                break
            faults = self.plan.faults
            free = at_work is None or not at_work.is_alive()
            if self._began and free and struck < len(faults) and turn - self._began >= faults[struck].at:
                if faults[struck].kind.ends_mission:
                    limit = min(limit, turn - started + LAST_S * 2)
                at_work = threading.Thread(target=self._strike, args=(striker, struck), daemon=True)
                at_work.start()
                struck += 1
            time.sleep(max(0.0, turn + PERIOD_S - time.monotonic()))
        self._take_back_all()

    def _strike(self, striker: Striker, index: int) -> None:
        fault = self.plan.faults[index]
        before = time.monotonic()
        try:
            note, undo = striker.strike(fault)
        except LeftOutError as error:
            self._left_out[index] = str(error)
            return
        # What it took to find the moment, as with phases, comes before; a signal strikes at once.
        self._write("strikes", Strike(time.monotonic() if fault.kind in _LATE else before, index, False, note))
        if undo is not None and fault.lasts:
            self._undos[index] = undo
            # Not in a turn of the loop, which may take seconds on a busy machine: a master that is stopped for longer
            # than the 10 s that nodes bear ends a mission.
            timer = threading.Timer(fault.lasts, self._take_back, (index,))
            timer.daemon = True
            timer.start()

    def _take_back(self, index: int) -> None:
        undo = self._undos.pop(index, None)
        if undo is not None:
            with suppress(OSError, psutil.Error):
                undo()
            self._write("strikes", Strike(time.monotonic(), index, True, "taken back"))

    def _take_back_all(self) -> None:
        for index in list(self._undos):
            self._take_back(index)

    def _see_it_end(self, command: subprocess.Popen[bytes], table: ProcessTable) -> None:
        """Write how the command ended, and what it left."""
        status = command.poll()
        end = time.monotonic() + ENDS_S
        left = table.commands()
        while left and status is not None and time.monotonic() < end:
            time.sleep(PERIOD_S)
            left = table.commands()
        said = (self.folder / "said.log").read_text(errors="replace").strip()
        self._write("end", End(time.monotonic(), status, said[-600:], tuple(left) if status is not None else ()))

    def _clear(
        self, command: subprocess.Popen[bytes], table: ProcessTable, striker: Striker, observer: subprocess.Popen[str]
    ) -> None:
        """End whatever still runs."""
        self._take_back_all()
        for helper in (*striker.helpers, observer):
            if helper.poll() is None:
                helper.kill()
            helper.wait()
        if command.poll() is None:
            command.send_signal(signal.SIGINT)
            with suppress(subprocess.TimeoutExpired):
                command.wait(60.0)
        for process in table.processes():
            with suppress(psutil.Error):
                process.kill()
        with suppress(subprocess.TimeoutExpired):
            command.wait(10.0)

    def _write(self, what: str, content: object) -> None:
        with self._lock:
            self._lines.append(line(what, content) + "\n")  # type: ignore[arg-type]

    def _judge(self, began: float) -> Record:
        with self._lock:
            lines = list(self._lines)
        (self.folder / "observed.jsonl").write_text("".join(lines))
        observed = read(lines)
        return judge(self.plan, observed, self._left_out, time.monotonic() - began)


_LATE = (Kind.KILL_IN_CHANGE, Kind.KILL_STARTING, Kind.DATA, Kind.SERVICE, Kind.USURP, Kind.CLOCK_JUMPS)
"""Kinds that strike when the striker is done, not when it begins."""


def judge(plan: Mission, observed: Observed, left_out: dict[int, str], wall_s: float) -> Record:
    """Return the record of a mission from what was observed."""
    times = recoveries(plan, observed)
    notes = {strike.index: strike.note for strike in observed.struck()}
    struck = [
        Struck(plan.faults[index].kind.name, f"{plan.faults[index]}: {notes[index]}", times.get(index))
        for index in sorted(notes)
    ]
    struck += [Struck(plan.faults[one].kind.name, str(plan.faults[one]), None, why) for one, why in left_out.items()]
    end = observed.event("MISSION_END")
    status = observed.end.status if observed.end else None
    outcome = f"{end.values['outcome']}: {end.values.get('reason', '')}" if end else f"status {status}"
    memory = {usage.role: usage.memory for usage in observed.usages if usage.role and usage.memory}  # 0: it ends
    return Record(
        plan.number,
        outcome,
        round(wall_s, 1),
        median([beat.stretch for beat in observed.beats] or [1.0]),
        tuple(struck),
        tuple(broken(plan, observed)),
        memory,
        excuse_of(plan, observed),
    )


def begin_network() -> None:
    """Begin with the loopback of a network of one's own, where this process has one; elsewhere it is there already."""
    with socket.socket() as probe, suppress(OSError):
        asked = struct.pack("16sH22x", b"lo", _UP)
        fcntl.ioctl(probe, _SET_FLAGS, asked)


def _mount(folder: Path) -> bool:
    """Make a folder a small disk; tell whether that is allowed."""
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MB}m", "soak", str(folder)]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


def _keep_and_unmount(folder: Path) -> None:
    """Copy a small disk's logs beside it, and take the disk away."""
    with suppress(OSError, shutil.Error):
        shutil.copytree(folder / "log", folder.with_name("log"), dirs_exist_ok=True)
    subprocess.run(["umount", "--lazy", str(folder)], capture_output=True, check=False)


if __name__ == "__main__":
    main()
