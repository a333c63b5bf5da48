"""Calls of the XML-RPC APIs that the ROS master and each node offer, every one with a deadline."""

from __future__ import annotations

import http.client
import socket
import time
import xmlrpc.client
from typing import TYPE_CHECKING, Any
from xml.parsers.expat import ExpatError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType

TIMEOUT = 1.5
"""Wall s in which a whole answer must have come."""
MASTER = "ROS master"

_SUCCESS = 1
_SHORTEST_TIMEOUT = 0.001


class CallError(Exception):
    """A call has failed; one line that names the callee, the call and the failure."""

    def __init__(self, message: str, reason: str = "") -> None:
        super().__init__(message)
        self.reason = reason or message
        """What came of it alone."""


class GoneError(CallError):
    """Nobody listens at the address."""


class SilentError(CallError):
    """There was no answer in time, or the connection broke."""


class GarbageError(CallError):
    """The answer makes no sense."""


class DeniedError(CallError):
    """The callee answers that it can't do the call."""


class Client:
    """A client of one API. It keeps its connection from call to call. Only one thread at a time may use it.

    The lookup of a host name has no deadline: the system's resolver has a timeout of its own.
    """

    def __init__(
        self, uri: str, caller: str, timeout: float = TIMEOUT, peer: str = MASTER, kept_answers: int = 0
    ) -> None:
        """Prepare; nothing is connected yet.

        Args:
            uri: address of the API, e.g. `http://localhost:11311`.
            caller: resolved name of the node that calls.
            timeout: wall s in which a whole answer must have come.
            peer: what errors call the one that offers the API.
            kept_answers: an answer that is byte for byte among so many latest ones is not unpacked again but is the
                same object, which nobody may change.

        Raises:
            CallError: it is no http address.
        """
        self.uri = uri
        self._caller, self._timeout, self._kind = caller, timeout, peer
        self._peer = f"{peer} {uri}"
        self._transport = _Transport(kept_answers)
        try:
            self._proxy = xmlrpc.client.ServerProxy(uri, transport=self._transport)
        except (OSError, ValueError) as error:
            remedy = ": set ROS_MASTER_URI" if peer == MASTER else ""
            raise CallError(f"{peer} address {uri!r}: {error}{remedy}", str(error)) from error

    def __enter__(self) -> Client:
        """Return the client."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the connection."""
        self.close()

    def close(self) -> None:
        """Close the connection; the next call opens a new one."""
        self._transport.close()

    def call(self, method: str, *arguments: Any, timeout: float | None = None) -> Any:
        """Call a method; return its value.

        Args:
            method: its name.
            arguments: those behind the caller's name.
            timeout: wall s for this call, where it is not the usual time.

        Raises:
            GoneError, SilentError, GarbageError, DeniedError: it has failed.
        """
        answer = self._request(method, (self._caller, *arguments), timeout)
        if not isinstance(answer, list) or len(answer) != 3 or not isinstance(answer[0], int):
            raise GarbageError(f"{self._peer}: no useful answer to {method}", "no useful answer")
        code, text, value = answer
        if code != _SUCCESS:
            raise DeniedError(f"{self._peer} refuses {method}: {text}", str(text))
        return value

    def pid(self, timeout: float | None = None) -> int:
        """Return the process id that the callee tells.

        Args:
            timeout: as for `call`.

        Raises:
            GoneError, SilentError, GarbageError, DeniedError: it tells none.
        """
        told = self.call("getPid", timeout=timeout)
        try:
            return int(told)
        except (TypeError, ValueError, OverflowError) as error:
            reason = f"its process id is {told!r}"
            raise GarbageError(f"{self._peer}: {reason}", reason) from error

    def call_all(self, calls: Sequence[tuple[Any, ...]]) -> list[tuple[bool, Any]]:
        """Make many calls (method, argument, ...) in one request. Return for each whether it succeeded, and its value.

        Raises:
            GoneError, SilentError, GarbageError: the request has failed.
        """
        if not calls:
            return []
        method = "system.multicall"
        requests = [{"methodName": name, "params": [self._caller, *arguments]} for name, *arguments in calls]
        answers = self._request(method, (requests,), None)
        if not isinstance(answers, list) or len(answers) != len(calls):
            raise GarbageError(f"{self._peer}: no useful answer to {method}", "no useful answer")
        return [_outcome(answer) for answer in answers]

    def _request(self, method: str, parameters: tuple[Any, ...], timeout: float | None) -> Any:
        self._transport.deadline = time.monotonic() + (self._timeout if timeout is None else timeout)
        call = getattr(self._proxy, method)
        try:
            try:
                return call(*parameters)
            except (ConnectionResetError, BrokenPipeError):
                # It has closed the connection, or is ending in the middle of the call: the next attempt tells.
                self.close()
                return call(*parameters)
        except ConnectionRefusedError as error:
            self.close()
            raise GoneError(f"no {self._kind} answers at {self.uri} ({error.strerror})", str(error)) from error
        except (OSError, http.client.HTTPException) as error:
            self.close()
            reason = str(error) or type(error).__name__
            raise SilentError(f"{self._peer} does not answer {method}: {reason}", reason) from error
        except (xmlrpc.client.Error, ExpatError, ArithmeticError, LookupError, TypeError, ValueError) as error:
            self.close()
            raise GarbageError(f"{self._peer}: answer to {method} is garbage: {error}", str(error)) from error


