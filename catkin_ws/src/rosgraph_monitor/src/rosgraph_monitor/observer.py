"""Base classes of observers: subclass one, override `calculate_attr`, export the class in package.xml.

    <export><rosgraph_monitor observer="my_package.my_module:MyObserver"/></export>

Observers import message types but not rospy: they get messages and time, and return statuses. `observer_node`
runs them.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from rosgraph_monitor.status import QA_STALE, QA_STATUS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ros_model.metamodel import RosSystem

Topics = list[tuple[str, type]]


class StaleInputError(Exception):
    """Raised by an observer whose input is too old or does not suffice; the message says which and why."""


class Observer:
    """Something that is evaluated at a fixed rate and returns diagnostic statuses."""

    qa_name = ""
    """Name of the quality attribute. Left empty, it is the key of the observer's last status, or from its own name."""

    def __init__(self, name: str, rate_hz: float) -> None:
        """Name the observer and set its rate in Hz of ROS time."""
        if not rate_hz > 0.0:
            raise ValueError(f"observer {name}: rate {rate_hz} Hz must be positive")
        self._id = ""
        self._name = name
        self._rate = float(rate_hz)
        self._last_qa_name = ""

    @property
    def name(self) -> str:
        """Name under which the observer was loaded."""
        return self._name

    @property
    def rate_hz(self) -> float:
        """How often it is evaluated per second of ROS time."""
        return self._rate

    @property
    def topics(self) -> Topics:
        """Topics to which it listens now; asked before each evaluation, so it may change."""
        return []

    @property
    def outputs(self) -> Topics:
        """Topics on which it publishes beside diagnostics."""
        return []

    def configure(self, parameters: Mapping[str, Any]) -> None:
        """Take the observer's own parameters (`~NAME/...` of the monitor). Raises ValueError for a bad one."""

    def follow(self, system: RosSystem | None) -> None:
        """Learn which system is active, whenever that changes; None where no model says so."""

    def receive(self, topic: str, msg: Any, now: float) -> None:
        """Take a message. `now` is ROS time in s."""

    def reset(self) -> None:
        """Forget what was received: time has jumped back."""

    def take_outputs(self) -> list[tuple[str, Any]]:
        """Return (topic, message) pairs that the last evaluation wants published."""
        return []

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:
        """Return the statuses of this evaluation. Raises StaleInputError."""
        raise NotImplementedError

    def evaluate(self, now: float) -> list[DiagnosticStatus]:
        """Evaluate at ROS time `now` in s, and turn stale input and values that are no numbers into "QA stale"."""
        try:
            return [self._checked(status) for status in self.generate_diagnostics(now)]
        except StaleInputError as error:
            return [self.stale(str(error))]

    def stale(self, reason: str) -> DiagnosticStatus:
        """Return the status that says that the quality attribute is not known now."""
        return DiagnosticStatus(
            level=DiagnosticStatus.STALE,
            name=self._id,
            message=QA_STALE,
            hardware_id=self._name,
            values=[KeyValue(self.qa_name or self._last_qa_name or _qa_name(self._name), reason)],
        )

    def _checked(self, status: object) -> DiagnosticStatus:
        if not isinstance(status, DiagnosticStatus):
            raise TypeError(f"observer {self._name} returned {type(status).__name__}, not a DiagnosticStatus")
        status.hardware_id = status.hardware_id or self._name
        if status.message == QA_STATUS and status.values:
            self._last_qa_name = status.values[0].key
            if not _is_finite(status.values[0].value):
                return self.stale(f"value {status.values[0].value!r} is not a finite number")
        return status


class TopicObserver(Observer):
    """An observer of topics, evaluated over the latest message of each."""

    max_age = 0.0
    """Seconds of ROS time after which a message is stale; 0: three periods of the observer, at least 1 s."""

    def __init__(self, name: str, rate_hz: float, topics: Sequence[tuple[str, type]]) -> None:
        """Name the observer, set its rate in Hz, and its (topic, message class) pairs."""
        super().__init__(name, rate_hz)
        self._topics: Topics = list(topics)
        self._latest: dict[str, tuple[float, Any]] = {}

    @property
    def topics(self) -> Topics:
        """Topics to which it listens now."""
        return self._topics

    def receive(self, topic: str, msg: Any, now: float) -> None:
        """Keep the latest message of each topic, with the time of its arrival."""
        self._latest[topic] = (now, msg)

    def reset(self) -> None:
        """Forget all messages."""
        self._latest.clear()

    def latest(self, topic: str, now: float, max_age: float | None = None) -> Any:
        """Return the latest message of a topic.

        Raises:
            StaleInputError: there is none, or it is older than `max_age` s (default: the observer's).
        """
        if topic not in self._latest:
            raise StaleInputError(f"no message on {topic}")
        stamp, msg = self._latest[topic]
        limit = max_age or self.max_age or max(1.0, 3.0 / self._rate)
        if now - stamp > limit:
            raise StaleInputError(f"last message on {topic} is {now - stamp:.1f} s old")
        return msg

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Override: return the status from the latest messages, in the order of the topics."""
        raise NotImplementedError

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:
        """Return what `calculate_attr` makes of the latest messages."""
        return [self.calculate_attr([self.latest(topic, now) for topic, _ in self.topics])]

    def qa_status(self, level: float) -> DiagnosticStatus:
        """Return a "QA status" of this observer's quality attribute."""
        return DiagnosticStatus(
            level=DiagnosticStatus.OK,
            name=self._id,
            message=QA_STATUS,
            hardware_id=self._name,
            values=[KeyValue(self.qa_name or _qa_name(self._name), repr(float(level)))],
        )


def _qa_name(observer: str) -> str:
    """Return `safety` for `SafetyQualityObserver`, as the published names go."""
    stem = re.sub(r"(Quality)?Observer$", "", observer) or observer
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", stem).lower()


def _is_finite(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
