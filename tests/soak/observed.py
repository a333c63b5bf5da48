"""What was observed of a mission from outside, as data: lines of JSON in a file, and what they say together."""

from __future__ import annotations

import json
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Process(NamedTuple):
    """A process of the mission: `role` is a node's name, or what else it is."""

    pid: int
    role: str
    stopped: bool = False
    serves: bool = (
        True  # whether it listens: a warm process that waits for its node does not; asked where two are alike
    )


class Sample(NamedTuple):
    """The processes at a moment."""

    t: float
    processes: tuple[Process, ...]

    def has(self, role: str) -> bool:
        """Tell whether a process of a role runs, and serves."""
        return any(one.role == role and one.serves for one in self.processes)

    def works(self, role: str) -> bool:
        """Tell whether one runs that is not stopped."""
        return any(one.role == role and one.serves and not one.stopped for one in self.processes)


class Told(NamedTuple):
    """What the manipulator tells: function -> configuration and state."""

    t: float
    ros: float
    functions: dict[str, tuple[str, str]]


class Pose(NamedTuple):
    """Ground truth: the speed of the robot in m/s."""

    t: float
    ros: float
    speed: float


class Scan(NamedTuple):
    """A message of a sensor, with its stamp in ROS time."""

    t: float
    topic: str
    stamp: float


class Trouble(NamedTuple):
    """A status on /diagnostics that is not OK."""

    t: float
    text: str


class Event(NamedTuple):
    """An event of the mission."""

    t: float
    kind: str
    values: dict[str, str]


class Strike(NamedTuple):
    """A fault of the plan that has struck: `index` is its place in the plan; `over` is True when it is taken back."""

    t: float
    index: int
    over: bool
    note: str


class Usage(NamedTuple):
    """Memory in MB and open descriptors of a process."""

    t: float
    pid: int
    role: str
    memory: float
    descriptors: int


class Beat(NamedTuple):
    """How much longer than alone the observer's work takes: 1 on a quiet machine."""

    t: float
    stretch: float


class End(NamedTuple):
    """How the mission's command ended: its exit status (None: it had to be ended), what it said, what it left."""

    t: float
    status: int | None
    said: str
    left: tuple[str, ...]


@dataclass
class Observed:
    """All observations of a mission; times `t` are of the wall clock, s, and come in their order."""

    samples: list[Sample] = field(default_factory=list)
    told: list[Told] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)
    scans: list[Scan] = field(default_factory=list)
    troubles: list[Trouble] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    strikes: list[Strike] = field(default_factory=list)
    usages: list[Usage] = field(default_factory=list)
    beats: list[Beat] = field(default_factory=list)
    end: End | None = None

    def stretch(self, begin: float, end: float) -> float:
        """Return by how much deadlines between two moments are extended: the longest stretch then, at least 1."""
        return max([1.0, *(beat.stretch for beat in self.beats if begin - 1.0 <= beat.t <= end + 1.0)])

    def event(self, kind: str) -> Event | None:
        """Return the first event of a kind."""
        return next((event for event in self.events if event.kind == kind), None)

    def struck(self) -> Iterator[Strike]:
        """Yield the faults that have struck."""
        return (strike for strike in self.strikes if not strike.over)

    def lasted(self, index: int) -> tuple[float, float] | None:
        """Return from when until when a fault was there; None: it has not struck."""
        begun = next((one.t for one in self.strikes if one.index == index and not one.over), None)
        if begun is None:
            return None
        return begun, next((one.t for one in self.strikes if one.index == index and one.over), begun)

    def told_at(self, t: float) -> Told | None:
        """Return what the manipulator had told last at a moment."""
        place = bisect_left(self.told, t, key=lambda told: told.t)
        return self.told[place - 1] if place else None


_LISTS = {
    "told": Told,
    "poses": Pose,
    "scans": Scan,
    "troubles": Trouble,
    "events": Event,
    "strikes": Strike,
    "usages": Usage,
    "beats": Beat,
}


def line(what: str, content: Sample | End | tuple[Any, ...]) -> str:
    """Return an observation as a line; `what` is a field of Observed."""
    return json.dumps([what, *content])


def read(lines: Iterable[str]) -> Observed:
    """Return the observations of lines; one that was cut off is left out."""
    observed = Observed()
    for text in lines:
        try:
            what, *content = json.loads(text)
        except ValueError:
            continue
        if what == "samples":
            observed.samples.append(Sample(content[0], tuple(Process(*one) for one in content[1])))
        elif what == "told":
            functions = {name: (one, state) for name, (one, state) in content[2].items()}
            observed.told.append(Told(content[0], content[1], functions))
        elif what == "end":
            observed.end = End(content[0], content[1], content[2], tuple(content[3]))
        else:
            getattr(observed, what).append(_LISTS[what](*content))
    for name in ("samples", *_LISTS):
        getattr(observed, name).sort(key=lambda one: one.t)
    return observed
