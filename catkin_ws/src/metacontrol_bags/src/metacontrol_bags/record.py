"""The record of a mission from its bag, as plain data, from which the summary and the figure are made.

Stamps are simulated seconds on the mission's own clock (`/clock`), as in the bag.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from metacontrol_bags.words import MissionEvent

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from metacontrol_bags.decision import Decision

FARTHEST_M = 4e7
"""m: the Earth's circumference. What is farther from the origin of its frame is no place of a robot."""

Samples = tuple[tuple[float, float], ...]
"""Pairs (stamp in s, value), in the order of time."""


def _no_poses() -> NDArray[np.float64]:
    import numpy as np  # here: nodes that only write messages need none of its 12 MB

    return np.empty((0, 3))


@dataclass(frozen=True)
class Event:
    """A `metacontrol_msgs/MissionEvent`."""

    stamp: float
    kind: str
    name: str
    values: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ComponentReport:
    """A "Component status" diagnostic: TRUE, FALSE or RECOVERED."""

    stamp: float
    component: str
    status: str


@dataclass(frozen=True)
class QualityReport:
    """A level of a quality attribute, as an observer reported it; None where it is stale."""

    stamp: float
    name: str
    level: float | None


@dataclass(frozen=True)
class CostReport:
    """What a node costs: `figure` is "cpu" (per cent of a core) or "memory" (MB)."""

    stamp: float
    figure: str
    node: str
    value: float


@dataclass(frozen=True)
class ConfigurationReport:
    """One function of a `metacontrol_msgs/ActiveConfiguration`."""

    stamp: float
    function: str
    configuration: str
    state: str


@dataclass(frozen=True)
class GoalReport:
    """A goal sent to move_base, or, with a status, its result."""

    stamp: float
    id: str
    status: int | None = None
    text: str = ""


@dataclass(frozen=True)
class OccupancyMap:
    """The static map: `occupied` is (rows, columns), row 0 at the origin's y; resolution and origin in m."""

    resolution: float
    origin_x: float
    origin_y: float
    occupied: NDArray[np.bool_]


@dataclass(frozen=True)
class MissionRecord:
    """Everything that a bag holds of a mission.

    Attributes:
        poses: (n, 3) array of stamp, x, y: ground truth in the map frame.
        true_quality: QA name -> samples of its ground truth.
        contacts: samples of the running count of contact episodes.
        commands: stamps of the velocity commands.
        obstacles: places (x, y, m in the map frame) of clutter that stood there at any time.
        first_stamp: of the first message in the bag.
        last_stamp: of the last message in the bag.
    """

    events: tuple[Event, ...] = ()
    poses: NDArray[np.float64] = field(default_factory=_no_poses)
    true_quality: dict[str, Samples] = field(default_factory=dict)
    contacts: Samples = ()
    components: tuple[ComponentReport, ...] = ()
    observed: tuple[QualityReport, ...] = ()
    configurations: tuple[ConfigurationReport, ...] = ()
    decisions: tuple[Decision, ...] = ()
    goals: tuple[GoalReport, ...] = ()
    results: tuple[GoalReport, ...] = ()
    costs: tuple[CostReport, ...] = ()
    commands: tuple[float, ...] = ()
    obstacles: tuple[tuple[float, float], ...] = ()
    map: OccupancyMap | None = None
    first_stamp: float = 0.0
    last_stamp: float = 0.0

    def event(self, kind: str) -> Event | None:
        """Return the first event of a kind, None where there is none."""
        return next((event for event in self.events if event.kind == kind), None)

    @property
    def start_stamp(self) -> float:
        """When the mission started; the stamp of the first message if no event says it."""
        event = self.event(MissionEvent.MISSION_START)
        return event.stamp if event else self.first_stamp

    @property
    def end_stamp(self) -> float:
        """When the mission ended; the stamp of the last message if no event says it."""
        event = self.event(MissionEvent.MISSION_END)
        return event.stamp if event else self.last_stamp
