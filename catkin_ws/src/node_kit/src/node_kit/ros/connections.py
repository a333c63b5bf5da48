"""Has rospy connect each topic to all of its publishers, once to each; and leaves out what former ones bring late.

With rospy alone, a node that listens to a topic of several publishers may never hear one of them, without a word:

- Two lists of publishers that arrive within milliseconds, as they do while several nodes start, are handled by two
  threads, and both connect to the same publisher. Here the newer connection replaces the older one. At the publisher
  the older one may be handled last, and replaces the newer one. Both are closed, and nobody connects again.
- The answer to the registration of a subscriber is a list of publishers, too. It may be handled after a newer list,
  which is then dropped.
- A moment without threads or descriptors ends what connects topics (`shortages.py`).
"""

from __future__ import annotations

import itertools
import threading
from collections import defaultdict
from collections.abc import Mapping
from functools import wraps
from typing import TYPE_CHECKING, Any, Callable, Dict

from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import RegManager
from rospy.impl.tcpros_base import TCPROSTransport

from node_kit.ros.shortages import outlast_shortages
from node_kit.succession import Succession

if TYPE_CHECKING:
    import genpy

_validate_header = TCPROSTransport._validate_header
_connect_topic, _publisher_update = ROSHandler._connect_topic, RegManager.publisher_update


def connect_to_all() -> None:
    """Change rospy in this process, before `rospy.init_node` or after it; without effect a second time."""
    ROSHandler._connect_topic, RegManager.publisher_update = _connect_once, _update_with_earlier
    TCPROSTransport._validate_header = _number
    outlast_shortages()


class ConnectionHeader(Dict[str, str]):
    """The header of a connection, which all its messages have.

    Attributes:
        number: higher than that of each connection that was made before.
    """

    def __init__(self, header: Mapping[str, str]) -> None:
        """Give the next connection its number, and keep what the other side has said of it."""
        super().__init__(header)
        self.number = next(_numbers)


def latest(callback: Callable[[Any], object]) -> Callable[[Any], None]:
    """Return a callback of a subscriber that leaves out what a publisher's former process or connection brings late.

    For topics whose messages tell a state, such as latched ones. Each connection of rospy has a thread of its own;
    here one calls after the other.
    """
    TCPROSTransport._validate_header = _number
    succession, lock = Succession(), threading.RLock()

    @wraps(callback)
    def take(message: genpy.Message) -> None:
        header = message._connection_header
        with lock:
            number = getattr(header, "number", -1)  # of one that was made before this function was called
            if not succession.is_late(header.get("callerid", ""), number):
                callback(message)

    return take


_numbers = itertools.count()


def _number(transport: TCPROSTransport, header: dict[str, str]) -> None:
    """Take in the header of a new connection, as rospy does, and number it."""
    _validate_header(transport, header)
    transport.header = ConnectionHeader(header)


class _Locks:
    """A lock for each topic and publisher; it goes with the last thread that wants it."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._locks: defaultdict[tuple[str, str], threading.Lock] = defaultdict(threading.Lock)
        self._wanted: defaultdict[tuple[str, str], int] = defaultdict(int)

    def acquire(self, key: tuple[str, str]) -> None:
        with self._guard:
            lock = self._locks[key]
            self._wanted[key] += 1
        lock.acquire()

    def release(self, key: tuple[str, str]) -> None:
        with self._guard:
            self._locks[key].release()
            self._wanted[key] -= 1
            if not self._wanted[key]:
                del self._wanted[key], self._locks[key]


_locks = _Locks()


def _connect_once(handler: ROSHandler, topic: str, publisher: str) -> Any:
    """Connect to a publisher, unless that was done meanwhile; return what rospy returns: status, text, 0."""
    _locks.acquire((topic, publisher))
    try:
        return _connect_topic(handler, topic, publisher)
    finally:
        _locks.release((topic, publisher))


def _update_with_earlier(manager: RegManager, topic: str, publishers: list[str]) -> None:
    """Take in a list of publishers, with those of lists not yet handled. One that is gone refuses the connection."""
    with manager.cond:  # reentrant
        waiting = [uri for name, uris in manager.updates if name == topic for uri in uris]
        _publisher_update(manager, topic, list(dict.fromkeys([*publishers, *waiting])))
