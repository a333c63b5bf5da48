"""ROS shell of topic health and batteries: subscribes to what is watched, without unpacking messages."""

from __future__ import annotations

import contextlib
import io
import struct
import threading
import time
import zlib
from typing import TYPE_CHECKING, Any

import genpy
import roslib.message
import rospy
from sensor_msgs.msg import BatteryState

from rosgraph_monitor.health.battery import BatterySpec, charge_of, has_failed
from rosgraph_monitor.health.components import NodeCondition
from rosgraph_monitor.health.topics import TopicHealth, TopicVerdict

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Mapping

    from rosgraph_monitor.health.topics import TopicSpec

_LARGEST_MESSAGE = 1 << 24
_SEQ_AND_STAMP = 12
"""Bytes of a serialised Header before its frame."""


def packed(msg: Any) -> bytes:
    """Return a message as it was sent.

    rospy has one subscription to a topic for a whole process. All callbacks get messages of the class that came first.
    """
    if isinstance(msg, rospy.AnyMsg):
        return bytes(msg._buff)
    buffer = io.BytesIO()
    msg.serialize(buffer)
    return buffer.getvalue()


def unpacked(msg: Any, message_class: type) -> Any:
    """Return a message in its class, whoever subscribed first.

    Raises:
        TypeError: it is of another type.
        genpy.DeserializationError: it is broken.
    """
    if not isinstance(msg, rospy.AnyMsg):
        return msg
    if msg._connection_header["md5sum"] != message_class._md5sum:  # type: ignore[attr-defined]
        kind = msg._connection_header["type"]
        raise TypeError(f"it is a {kind}, not a {message_class._type}")  # type: ignore[attr-defined]
    return message_class().deserialize(msg._buff)


class TopicListener:
    """Subscribes to the topics that are watched, and judges them."""

    def __init__(self, grace: float) -> None:
        """Follow nothing yet; a topic may bring its first message within the grace (s)."""
        self._health = TopicHealth(grace)
        self._subscribers: dict[str, rospy.Subscriber] = {}
        self._hashed: frozenset[str] = frozenset()
        self._has_header: dict[str, bool] = {}
        self._lock = threading.Lock()

    @property
    def topics(self) -> tuple[str, ...]:
        """Topics that are watched."""
        return tuple(self._subscribers)

    def follow(self, specs: Mapping[str, TopicSpec]) -> None:
        """Watch these topics from now on, and no others."""
        watched = {name: spec for name, spec in specs.items() if spec.is_watched}
        with self._lock:
            self._health.follow(watched, *_times())
            self._hashed = frozenset(name for name, spec in watched.items() if spec.stuck_after)
        for name in self._subscribers.keys() - watched.keys():
            self._subscribers.pop(name).unregister()
        for name in watched.keys() - self._subscribers.keys():
            self._subscribers[name] = rospy.Subscriber(
                name, rospy.AnyMsg, self._receive, name, buff_size=_LARGEST_MESSAGE, tcp_nodelay=True
            )

    def judge(self, excused: Collection[str] = (), grace: float | None = None) -> list[TopicVerdict]:
        """Return a verdict on each topic (see `TopicHealth.judge`)."""
        with self._lock:
            return self._health.judge(*_times(), excused, grace)

    def _receive(self, msg: Any, topic: str) -> None:
        digest = self._digest(msg) if topic in self._hashed else None
        with self._lock:
            self._health.arrived(topic, *_times(), digest)

    def _digest(self, msg: Any) -> int:
        """Return a checksum of the message without its header, which differs each time."""
        data: bytes | memoryview = packed(msg)
        kind = msg._connection_header.get("type", "")
        if kind not in self._has_header:
            message_class = None
            with contextlib.suppress(ValueError):  # a name that no type can have
                message_class = roslib.message.get_message_class(kind)
            slots = getattr(message_class, "_slot_types", [])
            self._has_header[kind] = bool(slots) and slots[0] in ("std_msgs/Header", "Header")
        if self._has_header[kind] and len(data) >= _SEQ_AND_STAMP + 4:
            (frame,) = struct.unpack_from("<I", data, _SEQ_AND_STAMP)
            data = memoryview(data)[_SEQ_AND_STAMP + 4 + frame :]
        return zlib.crc32(data)


def _times() -> tuple[float, float]:
    """Return ROS time and wall time in s. Without a simulation both are monotonic: the system's clock may be set."""
    wall = time.monotonic()
    return (wall if rospy.rostime.is_wallclock() else rospy.get_time()), wall


class BatteryListener:
    """Says whether batteries are charged, as conditions of their components."""

    def __init__(self, specs: Iterable[BatterySpec], on_change: Callable[[], None]) -> None:
        """Subscribe to the batteries' topics; `on_change` is called when a condition changes."""
        self._on_change = on_change
        self.conditions: dict[str, NodeCondition] = {}
        specs = tuple(specs)
        self._low = {spec.component: f"the charge on {spec.topic} is below {spec.below:g}" for spec in specs}
        self._subscribers = []
        for spec in specs:
            self.conditions[spec.component] = NodeCondition.UNKNOWN
            self._subscribers.append(rospy.Subscriber(spec.topic, BatteryState, self._receive, spec, queue_size=1))

    @property
    def reasons(self) -> dict[str, str]:
        """Why each component that has failed has done so."""
        return {name: self._low[name] for name, found in self.conditions.items() if found is NodeCondition.FAILED}

    def _receive(self, msg: Any, spec: BatterySpec) -> None:
        try:
            msg = unpacked(msg, BatteryState)
        except (TypeError, genpy.DeserializationError) as error:
            rospy.logwarn_throttle(10.0, f"{spec.topic}: {error}: left out")
            return
        charge = charge_of(msg.percentage, msg.charge, msg.capacity)
        if charge is None:
            rospy.logwarn_throttle(10.0, f"{spec.topic}: the message tells no charge of {spec.component}: left out")
            return
        before = self.conditions[spec.component]
        failed = has_failed(spec, charge, before is NodeCondition.FAILED)
        self.conditions[spec.component] = NodeCondition.FAILED if failed else NodeCondition.ALIVE
        if self.conditions[spec.component] is not before:
            self._on_change()
