"""Lets the faults of a plan strike a mission that runs, and takes them back."""

from __future__ import annotations

import contextlib
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

import psutil
from node_kit.io.xml_rpc import CallError, Client

from soak.observed import Told
from soak.plan import NODE, PARTS, Fault, Kind
from soak.process_table import ProcessTable

Undo = Callable[[], None]

OTHER_SENSOR = ("f1_v1_r3_b", "f2_v2_r2")
"""Variants that no change of parameters leads to from each other: nodes are restarted."""
BUSY = 2
"""Processes that take the CPU."""
CONNECTIONS = 40
SAYS = "met: "
"""Begins what a stranger tells of what it met: see `soak.foreign`."""
HALVES = (b"", b"POST /RPC2 HTTP/1.1\r\nContent-Length: 900\r\n\r\n<?xml", b"\xff\x00\x00")
"""What half-open connections have said."""
_PHASE_S = 10.0
_BREAK_S = 0.3
"""For so long no connection to the master holds. None is refused: two refusals tell that it is gone."""
_BALLAST, _BLOCK = "ballast", 65536


class LeftOutError(Exception):
    """A fault can't strike here; the message says why."""


@dataclass
class Place:
    """Where a mission runs.

    Attributes:
        folder: of the mission's output; a small disk where the plan fills one.
        copy: of the package whose files the mission reads.
        original: of that package.
        control: file of the proxy before the master.
        uri: of the master.
        environment: of helpers.
        request: asks the manipulator for a configuration.
        told: what the manipulator told last.
    """

    folder: Path
    copy: Path
    original: Path
    control: Path
    uri: str
    environment: dict[str, str]
    request: Callable[[str], None]
    told: Callable[[], Told | None]


