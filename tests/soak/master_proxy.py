"""Stands before a ROS master: `python -m soak.master_proxy REAL_PORT FILE --core -p PORT ...`, as rosmaster is called.

It passes bytes on. FILE says how: `slow S` delays each connection's answers by S s, `break` breaks all connections as
soon as they are made, `refuse` refuses them and breaks those that are open, anything else lets all pass. It starts the
real master, and ends with it.
"""

from __future__ import annotations

import contextlib
import os
import selectors
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

_POLL_S = 0.02


def main() -> None:
    """Run the master and pass on what is said to it."""
    real, control, *words = sys.argv[1:]
    place = words.index("-p") + 1
    port, words[place] = words[place], real
    master = subprocess.Popen([_real_master(), *words])

    def end(number: int, _frame: object) -> None:
        master.send_signal(number)

    signal.signal(signal.SIGINT, end)
    signal.signal(signal.SIGTERM, end)
    proxy = Proxy(int(port), int(real), Path(control))
    threading.Thread(target=proxy.serve, daemon=True).start()
    sys.exit(master.wait())


def _real_master() -> str:
    """Return the master's program; the first one of that name on PATH has started this."""
    _, _, others = os.environ["PATH"].partition(os.pathsep)
    found = shutil.which("rosmaster", path=others)
    if found is None:
        raise FileNotFoundError("rosmaster")
    return found


class Proxy:
    """Passes connections on."""

    def __init__(self, port: int, real: int, control: Path) -> None:
        """Take the ports, and the file that says how."""
        self._port, self._real, self._control = port, real, control
        self._open: set[socket.socket] = set()

    def serve(self) -> None:
        """Take connections for ever."""
        listening: socket.socket | None = None
        while True:
            mode = self._mode()[0]
            if mode in ("break", "refuse"):
                for one in list(self._open):
                    _close(one)
            if mode == "refuse":
                if listening is not None:
                    listening.close()
                    listening = None
                time.sleep(_POLL_S)
                continue
            if listening is None:
                listening = _listen(self._port)
            listening.settimeout(_POLL_S)
            try:
                client, _ = listening.accept()
            except TimeoutError:
                continue
            if mode == "break":
                _close(client)
                continue
            client.settimeout(None)
            threading.Thread(target=self._pass, args=(client,), daemon=True).start()

    def _mode(self) -> list[str]:
        try:
            return self._control.read_text().split() or [""]
        except OSError:
            return [""]

    def _pass(self, client: socket.socket) -> None:
        try:
            real = socket.create_connection(("127.0.0.1", self._real))
        except OSError:
            _close(client)
            return
        both = {client: real, real: client}
        self._open |= set(both)
        with selectors.DefaultSelector() as ready:
            for one in both:
                ready.register(one, selectors.EVENT_READ)
            try:
                while self._pass_once(both, ready, real):
                    pass
            except OSError:
                pass
        self._open -= set(both)
        for one in both:
            _close(one)

    def _pass_once(self, both: dict[socket.socket, socket.socket], ready: selectors.BaseSelector, real: object) -> bool:
        for key, _ in ready.select(1.0):
            source = key.fileobj
            if not isinstance(source, socket.socket):
                continue
            told = source.recv(65536)
            if not told:
                return False
            mode = self._mode()
            if mode[0] == "slow" and source is real:
                time.sleep(float(mode[1]))
            both[source].sendall(told)
        return True


def _listen(port: int) -> socket.socket:
    listening = socket.socket()
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listening.bind(("", port))
    listening.listen(64)
    return listening


def _close(one: socket.socket) -> None:
    with contextlib.suppress(OSError):
        one.shutdown(socket.SHUT_RDWR)
    one.close()


if __name__ == "__main__":
    main()
