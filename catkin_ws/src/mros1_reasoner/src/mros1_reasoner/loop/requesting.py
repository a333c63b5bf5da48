"""Requests to the manipulator: when each one is sent, how long it is waited for, and what its end means.

Times are arguments or come from one wall clock that never goes back, in s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from metacontrol_msgs.msg import ReconfigurationResult

SERVER_WAIT = 1.0  # s, wall, at most, for the connections to the manipulator: after a start they may be on their way
SERVER_LOOK = 0.02  # s, wall, between two looks whether they are there
ACKNOWLEDGE_WAIT = 5.0  # s, wall, until a request must be acknowledged: else its manipulator has died with it
RELEASE_WAIT = 5.0  # s, wall, until a release that has failed is tried again
_MEANINGS = {
    ReconfigurationResult.FAILED: "the manipulator restored the former one",
    ReconfigurationResult.UNKNOWN_CONFIGURATION: "the manipulator does not know it",
}


@dataclass(frozen=True)
class Wanted:
    """What the manipulator is asked for.

    Attributes:
        function: what it is about.
        configuration: to deploy; empty: the function is to be released.
        restart: resolved names of nodes to restart even if they do not differ.
        is_first: nothing runs for the function, so that there is nothing to restore.
    """

    function: str
    configuration: str = ""
    restart: tuple[str, ...] = ()
    is_first: bool = False

    @property
    def needs_more(self) -> bool:
        """Whether the published action can't say it."""
        return bool(self.restart) or not self.configuration


@dataclass(frozen=True)
class Answer:
    """How a goal of the manipulator has ended.

    Attributes:
        succeeded: whether its status says so.
        text: of its status or its result; empty: none.
        code: of its result; None: there is no result.
    """

    succeeded: bool
    text: str
    code: int | None


class Handle(Protocol):
    """A goal of the manipulator."""

    def is_acknowledged(self) -> bool:
        """Tell whether the manipulator has told of it."""

    def cancel(self) -> None:
        """Take it back."""


class Client(Protocol):
    """An action of the manipulator."""

    @property
    def name(self) -> str:
        """Full name of the action."""

    def is_there(self) -> bool:
        """Tell at once whether the manipulator is connected."""

    def send(self, wanted: Wanted, done: Callable[[Answer], object]) -> Handle:
        """Send a goal; `done` is called in the loop's thread when it has ended."""


class Trouble(Protocol):
    """Tells others while reconfigurations fail."""

    def __call__(self, failures: int, reason: str) -> object:
        """Tell so many failed attempts in a row, and why the last one failed; 0: reconfiguration works again."""


@dataclass
class _Request:
    decision: str  # empty: a release
    wanted: Wanted
    ends: float = 0.0  # wall time
    handle: Handle | None = None  # None: it could not be sent yet
    unheard: float = math.inf  # wall time after which it must be acknowledged; infinite where it is


