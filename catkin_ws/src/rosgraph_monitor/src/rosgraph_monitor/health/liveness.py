"""Liveness of one node, decided from events on a connection to its own API. Pure; time is an argument.

The monitor holds a connection open to each node. When a process dies, the kernel closes its end at once: measured with
rospy, an idle connection stays open for minutes and closes 3 ms after a SIGKILL. A closed connection alone proves
nothing, since a server may close it after an answer (HTTP/1.0). So the monitor connects again: if the connection is
refused, the node is dead. A process that is stopped or stuck keeps its connection, and its kernel still confirms
packets. But it does not answer getPid before the deadline. A lost host confirms no packet; the kernel on this side
reports that earlier.
"""

from __future__ import annotations

import enum
import errno
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace


class Life(enum.Enum):
    """What is known about a node's life."""

    UNKNOWN = "not asked yet"
    ALIVE = "alive"
    DEAD = "dead: nobody answers at its address, though the master lists it"
    HUNG = "hung: its process accepts connections but leaves getPid unanswered"
    UNREACHABLE = "unreachable: its host does not answer, or its address leads nowhere"


_WORKS = frozenset({Life.UNKNOWN, Life.ALIVE})


def is_newer(polled: Mapping[tuple[str, str], Life], known: Mapping[tuple[str, str], Life]) -> bool:
    """Tell whether a poll of the master is newer than what is known of the nodes that do not work.

    One that began before a node died, and ended after that, says nothing of that: the node may unregister, or stay.

    Args:
        polled: what was known of each node, by name and address, when the master was asked.
        known: what is known now.
    """
    return all(life in _WORKS or polled.get(node) is life for node, life in known.items())


class Action(enum.Enum):
    """What the holder of the socket must do now."""

    NONE = "none"
    CONNECT = "connect"
    PROBE = "probe"
    DROP = "drop the attempt"


_FRUITLESS_LIMIT = 4
_NO_WAY = frozenset(
    {errno.ETIMEDOUT, errno.EHOSTUNREACH, errno.ENETUNREACH, errno.EHOSTDOWN, errno.ENETDOWN, errno.EADDRNOTAVAIL}
)


@dataclass(frozen=True)
class Timing:
    """Wall seconds: between probes, until a probe or a connection attempt counts as failed, between attempts."""

    probe_period: float = 1.0
    probe_deadline: float = 3.0
    connect_deadline: float = 1.5
    retry_period: float = 0.5

    @property
    def confirmation_deadline(self) -> float:
        """Wall s in which the other host must confirm a packet: less than a process has for an answer."""
        return 0.6 * self.probe_deadline


@dataclass(frozen=True)
class Liveness:
    """State of one node: what is known about it, what happens on its connection, and since when."""

    life: Life = Life.UNKNOWN
    connecting_since: float | None = None
    connected: bool = False
    asked_at: float | None = None
    next_at: float = 0.0
    fruitless: int = 0  # connections in a row that were closed without an answer
    probe_at: float = 0.0  # a new connection is not probed before


def due(state: Liveness, now: float, timing: Timing) -> tuple[Liveness, Action]:
    """Return what to do now, and the state after that has begun."""
    if state.connecting_since is not None:
        if now - state.connecting_since >= timing.connect_deadline:
            return Liveness(life=Life.UNREACHABLE, next_at=now + timing.retry_period), Action.DROP
    elif state.asked_at is not None:
        if now - state.asked_at >= timing.probe_deadline:
            # The connection is kept: a late answer shows that the node is back.
            return replace(state, life=Life.HUNG), Action.NONE
    elif now >= state.next_at:
        if state.connected:
            return replace(state, asked_at=now), Action.PROBE
        return replace(state, connecting_since=now), Action.CONNECT
    return state, Action.NONE


def due_at(state: Liveness, timing: Timing) -> float:
    """Return when `due` will have something to do if no event comes first."""
    if state.connecting_since is not None:
        return state.connecting_since + timing.connect_deadline
    if state.asked_at is None:
        return state.next_at
    return math.inf if state.life is Life.HUNG else state.asked_at + timing.probe_deadline


def on_connected(state: Liveness, now: float) -> Liveness:
    """Return the state after the connection is made: probe at once, or when a server that closes has its next probe.

    An accepted connection is no sign of life, because the kernel accepts it.
    """
    return replace(state, connecting_since=None, connected=True, asked_at=None, next_at=max(now, state.probe_at))


def on_answer(state: Liveness, now: float, timing: Timing) -> Liveness:
    """Return the state after the node has answered a probe."""
    due_again = now + timing.probe_period
    return replace(state, life=Life.ALIVE, asked_at=None, next_at=due_again, fruitless=0, probe_at=due_again)


def on_closed(state: Liveness, now: float, timing: Timing) -> Liveness:
    """Return the state after the other end closed the connection: connect again before judging, at once if useful.

    A server that always closes without an answer counts as one that hangs.
    """
    fruitless = state.fruitless + 1
    if fruitless < _FRUITLESS_LIMIT:
        answered = fruitless == 1 and state.asked_at is None
        return Liveness(state.life, next_at=now, fruitless=fruitless, probe_at=state.probe_at if answered else now)
    return Liveness(life=Life.HUNG, next_at=now + timing.retry_period, fruitless=fruitless)


def on_broken(state: Liveness, error: int, now: float, timing: Timing) -> Liveness:
    """Return the state after the connection failed with this errno: the host is lost, or the other end reset it."""
    return on_unreachable(state, now, timing) if error in _NO_WAY else on_closed(state, now, timing)


def on_no_socket(state: Liveness, now: float, timing: Timing) -> Liveness:
    """Return the state after this process has no socket for its own reasons, which say nothing about the node."""
    return replace(state, connecting_since=None, connected=False, asked_at=None, next_at=now + timing.retry_period)


def on_connect_error(state: Liveness, error: int, now: float, timing: Timing) -> Liveness:
    """Return the state after an attempt to connect failed with this errno.

    If a process ends during the attempt, it resets the connection. The host was reached, so this counts as closed.
    """
    if error == errno.ECONNREFUSED:
        return on_refused(state, now, timing)
    if error in (errno.ECONNRESET, errno.ECONNABORTED, errno.EPIPE):
        return on_closed(state, now, timing)
    return on_unreachable(state, now, timing)


def on_refused(_state: Liveness, now: float, timing: Timing) -> Liveness:
    """Return the state after an attempt to connect was refused: no process listens."""
    return Liveness(life=Life.DEAD, next_at=now + timing.retry_period)


def on_unreachable(_state: Liveness, now: float, timing: Timing) -> Liveness:
    """Return the state after no way led to the host, or its name had no address."""
    return Liveness(life=Life.UNREACHABLE, next_at=now + timing.retry_period)
