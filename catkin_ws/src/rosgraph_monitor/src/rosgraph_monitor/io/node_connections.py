"""Holds a connection to each node and probes it, all in one thread; the decisions are in `liveness`."""

from __future__ import annotations

import contextlib
import errno
import logging
import re
import selectors
import socket
import threading
import time
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from node_kit.io.background import again_and_again

from rosgraph_monitor.health import liveness
from rosgraph_monitor.health.liveness import Action, Life, Liveness, Timing

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

_log = logging.getLogger(__name__)

_SWEEP = 0.05
"""Wall seconds between looks at the deadlines of all nodes."""
_LONGEST_ANSWER = 65536
# Answers come in pieces on sockets that never block, which http.client can't read. It and xmlrpc.client also take 99 us
# for an answer of rospy, these expressions 2.3 us (300 nodes that are probed once a second: 3 % of a core, 0.07 %).
_HEAD_END = b"\r\n\r\n"
_CONTENT_LENGTH = re.compile(rb"^content-length:\s*(\d+)\s*$", re.IGNORECASE | re.MULTILINE)
_CHUNKED = re.compile(rb"^transfer-encoding:.*\bchunked\s*$", re.IGNORECASE | re.MULTILINE)
_CHUNK_SIZE = re.compile(rb"([0-9a-f]{1,8})[ \t]*(?:;[^\r\n]*)?\r\n", re.IGNORECASE)
_LONGEST_TIMEOUT = 2**31 - 1
"""ms. What a socket takes."""
_INTEGERS = re.compile(rb"<(?:int|i4)>\s*(-?\d+)\s*</(?:int|i4)>")

Key = tuple[str, str]
"""A node: its resolved name and the address of its API. A restarted node has another address."""


@dataclass
class _Target:
    key: Key
    host: str
    port: int
    request: bytes
    state: Liveness = field(default_factory=Liveness)
    socket: socket.socket | None = None
    received: bytearray = field(default_factory=bytearray)
    pid: int | None = None
    due_at: float = 0.0