class Requesting:
    """Asks the manipulator for configurations, one at a time."""

    def __init__(
        self,
        client: Client,
        change: Client,
        deadline: float,
        clock: Callable[[], float],
        report: Callable[..., None],
        report_released: Callable[[str], object],
        warn: Callable[[str], None],
        trouble: Trouble,
    ) -> None:
        """Begin without a request.

        Args:
            client: the published action.
            change: the action that can restart nodes and release functions.
            deadline: a request without a result has failed after so long, s of wall time.
            clock: returns wall s.
            report: is called when a request has ended, with its decision, whether it was carried out, why not, and
                `blame`: whether that is the configuration's fault.
            report_released: is called when a function was released.
            warn: tells a problem.
            trouble: tells others while reconfigurations fail.
        """
        self._client, self._change, self._deadline, self._clock = client, change, deadline, clock
        self._report, self._report_released, self._warn, self._trouble_told = report, report_released, warn, trouble
        self._request: _Request | None = None
        self._next: _Request | None = None  # a decision that waits for the end of a release
        self._failures, self._trouble = 0, ""
        self._release_after = clock() + SERVER_WAIT
        self._has_warned = False

    def ask(self, decision: str, wanted: Wanted) -> None:
        """Ask for a configuration; call `report` when it runs, has failed, or nobody has answered in time."""
        request = _Request(decision, wanted)
        if self._request is not None and not self._request.decision:
            self._next = request
        else:
            self._begin(request)

    def release(self, functions: Sequence[str]) -> None:
        """Have the first one of some functions released, unless something else is under way."""
        if not functions or self._request is not None or self._clock() < self._release_after:
            return
        if self._change.is_there():
            self._begin(_Request("", Wanted(functions[0])))
        else:
            self._release_after = self._clock() + RELEASE_WAIT
            self._warn_of_absence(f"{', '.join(functions)} can't be released and may go on running")

    def keep_what_runs(self, function: str) -> None:
        """Give up a request for the first configuration of a function that could not be sent yet: something runs."""
        request = self._request
        if request and request.handle is None and request.wanted.is_first and request.wanted.function == function:
            self._end(request, False, "a configuration runs already", blame=False)

    def look(self) -> None:
        """Send a request that could not be sent before; give up one that takes too long."""
        request = self._request
        if request is None:
            return
        if request.handle is None and (client := self._client_for(request)):
            request.ends = self._clock() + self._deadline
            request.unheard = self._clock() + ACKNOWLEDGE_WAIT
            request.handle = client.send(request.wanted, lambda answer: self._take_answer(request, answer))
            return
        if request.handle is not None and request.handle.is_acknowledged():
            request.unheard = math.inf
        if self._clock() < min(request.ends, request.unheard):
            return
        if request.handle is None:
            self._end(request, False, f"the manipulator's action server {self._client.name} is not there", blame=False)
        elif self._clock() >= request.unheard:
            request.handle.cancel()
            self._end(request, False, f"the manipulator has said nothing of it in {ACKNOWLEDGE_WAIT:g} s", blame=False)
        else:
            request.handle.cancel()
            self._end(request, False, f"no result within {self._deadline:g} s")

    @property
    def next_look(self) -> float:
        """The wall time of the next `look`."""
        if self._request is None:
            return math.inf
        if self._request.handle is None:
            return self._clock() + SERVER_LOOK
        return min(self._request.ends, self._request.unheard)

    def tell_trouble(self, *, is_over: bool = False) -> None:
        """Tell others while reconfigurations fail, and once more when they succeed again."""
        if self._trouble or is_over:
            self._trouble_told(0 if is_over else self._failures, self._trouble)

    def _begin(self, request: _Request) -> None:
        request.ends = self._clock() + SERVER_WAIT
        self._request = request
        self.look()

    def _client_for(self, request: _Request) -> Client | None:
        """Return the action by which a request can be made now; None if there is none yet."""
        if request.wanted.needs_more:
            if self._change.is_there():
                return self._change
            if self._clock() < request.ends or not request.wanted.configuration:
                return None
            self._warn_of_absence(f"{', '.join(request.wanted.restart)} may go on hanging")
        return self._client if self._client.is_there() else None

    def _warn_of_absence(self, what_follows: str) -> None:
        if not self._has_warned:
            self._has_warned = True
            name = self._change.name
            self._warn(f"the manipulator has no action {name}: {what_follows}: update rosgraph_manipulator")

    def _take_answer(self, request: _Request, answer: Answer) -> None:
        ok = answer.code == ReconfigurationResult.OK and answer.succeeded
        unknown = "the manipulator gave no result"
        reason = answer.text or _MEANINGS.get(-2 if answer.code is None else answer.code, unknown)
        # Where nothing ran before there is nothing to restore, which is a general error.
        failed_first = request.wanted.is_first and answer.code == ReconfigurationResult.GENERAL_ERROR
        self._end(request, ok, "" if ok else reason, blame=answer.code in _MEANINGS or failed_first)

    def _end(self, request: _Request, ok: bool, message: str, *, blame: bool = True) -> None:
        if request is not self._request:
            return  # its result came after the deadline
        self._request = None
        if request.decision:
            was_in_trouble = bool(self._trouble)
            self._failures, self._trouble = (0, "") if ok else (self._failures + 1, message)
            self._report(request.decision, ok, message, blame=blame)
            if was_in_trouble or not ok:
                self.tell_trouble(is_over=ok)
        elif ok:
            self._report_released(request.wanted.function)
        else:
            self._release_after = self._clock() + RELEASE_WAIT
            self._warn(f"{request.wanted.function} was not released: {message}: it is tried again")
        if self._next is not None:
            waiting, self._next = self._next, None
            self._begin(waiting)