@dataclass
class Striker:
    """Strikes; `strike` returns what was met and how it is taken back."""

    place: Place
    table: ProcessTable
    helpers: list[subprocess.Popen[str]] = field(default_factory=list)

    def strike(self, fault: Fault) -> tuple[str, Undo | None]:
        """Let a fault strike now.

        Raises:
            LeftOutError: it can't.
        """
        try:
            return _STRIKES[fault.kind](self, fault)
        except (CallError, OSError, psutil.Error, ValueError) as error:
            raise LeftOutError(" ".join(str(error).split())[:200]) from error

    # Processes

    def kill(self, fault: Fault) -> tuple[str, Undo | None]:
        """Send SIGKILL to one process of each role."""
        return self._signal(fault.targets, signal.SIGKILL)

    def interrupt(self, fault: Fault) -> tuple[str, Undo | None]:
        """Send SIGINT."""
        return self._signal(fault.targets, signal.SIGINT)

    def freeze(self, fault: Fault) -> tuple[str, Undo | None]:
        """Send SIGSTOP; SIGCONT takes it back."""
        targets = fault.targets or {Kind.FREEZE_MASTER: ("master",), Kind.CLOCK_STANDS: ("simulator",)}[fault.kind]
        return self._signal(targets, signal.SIGSTOP)

    def end_mission(self, fault: Fault) -> tuple[str, Undo | None]:
        """Kill master or simulator."""
        return self._signal(("master" if fault.kind is Kind.KILL_MASTER else "simulator",), signal.SIGKILL)

    def kill_in_change(self, fault: Fault) -> tuple[str, Undo | None]:
        """Ask for a change, and kill a process in a phase of it."""
        self._reach("starting" if fault.kind is Kind.KILL_STARTING else fault.how)
        if fault.kind is Kind.KILL_STARTING:
            fresh = [one for one in self.table.find(NODE) if one.is_running()]
            for one in fresh:
                one.kill()
            return f"{len(fresh)} processes of {NODE}", None
        return self._signal(fault.targets, signal.SIGKILL)

    def _reach(self, phase: str) -> None:
        """Ask for a change that restarts nodes, and wait for one of its phases."""
        told = self.place.told()
        running = {one for one, _ in told.functions.values()} if told else set()
        before = {process.pid for process in self.table.find(NODE)[:1]}
        self.place.request(OTHER_SENSOR[1] if any(name.endswith("_b") for name in running) else OTHER_SENSOR[0])
        end = time.monotonic() + _PHASE_S
        while time.monotonic() < end:
            told = self.place.told()
            changing = told is not None and any(state == "RECONFIGURING" for _, state in told.functions.values())
            if changing and self._is_reached(phase, before):
                return
            time.sleep(0.01)
        raise LeftOutError(f"no change came to the phase {phase}")

    def _is_reached(self, phase: str, before: set[int]) -> bool:
        if phase == "begun":
            return True
        now = self.table.sample().processes
        if {one.pid for one in now if one.role == NODE} & before:
            return False
        fresh = [one for one in now if one.role == NODE]
        return phase == "stops" or bool(fresh if phase == "starting" else [one for one in fresh if one.serves])

    def _signal(self, roles: Sequence[str], number: signal.Signals) -> tuple[str, Undo | None]:
        hit = [found[0] for role in roles if (found := self.table.find(role))]
        if len(hit) < len(roles):
            raise LeftOutError(f"not all of {', '.join(roles)} run")
        for process in hit:
            process.send_signal(number)
        told = f"{number.name} to {', '.join(roles)}, pid {', '.join(str(one.pid) for one in hit)}"

        def undo() -> None:
            for process in hit:
                if process.is_running():
                    process.send_signal(signal.SIGCONT)

        return told, undo if number == signal.SIGSTOP else None

    # Master and network

    def rewrite(self, fault: Fault) -> tuple[str, Undo | None]:
        """Rewrite a parameter of one of our nodes."""
        master = self._master()
        names = sorted(master.call("getParamNames"))
        names = [name for name in names if name.split("/")[1] in (*PARTS, NODE, "node_kit")]
        if fault.how == "drift":
            names = [name for name in names if name.startswith(f"/{NODE}/")]
        name = names[min(len(names) - 1, int(fault.pick * len(names)))]
        if fault.how == "deleted":
            name = "/".join(name.split("/")[:3])
            master.call("deleteParam", name)
            return f"{name} deleted", None
        former = master.call("getParam", name)
        value: Any = {"wrong type": "nonsense", "huge": "x" * 1_000_000}.get(fault.how)
        if value is None:
            value = former * 1.5 + 1.0 if isinstance(former, int | float) and not isinstance(former, bool) else "other"
        master.call("setParam", name, value)
        return f"{name}: {str(former)[:30]} to {str(value)[:30]}", None

    def stranger(self, fault: Fault) -> tuple[str, Undo | None]:
        """Have a stranger do it: a process of its own."""
        pick, lasts = f"{fault.pick}", f"{fault.lasts or 3.0}"
        words = {
            Kind.DATA: ["data", pick, fault.how, lasts],
            Kind.SERVICE: ["service", pick, fault.how],
            Kind.USURP: ["usurp", *fault.targets, lasts],
            Kind.CLOCK_JUMPS: ["clock", "30" if fault.how == "ahead" else "-30"],
        }[fault.kind]
        process = subprocess.Popen(
            [sys.executable, "-m", "soak.foreign", *words],
            env=self.place.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            stdin=subprocess.DEVNULL,
            text=True,
        )
        self.helpers.append(process)
        lines = process.stdout or ()
        said = next((text.strip()[len(SAYS) :] for text in lines if text.startswith(SAYS)), "")
        if not said or said.startswith("left out"):
            raise LeftOutError(said or "the stranger said nothing")
        return said, lambda: _end(process)

    def proxy(self, fault: Fault) -> tuple[str, Undo | None]:
        """Have the proxy delay, break or refuse."""
        modes = {Kind.SLOW_MASTER: f"slow {0.3 + fault.pick:.2f}", Kind.BREAKING_MASTER: "break"}
        mode = modes.get(fault.kind, "refuse")
        self.place.control.write_text(mode)
        if fault.kind is Kind.BREAKING_MASTER:
            time.sleep(_BREAK_S)
            self.place.control.unlink()
        return mode, lambda: self.place.control.unlink(missing_ok=True)

    def deaf(self, fault: Fault) -> tuple[str, Undo | None]:
        """Subscribe to all that a node publishes, and read nothing."""
        open_sockets: list[socket.socket] = []
        with Client(self._master().call("lookupNode", f"/{fault.targets[0]}"), "/soak_deaf") as api:
            topics = [topic for topic, _ in api.call("getPublications")]
            for topic in topics:
                _, host, port = api.call("requestTopic", topic, [["TCPROS"]])
                one = socket.create_connection((host, port), 2.0)
                one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                one.sendall(_tcpros(callerid="/soak_deaf", topic=topic, md5sum="*", type="*", tcp_nodelay="0"))
                open_sockets.append(one)
        return f"{len(topics)} topics of {fault.targets[0]}", lambda: _close(open_sockets)

    def half_open(self, fault: Fault) -> tuple[str, Undo | None]:
        """Open connections to a node's ports, and say half of something."""
        address = urlparse(self._master().call("lookupNode", f"/{fault.targets[0]}"))
        process = self.table.find(fault.targets[0])[0]
        ports = {one.laddr.port for one in process.net_connections("tcp") if one.status == psutil.CONN_LISTEN}
        open_sockets = []
        for port in sorted(ports):
            for number in range(CONNECTIONS):
                one = socket.create_connection((address.hostname or "localhost", port), 2.0)
                one.sendall(HALVES[number % len(HALVES)])
                open_sockets.append(one)
        return f"{len(open_sockets)} connections to {fault.targets[0]}", lambda: _close(open_sockets)

    def _master(self) -> Client:
        return Client(self.place.uri, "/soak")

    # Machine and files

    def fill_disk(self, fault: Fault) -> tuple[str, Undo | None]:
        """Fill the disk of the mission's output."""
        if not self.place.folder.is_mount():
            raise LeftOutError("no small disk could be mounted: that takes root's rights")
        path = self.place.folder / _BALLAST
        filled = 0
        with path.open("wb", buffering=0) as ballast, contextlib.suppress(OSError):
            while True:
                filled += ballast.write(bytes(_BLOCK))
        return f"{filled / 1e6:.0f} MB filled", lambda: path.unlink(missing_ok=True)

    def limit(self, fault: Fault) -> tuple[str, Undo | None]:
        """Let a process have no more memory or descriptors than it has."""
        found = self.table.find(fault.targets[0])
        if not found:
            raise LeftOutError(f"{fault.targets[0]} does not run")
        process = found[0]
        kind = resource.RLIMIT_AS if fault.kind is Kind.MEMORY else resource.RLIMIT_NOFILE
        former = process.rlimit(kind)
        now = process.memory_info().vms + 4_000_000 if fault.kind is Kind.MEMORY else process.num_fds()
        process.rlimit(kind, (now, former[1]))

        def undo() -> None:
            if process.is_running():
                process.rlimit(kind, former)

        return f"{fault.targets[0]}, {now}", undo

    def take_cpu(self, fault: Fault) -> tuple[str, Undo | None]:
        """Let other processes work."""
        busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(BUSY)]

        def undo() -> None:
            for process in busy:
                process.kill()
                process.wait()

        return f"{BUSY} busy processes", undo

    def spoil_files(self, fault: Fault) -> tuple[str, Undo | None]:
        """Spoil files of the mission's copy."""
        (name,) = fault.targets
        top = self.place.copy / name
        files = [top] if top.is_file() else sorted(one for one in top.rglob("*") if one.is_file())
        for one in files:
            if fault.how == "deleted":
                one.unlink()
            else:
                told = one.read_bytes()
                one.write_bytes(told[: len(told) // 2] if fault.how == "truncated" else b"<changed>" + told[9:])

        def undo() -> None:
            for one in files:
                shutil.copyfile(self.place.original / one.relative_to(self.place.copy), one)

        return f"{name}, {len(files)} files {fault.how}", undo


def _tcpros(**fields: str) -> bytes:
    """Return the header by which a subscriber begins."""
    told = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(len(one).to_bytes(4, "little") + one for one in told)
    return len(body).to_bytes(4, "little") + body


def _close(sockets: Sequence[socket.socket]) -> None:
    for one in sockets:
        one.close()


def _end(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        process.kill()
    process.wait()


_STRIKES: dict[Kind, Callable[[Striker, Fault], tuple[str, Undo | None]]] = {
    Kind.KILL: Striker.kill,
    Kind.KILL_TWO: Striker.kill,
    Kind.FREEZE: Striker.freeze,
    Kind.FREEZE_FOR_GOOD: Striker.freeze,
    Kind.FREEZE_MASTER: Striker.freeze,
    Kind.CLOCK_STANDS: Striker.freeze,
    Kind.INTERRUPT: Striker.interrupt,
    Kind.KILL_IN_CHANGE: Striker.kill_in_change,
    Kind.KILL_STARTING: Striker.kill_in_change,
    Kind.KILL_SIMULATOR: Striker.end_mission,
    Kind.KILL_MASTER: Striker.end_mission,
    Kind.PARAMETERS: Striker.rewrite,
    Kind.USURP: Striker.stranger,
    Kind.DATA: Striker.stranger,
    Kind.SERVICE: Striker.stranger,
    Kind.CLOCK_JUMPS: Striker.stranger,
    Kind.SLOW_MASTER: Striker.proxy,
    Kind.BREAKING_MASTER: Striker.proxy,
    Kind.REFUSING_MASTER: Striker.proxy,
    Kind.DEAF_SUBSCRIBER: Striker.deaf,
    Kind.HALF_OPEN: Striker.half_open,
    Kind.DISK_FULL: Striker.fill_disk,
    Kind.MEMORY: Striker.limit,
    Kind.DESCRIPTORS: Striker.limit,
    Kind.CPU: Striker.take_cpu,
    Kind.FILES: Striker.spoil_files,
}
