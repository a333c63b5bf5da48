"""Base classes of observers: subclass one, override `calculate_attr`, export the class in package.xml.

    <export><rosgraph_monitor observer="my_package.my_module:MyObserver"/></export>

Observers import message types but not rospy: they get messages and time, and return statuses. `observer_node`
runs them.
"""

from __future__ import annotations

import inspect
import math
import re
from collections import deque
from functools import cached_property
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import DiagnosticWords as Words
from node_kit.one_line import one_line

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from ros_model.language.metamodel import RosSystem

Topics = list[tuple[str, type]]
LOWEST_RATE, HIGHEST_RATE = 1e-6, 1000.0
"""Hz. A period is 12 days at most, since no thread can wait for ever, and no time that ROS can't tell."""
_RATES = f"from {LOWEST_RATE:g} to {HIGHEST_RATE:g}"
_ARRIVALS = 20
"""Messages over which the rate of a topic is measured."""


class StaleInputError(Exception):
    """The input of an observer is too old or not sufficient; the message says which input and why."""


class Observer:
    """Something that is evaluated at a fixed rate and returns diagnostic statuses."""

    qa_name = ""
    """Name of the quality attribute. Left empty, it is the key of the observer's last status, or from its own name."""
    max_age = 0.0
    """Seconds of ROS time after which a message is stale; 0: three periods of the observer, at least 1 s."""
    hysteresis = 0.0
    """A level that has moved no further than this from the last one reported is reported as that one."""
    defaults: Mapping[str, Any] = {}
    """The observer's own settings with their default values, found in `self.settings`."""

    def __init__(self, name: str, loop_rate_hz: float = 1.0) -> None:
        """Name the observer and set its rate in Hz of ROS time."""
        if not LOWEST_RATE <= loop_rate_hz <= HIGHEST_RATE:
            raise ValueError(f"observer {name}: rate {loop_rate_hz} Hz must be {_RATES}")
        self._id = ""
        self._name = name
        self._rate = float(loop_rate_hz)
        self._last_qa_name = ""
        self._now = 0.0
        self._reported: float | None = None
        self.settings: dict[str, Any] = dict(self.defaults)

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
        """Topics to which it listens now. It may change: the monitor asks before each evaluation."""
        return []

    @property
    def outputs(self) -> Topics:
        """Topics on which it publishes beside diagnostics."""
        return []

    def configure(self, parameters: Mapping[str, Any]) -> None:
        """Take the observer's parameters (`~NAME/...` of the monitor): `rate_hz`, `max_age`, `hysteresis`, its own.

        Raises:
            ValueError: an unknown name, or a value of another type or out of range.
        """
        common = {"rate_hz": self._rate, "max_age": self.max_age, "hysteresis": self.hysteresis}
        for key, value in parameters.items():
            known = {**common, **self.defaults}
            if key not in known:
                raise ValueError(f"{self.name}/{key}: no such setting; there are {', '.join(known)}")
            if not _fits(value, known[key]) or (key in common and value < 0):
                raise ValueError(f"{self.name}/{key}: {value!r} is no {_kind(known[key])}")
            if key == "rate_hz" and not LOWEST_RATE <= value <= HIGHEST_RATE:
                raise ValueError(f"{self.name}/{key}: {value!r} Hz must be {_RATES}")
            if key == "rate_hz":
                self._rate = float(value)
            elif key in common:
                setattr(self, key, float(value))
            else:
                self.settings[key] = value

    def follow(self, system: RosSystem | None) -> None:
        """Take the active system whenever it changes; None if no model tells it."""

    def receive(self, topic: str, msg: Any, now: float) -> None:
        """Take a message. `now` is ROS time in s."""

    def reset(self) -> None:
        """Forget what was received: time has jumped back."""

    def take_outputs(self) -> list[tuple[str, Any]]:
        """Return (topic, message) pairs that the last evaluation wants published."""
        return []

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:
        """Override: return the statuses of this evaluation, or raise StaleInputError.

        An override in the published form has no `now`.
        """
        raise NotImplementedError

    def evaluate(self, now: float) -> list[DiagnosticStatus]:
        """Evaluate at ROS time `now` in s. Stale input, or a value that is not a number, becomes "QA stale"."""
        self._now = now
        try:
            statuses = self.generate_diagnostics(now) if self._timed else self.generate_diagnostics()  # type: ignore[call-arg]
            if isinstance(statuses, DiagnosticArray):  # as some published observers return
                statuses = statuses.status
            return [self._checked(status) for status in statuses or []]
        except StaleInputError as error:
            return [self.stale(str(error))]

    def now(self) -> float:
        """Return the ROS time of this evaluation in s."""
        return self._now

    def age(self, msg: Any) -> float:
        """Return how old the data of a message are at this evaluation, in s by the stamp of its header.

        Raises:
            StaleInputError: the message has no stamp.
        """
        stamp = msg.header.stamp.to_sec()
        if not stamp:
            raise StaleInputError(f"{msg._type} has no stamp: its age is unknown")
        return self._now - float(stamp)

    def stale(self, reason: str) -> DiagnosticStatus:
        """Return the status that says that the quality attribute is unknown now."""
        return DiagnosticStatus(
            level=DiagnosticStatus.STALE,
            name=self._id,
            message=Words.QA_STALE,
            hardware_id=self._name,
            values=[KeyValue(str(self.qa_name or self._last_qa_name or _qa_name(self._name)), one_line(reason))],
        )

    def qa_status(self, level: float) -> DiagnosticStatus:
        """Return a "QA status" of this observer's quality attribute, with hysteresis."""
        level = float(level)
        if self._reported is None or not abs(level - self._reported) <= self.hysteresis:
            self._reported = level
        return DiagnosticStatus(
            level=DiagnosticStatus.OK,
            name=self._id,
            message=Words.QA_STATUS,
            hardware_id=self._name,
            values=[KeyValue(self.qa_name or _qa_name(self._name), repr(self._reported))],
        )

    @cached_property
    def _timed(self) -> bool:
        """Whether the observer asks for the time; one in the published form does not."""
        return bool(inspect.signature(self.generate_diagnostics).parameters)

    def _checked(self, status: object) -> DiagnosticStatus:
        if not isinstance(status, DiagnosticStatus):
            raise TypeError(f"observer {self._name} returned {type(status).__name__}, not a DiagnosticStatus")
        for what, text in (("name", status.name), ("message", status.message), ("hardware_id", status.hardware_id)):
            self._check_text(what, text)
        for pair in status.values:
            self._check_text("key", pair.key)
            self._check_text(f"value of {pair.key}", pair.value)
        status.hardware_id = status.hardware_id or self._name
        if status.message == Words.QA_STATUS and status.values:
            self._last_qa_name = status.values[0].key
            if not _is_finite(status.values[0].value):
                return self.stale(f"value {status.values[0].value!r} is not a finite number")
        return status

    def _check_text(self, what: str, text: object) -> None:
        """Raise TypeError or ValueError where a text of a status can't be published."""
        if not isinstance(text, str):
            raise TypeError(f"observer {self._name} returned {text!r} as {what}: make it a text with str()")
        if not text.isprintable():
            text.encode()  # raises UnicodeEncodeError, a ValueError, where the text has half characters


