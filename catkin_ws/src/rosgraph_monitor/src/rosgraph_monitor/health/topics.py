"""Health of topics: age, rate, and sensors that are stuck. Pure; arrivals and times are arguments."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from metacontrol_msgs.msg import DiagnosticWords as Words

from rosgraph_monitor.diagnostics.status import Level, Status

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from ros_model.language.metamodel import RosSystem

DEFAULT_MAX_AGE = 2.0
"""s. Of a topic that stands for a component and has no limit of its own."""
_SHORTEST_WINDOW = 2.0
_PERIODS_IN_WINDOW = 5.0
"""The rate is measured over so many periods of the expected rate, but at least 2 s: jitter evens out."""
_MOST_ARRIVALS = 10_000
"""Messages of one topic that are counted at most: while a clock stands, none leaves the window."""
_JUMP = 1.0
"""s of ROS time backwards that count as a jump: a restarted simulation, a bag played again. Ahead, s more than the pace
of the clock explains: a bag that is played on from elsewhere."""
_PACE_PERIOD = 1.0
"""Wall s over which the pace of a clock is measured, and between two steps of a clock at most."""
_UNEVEN = 2.0
"""A clock may go on by so many times what its pace makes likely."""
_LIMITS = ("min_rate", "max_age", "stuck_after")


@dataclass(frozen=True)
class TopicSpec:
    """What is expected of a topic; 0 or "" means no expectation.

    Attributes:
        name: relative to the system's namespace, or absolute.
        type: as `package/Type`.
        min_rate: Hz.
        max_age: s since the last message.
        stuck_after: messages in a row with the same data (header left out) that make the sensor count as stuck.
        component: whose status this is; "": its publisher's.
        wall_time: times are wall time, and not ROS time.
    """

    name: str
    type: str = ""
    min_rate: float = 0.0
    max_age: float = 0.0
    stuck_after: int = 0
    component: str = ""
    wall_time: bool = False

    @property
    def is_watched(self) -> bool:
        """Whether messages must be received to judge it."""
        return bool(self.min_rate or self.max_age or self.stuck_after)


@dataclass(frozen=True)
class TopicVerdict:
    """What is wrong with a topic; an empty message means nothing. `heard`: whether its state is known."""

    spec: TopicSpec
    message: str = ""
    reason: str = ""
    expected: str = ""
    actual: str = ""
    heard: bool = True


def parse_topics(value: Any) -> dict[str, TopicSpec]:
    """Return what is expected of topics, from `{topic: {min_rate: HZ, max_age: S, ...}}`.

    Raises:
        ValueError: the value has another shape; the message names the entry.
    """
    if not isinstance(value, dict):
        raise ValueError(f"topics: must map each topic to what is expected of it, not {value!r}")
    return {topic.strip("/"): parse_spec(topic, entry) for topic, entry in _flat(value)}


def parse_spec(topic: str, entry: Mapping[str, Any], where: str = "topics") -> TopicSpec:
    """Return what an entry of settings expects of a topic.

    Raises:
        ValueError: an unknown key or a value out of range.
    """
    known = {"type": "", "component": "", "wall_time": False, "min_rate": 0.0, "max_age": 0.0, "stuck_after": 0}
    for key, value in entry.items():
        if key not in known:
            raise ValueError(f"{where}/{topic}/{key}: no such setting; there are {', '.join(known)}")
        if key in _LIMITS:
            whole = isinstance(value, int) or (key != "stuck_after" and isinstance(value, float))
            good = whole and not isinstance(value, bool) and math.isfinite(value) and value > 0
        else:
            good = isinstance(value, type(known[key]))
        if not good:
            wanted = "a positive number" if key in _LIMITS else f"a {type(known[key]).__name__}"
            raise ValueError(f"{where}/{topic}/{key}: {value!r} is not {wanted}")
    return TopicSpec(topic.strip("/"), **entry)


def model_topics(system: RosSystem) -> dict[str, TopicSpec]:
    """Return what a model expects of topics: its system parameters `min_rate/TOPIC`, `max_age/TOPIC`, ..."""
    specs: dict[str, TopicSpec] = {}
    for parameter in system.parameters:
        limit, _, topic = parameter.name.partition("/")
        value = parameter.value
        if limit not in _LIMITS or not topic or isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        if math.isfinite(value) and value > 0:
            limits: dict[str, Any] = {limit: int(value) if limit == "stuck_after" else float(value)}
            specs[topic.strip("/")] = replace(specs.get(topic.strip("/"), TopicSpec(topic.strip("/"))), **limits)
    return specs


def merged(*layers: Mapping[str, TopicSpec]) -> dict[str, TopicSpec]:
    """Return the expectations of several sources; for one topic, a later source takes precedence."""
    found: dict[str, TopicSpec] = {}
    for layer in layers:
        for name, spec in layer.items():
            given = {key: value for key, value in vars(spec).items() if value}
            found[name] = replace(found.get(name, spec), **given)
    return found


def verdict_statuses(verdicts: Iterable[TopicVerdict]) -> list[Status]:
    """Return a status for each topic that has a problem."""
    return [
        Status(
            Level.ERROR,
            verdict.spec.name,
            verdict.message,
            (("reason", verdict.reason), ("expected", verdict.expected), ("actual", verdict.actual)),
        )
        for verdict in verdicts
        if verdict.message
    ]


@dataclass
class _Seen:
    """History of a topic. `since`, `since_wall`: when its silence began to count."""

    since: float
    since_wall: float
    last: float | None = None
    arrivals: deque[float] = field(default_factory=lambda: deque(maxlen=_MOST_ARRIVALS))
    digest: object = None
    same: int = 0


class _Clock:
    """ROS time without the jumps ahead: nobody was silent in a time that did not pass.

    A jump is a step that the pace of the clock does not explain. A fast simulation is no jump: the pace, ROS time in
    wall time, is measured again and again.
    """

    def __init__(self) -> None:
        self._left_out = self._ros = self._wall = self._moved = 0.0
        self._pace, self._measured = 1.0, (0.0, 0.0)

    def now(self, ros: float, wall: float) -> tuple[float, bool]:
        """Return the time that counts, and whether ROS time has jumped back. Times in s."""
        before, self._ros = self._ros, ros
        looked, self._wall = self._wall, wall
        if before <= 0.0 or ros < before - _JUMP:
            self._left_out, self._pace, self._measured, self._moved = 0.0, 1.0, (ros, wall), wall
            return ros, ros < before - _JUMP
        likely = max(wall - looked, _UNEVEN * self._pace * min(wall - self._moved, _PACE_PERIOD))
        if ros - before > _JUMP + likely:
            self._left_out += ros - before
        if ros != before:
            self._moved = wall
        if wall - self._measured[1] >= _PACE_PERIOD:
            self._pace = max((ros - self._measured[0]) / (wall - self._measured[1]), 1.0)
            self._measured = ros, wall
        return ros - self._left_out, False


class TopicHealth:
    """Follows topics: takes note of each message, and returns verdicts."""

    def __init__(self, grace: float = 10.0) -> None:
        """Start with nothing to follow.

        Args:
            grace: seconds, wall time and the topic's own, in which a topic may bring its first message: a fast
                simulation starts no faster for it, and a paused one brings nothing.
        """
        self._grace = grace
        self._specs: dict[str, TopicSpec] = {}
        self._seen: dict[str, _Seen] = {}
        self._clock = _Clock()

    def follow(self, specs: Mapping[str, TopicSpec], ros: float, wall: float) -> None:
        """Follow these topics from now on, and forget others. Times in s."""
        self._specs = {name: spec for name, spec in specs.items() if spec.is_watched}
        now = self._now(ros, wall)
        self._seen = {
            name: self._seen.get(name, _Seen(wall if spec.wall_time else now, wall))
            for name, spec in self._specs.items()
        }

    def arrived(self, topic: str, ros: float, wall: float, digest: object = None) -> None:
        """Take note of a message; the digest is equal for messages with the same data."""
        counted = self._now(ros, wall)
        spec, seen = self._specs.get(topic), self._seen.get(topic)
        if spec is None or seen is None:
            return
        now = wall if spec.wall_time else counted
        seen.last = now
        seen.same = seen.same + 1 if digest == seen.digest else 1
        seen.digest = digest
        if spec.min_rate:
            seen.arrivals.append(now)

    def judge(
        self, ros: float, wall: float, excused: Collection[str] = (), grace: float | None = None
    ) -> list[TopicVerdict]:
        """Return a verdict on each topic. An excused topic is fine, and begins anew when the excuse ends.

        All topics begin anew when ROS time jumps back or begins: it is 0 until a simulation's first clock message. What
        it jumps ahead does not count. The grace (s) is that of this moment, where it is not the usual one.
        """
        grace = self._grace if grace is None else grace
        counted = self._now(ros, wall)
        verdicts = []
        for name, spec in self._specs.items():
            now = wall if spec.wall_time else counted
            if not spec.wall_time and self._seen[name].since <= 0.0:
                self._seen[name] = _Seen(now, wall)
            if name in excused:
                self._seen[name] = _Seen(now, wall)
                verdicts.append(TopicVerdict(spec, heard=False))
            else:
                verdicts.append(self._judge(spec, self._seen[name], now, wall, grace))
        return verdicts

    def _now(self, ros: float, wall: float) -> float:
        """Return the time that counts for topics of ROS time, which begin anew where it jumps back."""
        now, is_back = self._clock.now(ros, wall)
        for name, spec in self._specs.items() if is_back else ():
            if not spec.wall_time and name in self._seen:
                self._seen[name] = _Seen(now, wall)
        return now

    def _judge(self, spec: TopicSpec, seen: _Seen, now: float, wall: float, grace: float) -> TopicVerdict:
        if seen.last is None:
            waited = min(now - seen.since, wall - seen.since_wall)
            period = 1.0 / spec.min_rate if spec.min_rate else 0.0
            if waited <= max(grace, spec.max_age, 2.0 * period):
                return TopicVerdict(spec, heard=False)
            return TopicVerdict(spec, Words.SILENT_TOPIC, f"no message in {waited:.1f} s", "messages", "none")
        age = now - seen.last
        if spec.max_age and age > spec.max_age:
            return TopicVerdict(
                spec, Words.SILENT_TOPIC, f"last message {age:.1f} s ago", f"max_age {spec.max_age:g}", f"{age:.2f}"
            )
        if spec.min_rate:
            rate = _rate(seen.arrivals, spec.min_rate, seen.last, now)
            if rate is not None and rate < spec.min_rate:
                return TopicVerdict(
                    spec, Words.SLOW_TOPIC, f"{rate:.2f} messages per s", f"min_rate {spec.min_rate:g}", f"{rate:.2f}"
                )
        if spec.stuck_after and seen.same >= spec.stuck_after:
            return TopicVerdict(
                spec,
                Words.STUCK_TOPIC,
                f"the same data {seen.same} times in a row",
                f"stuck_after {spec.stuck_after}",
                str(seen.same),
            )
        return TopicVerdict(spec)


def _rate(arrivals: deque[float], min_rate: float, last: float, now: float) -> float | None:
    """Return the rate over the window; None while it is too early to tell.

    Intervals are counted, not messages; one that is not over yet counts as soon as it is too long.
    """
    window = max(_SHORTEST_WINDOW, _PERIODS_IN_WINDOW / min_rate)
    while len(arrivals) > 1 and arrivals[1] <= now - window:
        arrivals.popleft()
    if not arrivals or now - arrivals[0] < window:
        return None
    elapsed = max(last, now - 1.0 / min_rate) - arrivals[0]
    return (len(arrivals) - 1) / elapsed if elapsed > 0.0 else None


def _flat(tree: Mapping[str, Any], prefix: str = "") -> Iterable[tuple[str, Mapping[str, Any]]]:
    """Yield (topic, settings); the parameter server reads the slashes in a topic as levels of a tree."""
    settings = {key: value for key, value in tree.items() if not isinstance(value, dict)}
    if settings:
        if not prefix:
            raise ValueError(f"topics/{next(iter(settings))}: must be a mapping with {', '.join(_LIMITS)}")
        yield prefix, settings
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}/{key}".strip("/"))
