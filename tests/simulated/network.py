"""Topics between simulated processes: delayed, lost and doubled as ROS does it.

Messages of one connection keep their order; those of two connections may overtake each other. A message is lost where a
subscriber is not connected yet, or its queue is full while it hangs. A connection that is made anew brings the last
message of a latched topic once more. Subscribers of latched topics leave out what comes late, as `node_kit` has it.
"""

from __future__ import annotations

import itertools
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from node_kit.succession import Succession

from simulated.kernel import Kernel, Process

CONNECT = (0.02, 0.4)  # s, for a subscriber to be connected to a publisher
DELAY = (0.0005, 0.01)  # s, of a message on an idle machine


@dataclass
class _Connection:
    publisher: Process
    number: int
    last_at: float = 0.0
    waiting: deque[Any] = field(default_factory=deque)


@dataclass
class _Subscriber:
    process: Process
    take: Callable[[Any], object]
    queue: int
    connections: dict[int, _Connection] = field(default_factory=dict)
    succession: Succession = field(default_factory=Succession)


class Topic:
    """One topic."""

    def __init__(self, kernel: Kernel, counts: Counter[str], latched: bool) -> None:
        self._kernel, self._counts, self._latched = kernel, counts, latched
        self._publishers: dict[Process, Any] = {}  # with the last message
        self._subscribers: list[_Subscriber] = []
        self._connections = itertools.count()
        self.delivers = -1  # number of the connection whose message is being delivered
        self.slow_until = 0.0
        self.slowness = 0.0

    def advertise(self, process: Process) -> None:
        """Have a process publish."""
        self._publishers[process] = None
        for subscriber in self._subscribers:
            self._connect(process, subscriber)

    def subscribe(self, process: Process, take: Callable[[Any], object], queue: int = 10) -> None:
        """Have a process hear what is published."""
        self._subscribers = [known for known in self._subscribers if known.process.alive]
        subscriber = _Subscriber(process, take, queue)
        self._subscribers.append(subscriber)
        for publisher in list(self._publishers):
            if publisher.alive:
                self._connect(publisher, subscriber)

    def publish(self, process: Process, message: Any) -> None:
        """Send a message to all that are connected."""
        process.check()
        self._publishers[process] = message
        for subscriber in self._subscribers:
            connection = subscriber.connections.get(id(process))
            if connection is not None and subscriber.process.alive:
                self._send(connection, subscriber, message)
            elif subscriber.process.alive:
                self._counts["lost messages"] += 1

    def reconnect(self) -> None:
        """Break all connections; they are made anew."""
        for subscriber in self._subscribers:
            subscriber.connections.clear()
            for publisher in list(self._publishers):
                if publisher.alive:
                    self._connect(publisher, subscriber)

    def connected(self, subscriber: Process, publisher: Process) -> bool:
        """Tell whether a process hears another one."""
        return any(s.process is subscriber and id(publisher) in s.connections for s in self._subscribers)

    def brings(self, subscriber: Process) -> bool:
        """Tell whether a message is on its way to a process."""
        heard = [known for known in self._subscribers if known.process is subscriber]
        return any(connection.waiting for known in heard for connection in known.connections.values())

    def _connect(self, publisher: Process, subscriber: _Subscriber) -> None:
        def connected() -> None:
            if not (publisher.alive and subscriber.process.alive):
                return
            if publisher.frozen or subscriber.process.frozen:  # who hangs takes no part in making it
                self._kernel.after(0.05, connected)
            else:
                connection = subscriber.connections[id(publisher)] = _Connection(publisher, next(self._connections))
                last = self._publishers.get(publisher)
                if self._latched and last is not None:
                    self._send(connection, subscriber, last)

        self._kernel.after(self._kernel.uniform(*CONNECT), connected)

    def _send(self, connection: _Connection, subscriber: _Subscriber, message: Any) -> None:
        delay = self._kernel.uniform(*DELAY)
        if self._kernel.now < self.slow_until:
            delay += self._kernel.uniform(0.0, self.slowness)
            self._counts["held up messages"] += 1
        connection.waiting.append(message)
        if len(connection.waiting) > subscriber.queue:
            connection.waiting.popleft()  # as rospy: the oldest goes
            self._counts["lost messages"] += 1
            return
        connection.last_at = max(connection.last_at + 1e-6, self._kernel.now + delay)
        self._counts["messages"] += 1
        self._kernel.at(connection.last_at, lambda: self._deliver(connection, subscriber))

    def _deliver(self, connection: _Connection, subscriber: _Subscriber) -> None:
        if subscriber.process.frozen and subscriber.process.alive:
            self._kernel.after(0.05, lambda: self._deliver(connection, subscriber))
        elif connection.waiting:
            message = connection.waiting.popleft()
            is_late = self._latched and subscriber.succession.is_late(connection.publisher.name, connection.number)
            if subscriber.process.alive and not is_late:
                self.delivers = connection.number
                subscriber.take(message)