class NodeConnections:
    """Watches given nodes. Start it once, and close it at the end. Any thread may call its methods."""

    def __init__(self, on_change: Callable[[], None], timing: Timing = Timing(), caller_id: str = "/watcher") -> None:  # noqa: B008 - frozen
        """Prepare.

        Args:
            on_change: called in the watching thread whenever what is known of a node changes.
            timing: periods and deadlines.
            caller_id: name under which nodes are asked.
        """
        self._on_change = on_change
        self._timing = timing
        self._caller_id = caller_id
        self._selector = selectors.DefaultSelector()
        self._waker, self._wakened = socket.socketpair()
        self._waker.setblocking(False)
        self._wakened.setblocking(False)
        self._selector.register(self._wakened, selectors.EVENT_READ, None)
        self._lock = threading.Lock()
        self._wanted: frozenset[Key] = frozenset()
        self._known: dict[Key, tuple[Life, int | None]] = {}
        self._addresses: dict[str, tuple[int, str] | None] = {}
        self._resolving: set[str] = set()
        self._closing = False
        self._sweep_at = 0.0  # monotonic s
        self._targets: dict[Key, _Target] = {}
        self._thread = threading.Thread(target=self._run, name="liveness", daemon=True)

    def start(self) -> None:
        """Begin to watch."""
        self._thread.start()

    def close(self) -> None:
        """Stop watching and close all connections."""
        with self._lock:
            self._closing = True
        self._wake()
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def watch(self, nodes: Mapping[str, str]) -> None:
        """Watch these nodes and no others, given as address by name."""
        wanted = frozenset(nodes.items())
        with self._lock:
            changed = wanted != self._wanted
            self._wanted = wanted
        if changed:
            self._wake()

    def lives(self) -> dict[Key, Life]:
        """Return what is known of each node."""
        with self._lock:
            return {key: life for key, (life, _) in self._known.items()}

    def pids(self) -> dict[Key, int]:
        """Return the process id, on its own host, of each live node."""
        with self._lock:
            return {key: pid for key, (life, pid) in self._known.items() if pid is not None and life is Life.ALIVE}

    # All below runs in the watching thread.

    def _run(self) -> None:
        again_and_again(self._look, lambda: not self._closing)
        for target in self._targets.values():
            self._drop(target)
        self._selector.close()
        self._waker.close()
        self._wakened.close()

    def _look(self) -> None:
        with self._lock:
            wanted = self._wanted
        self._retarget(wanted)
        now = time.monotonic()
        if now >= self._sweep_at:
            self._sweep_at = now + _SWEEP
            for target in list(self._targets.values()):
                if now >= target.due_at:
                    self._guarded(target, self._step)
        for key, events in self._selector.select(max(self._sweep_at - time.monotonic(), 0.0)):
            if key.data is None:
                self._drain()
                self._sweep_at = 0.0
            else:
                self._guarded(key.data, partial(self._handle, events=events))

    def _guarded(self, target: _Target, do: Callable[[_Target], None]) -> None:
        """Do something about a node; an error that nobody foresaw costs its connection, and no other node's."""
        try:
            do(target)
        except Exception:
            _log.exception("%s is asked anew", target.key[0])
            self._drop(target)
            target.state = liveness.on_no_socket(target.state, time.monotonic(), self._timing)
            target.due_at = liveness.due_at(target.state, self._timing)

    def _retarget(self, wanted: frozenset[Key]) -> None:
        if wanted == self._targets.keys():
            return
        for key in self._targets.keys() - wanted:
            self._drop(self._targets.pop(key))
        for key in wanted - self._targets.keys():
            self._targets[key] = self._target(key)
        with self._lock:
            self._known = {key: (target.state.life, target.pid) for key, target in self._targets.items()}

    def _target(self, key: Key) -> _Target:
        try:
            parts = urlsplit(key[1])
            host, port = parts.hostname or "", parts.port or 0
        except ValueError:
            host, port = "", 0
        body = (
            "<?xml version='1.0'?><methodCall><methodName>getPid</methodName><params><param><value><string>"
            f"{self._caller_id}</string></value></param></params></methodCall>"
        ).encode()
        head = (
            f"POST /RPC2 HTTP/1.1\r\nHost: {host}:{port}\r\n"
            f"Content-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        return _Target(key, host, port, head.encode("ascii", "replace") + body)

    def _step(self, target: _Target) -> None:
        now = time.monotonic()
        state, action = liveness.due(target.state, now, self._timing)
        self._become(target, state)
        if action is Action.CONNECT or (state.connecting_since is not None and target.socket is None):
            self._connect(target)
        elif action is Action.PROBE:
            self._send(target)
        elif action is Action.DROP:
            self._drop(target)
            self._resolve(target.host)

    def _become(self, target: _Target, state: Liveness) -> None:
        changed = state.life is not target.state.life
        target.state = state
        target.due_at = liveness.due_at(state, self._timing)
        if changed:
            with self._lock:
                self._known[target.key] = (state.life, target.pid)
            self._on_change()

    def _connect(self, target: _Target) -> None:
        now = time.monotonic()
        if not target.host or not target.port:
            self._become(target, liveness.on_unreachable(target.state, now, self._timing))
            return
        with self._lock:
            resolved = target.host in self._addresses
            address = self._addresses.get(target.host)
        if not resolved:
            # The attempt goes on when the name has an address; the deadline of a connection holds for both.
            target.due_at = 0.0
            self._resolve(target.host)
            return
        if address is None:
            self._forget_address(target.host)
            self._become(target, liveness.on_unreachable(target.state, now, self._timing))
            return
        family, host = address
        target.received.clear()
        try:
            target.socket = socket.socket(family, socket.SOCK_STREAM)
        except OSError as refused:  # no more file descriptors
            _log.warning("no socket to watch %s: %s", target.key[0], refused)
            self._become(target, liveness.on_no_socket(target.state, now, self._timing))
            return
        target.socket.setblocking(False)
        target.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        confirmation = round(min(1000 * self._timing.confirmation_deadline, _LONGEST_TIMEOUT))
        target.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, confirmation)
        error = target.socket.connect_ex((host, target.port))
        if error in (0, errno.EINPROGRESS):
            self._selector.register(target.socket, selectors.EVENT_WRITE, target)
        else:
            self._connection_failed(target, error)

    def _connection_failed(self, target: _Target, error: int) -> None:
        self._drop(target)
        self._resolve(target.host)
        self._become(target, liveness.on_connect_error(target.state, error, time.monotonic(), self._timing))

    def _handle(self, target: _Target, events: int) -> None:
        if target.socket is None:
            return
        if target.state.connecting_since is not None:
            error = target.socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if error:
                self._connection_failed(target, error)
                return
            self._selector.modify(target.socket, selectors.EVENT_READ, target)
            self._become(target, liveness.on_connected(target.state, time.monotonic()))
            self._step(target)
        elif events & selectors.EVENT_READ:
            self._receive(target)

    def _send(self, target: _Target) -> None:
        try:
            # A few hundred bytes into an empty buffer: it takes all or the connection is of no use.
            if target.socket is None or target.socket.send(target.request) != len(target.request):
                self._closed(target)
        except OSError as error:
            self._closed(target, error.errno or 0)

    def _receive(self, target: _Target) -> None:
        if target.socket is None:
            return
        try:
            data = target.socket.recv(_LONGEST_ANSWER)
        except BlockingIOError:
            return
        except OSError as error:
            self._closed(target, error.errno or 0)
            return
        target.received += data
        answer = _answer(target.received, is_closed=not data)
        if answer is None and data and len(target.received) <= _LONGEST_ANSWER:
            return
        target.received.clear()
        if answer is not None:
            self._take(target, answer)
        if answer is None or not data:
            self._closed(target)

    def _take(self, target: _Target, answer: bytes) -> None:
        integers = [int(number) for number in _INTEGERS.findall(answer)]
        # [1, message, pid]; whatever else it says, it answers.
        target.pid = integers[-1] if len(integers) >= 2 and integers[0] == 1 else None
        self._become(target, liveness.on_answer(target.state, time.monotonic(), self._timing))

    def _closed(self, target: _Target, error: int = 0) -> None:
        self._drop(target)
        self._become(target, liveness.on_broken(target.state, error, time.monotonic(), self._timing))
        if target.state.life is not Life.ALIVE:  # another host may have got the address
            self._resolve(target.host)
        self._step(target)

    def _drop(self, target: _Target) -> None:
        if target.socket is not None:
            with contextlib.suppress(KeyError):  # an attempt that failed at once was never registered
                self._selector.unregister(target.socket)
            target.socket.close()
            target.socket = None

    def _drain(self) -> None:
        try:
            while self._wakened.recv(4096):
                pass
        except BlockingIOError:
            return

    def _wake(self) -> None:
        try:
            self._waker.send(b"x")
        except OSError:
            return  # full: it will wake anyway; closed: there is nobody to wake

    def _resolve(self, host: str) -> None:
        """Look up a host's address in a thread of its own, so that a silent name server delays nothing else.

        The address that is known stays in use until then, and where the lookup fails.
        """
        with self._lock:
            if host in self._resolving:
                return
            self._resolving.add(host)
        try:
            threading.Thread(target=self._look_up, args=(host,), name=f"resolve {host}", daemon=True).start()
        except RuntimeError as error:  # as many threads as there may be: it is tried again, as after a failed lookup
            _log.warning("%s is not looked up: %s", host, error)
            self._found(host, None)

    def _look_up(self, host: str) -> None:
        address = None
        try:
            found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
            families = sorted(found, key=lambda entry: entry[0] != socket.AF_INET)
            address = (int(families[0][0]), str(families[0][4][0]))
        except (OSError, UnicodeError, IndexError) as error:
            _log.debug("%s: %s", host, error)
        finally:
            self._found(host, address)

    def _found(self, host: str, address: tuple[int, str] | None) -> None:
        with self._lock:
            self._addresses[host] = address or self._addresses.get(host)
            self._resolving.discard(host)
        self._wake()

    def _forget_address(self, host: str) -> None:
        with self._lock:
            self._addresses.pop(host, None)


def _answer(received: bytearray, is_closed: bool) -> bytes | None:
    """Return the body of an HTTP answer once it is whole: it tells its length, has chunks, or ends with the connection.

    Args:
        received: head and body, as far as they have come.
        is_closed: whether no more comes.
    """
    head, end, body = bytes(received).partition(_HEAD_END)
    head = head.replace(b"\r\n", b"\n")
    if not end:
        return None
    if _CHUNKED.search(head):
        return _joined(body)
    length = _CONTENT_LENGTH.search(head)
    if not length:
        return body if is_closed else None
    return body[: int(length[1])] if len(body) >= int(length[1]) else None


def _joined(body: bytes) -> bytes | None:
    """Return what is in the chunks of a body once the last one, of size 0, and the trailer have come."""
    parts: list[bytes] = []
    at = 0
    while size := _CHUNK_SIZE.match(body, at):
        begin, length = size.end(), int(size[1], 16)
        if length == 0:
            is_whole = body.startswith(b"\r\n", begin) or _HEAD_END in body[begin:]
            return b"".join(parts) if is_whole else None
        parts.append(body[begin : begin + length])
        at = begin + length + 2
    return None