def _outcome(answer: Any) -> tuple[bool, Any]:
    """Return whether one of many calls succeeded, and its value."""
    answer = answer[0] if isinstance(answer, list) and len(answer) == 1 else None
    if not isinstance(answer, list) or len(answer) != 3 or answer[0] != _SUCCESS:
        return False, None
    return True, answer[2]


class _Transport(xmlrpc.client.Transport):
    """A transport whose calls end at a deadline, even if the answer arrives slowly.

    It does not ask for compressed answers. On a robot, compression takes both sides longer than it saves, and it makes
    equal answers look different.
    """

    accept_gzip_encoding = False
    deadline = 0.0
    """In time.monotonic."""

    def __init__(self, kept_answers: int) -> None:
        super().__init__()
        self._kept = kept_answers
        self._unpacked: dict[bytes, Any] = {}

    def parse_response(self, response: Any) -> Any:
        """Unpack an answer."""
        body = response.read()
        if body in self._unpacked:
            answer = self._unpacked.pop(body)
        else:
            parser, unmarshaller = self.getparser()
            parser.feed(body)
            parser.close()
            answer = unmarshaller.close()
        self._unpacked[body] = answer  # at the end: the first is the one that was not seen for longest
        if len(self._unpacked) > self._kept:
            del self._unpacked[next(iter(self._unpacked))]
        return answer

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        """Return the kept connection, with the deadline of this call."""
        if not self._connection or host != self._connection[0]:
            name, self._extra_headers, _ = self.get_host_info(host)
            self._connection = host, _Connection(name)
        self._connection[1].deadline = self.deadline  # type: ignore[union-attr]
        return self._connection[1]  # type: ignore[return-value]


class _Connection(http.client.HTTPConnection):
    """A connection that has a deadline."""

    deadline = 0.0

    def connect(self) -> None:
        """Connect within the remaining time."""
        self.timeout = max(self.deadline - time.monotonic(), _SHORTEST_TIMEOUT)
        super().connect()
        plain = self.sock
        self.sock = _DeadlineSocket(plain.family, plain.type, plain.proto, fileno=plain.detach())

    def send(self, data: Any) -> None:
        """Connect if there is no connection yet, and send. The answer has the same deadline."""
        if self.sock is None:
            self.connect()
        if isinstance(self.sock, _DeadlineSocket):
            self.sock.deadline = self.deadline
        super().send(data)


class _DeadlineSocket(socket.socket):
    """A socket with one deadline for all that it sends and receives, however small the pieces are."""

    deadline = 0.0

    def recv_into(self, *arguments: Any, **options: Any) -> int:
        """Receive within the remaining time."""
        self._hurry()
        return super().recv_into(*arguments, **options)

    def sendall(self, *arguments: Any, **options: Any) -> None:
        """Send within the remaining time."""
        self._hurry()
        super().sendall(*arguments, **options)

    def _hurry(self) -> None:
        left = self.deadline - time.monotonic()
        if left <= 0.0:
            raise TimeoutError("timed out")
        self.settimeout(left)