class TopicObserver(Observer):
    """An observer of topics, evaluated over the latest message of each."""

    def __init__(self, name: str, loop_rate_hz: float, topics: Sequence[tuple[str, type]]) -> None:
        """Name the observer, set its rate in Hz, and its (topic, message class) pairs."""
        super().__init__(name, loop_rate_hz)
        self._topics: Topics = list(topics)
        self._latest: dict[str, tuple[float, Any]] = {}
        self._arrivals: dict[str, deque[float]] = {}

    @property
    def topics(self) -> Topics:
        """Topics to which it listens now."""
        return self._topics

    def receive(self, topic: str, msg: Any, now: float) -> None:
        """Keep the latest message of each topic, with the time of its arrival."""
        self._latest[topic] = (now, msg)
        self._arrivals.setdefault(topic, deque(maxlen=_ARRIVALS)).append(now)

    def reset(self) -> None:
        """Forget all messages."""
        self._latest.clear()
        self._arrivals.clear()

    def rate(self, topic: str, now: float) -> float:
        """Return the rate of a topic in Hz over its last messages; it falls while no message comes."""
        arrivals = self._arrivals.get(topic) or deque[float]()
        if len(arrivals) < 2:
            return 0.0
        elapsed = now - arrivals[0]
        return (len(arrivals) - 1) / elapsed if elapsed > 0.0 else math.inf

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
        """Return the status that `calculate_attr` computes from the latest messages."""
        return [self.calculate_attr([self.latest(topic, now) for topic, _ in self.topics])]


class ServiceObserver(Observer):
    """An observer of the answers of a service without arguments. It is stale while the service is missing."""

    client: Callable[[], Any]
    """Calls the service; set by who runs the observer."""

    def __init__(self, name: str, service_name: str, service_type: type, loop_rate_hz: float = 1.0) -> None:
        """Name the observer and the service that is called at this rate in Hz."""
        super().__init__(name, loop_rate_hz)
        self.service = service_name, service_type

    def diagnostics_from_response(self, response: Any) -> list[DiagnosticStatus]:
        """Override: return the statuses from an answer of the service."""
        raise NotImplementedError

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:  # noqa: ARG002 - interface
        """Return the statuses that `diagnostics_from_response` computes from a new answer."""
        return self.diagnostics_from_response(self.client())


def _qa_name(observer: str) -> str:
    """Return `safety` for `SafetyQualityObserver`, following the published names."""
    stem = re.sub(r"(Quality)?Observer$", "", observer) or observer
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", stem).lower()


def _is_finite(text: str) -> bool:
    """Return whether a value is a number, or a truth value as the observers of tasks write it."""
    try:
        return math.isfinite(float(text))
    except ValueError:
        return text.strip().lower() in ("true", "false")


def _fits(value: Any, default: Any) -> bool:
    if isinstance(default, (bool, str, list)):
        return isinstance(value, type(default))
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _kind(default: Any) -> str:
    return {bool: "truth value", str: "text", list: "list"}.get(type(default), "number in range")
