"""The robot's knowledge of its surroundings: both costmaps, updated at their rates from the map and the sensors.

It also tells what keeps them from being current: a missing map or transform, a sensor that is silent.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

from robot_formulas.geometry import ORIGIN, Pose

from move_base.costmap.costmap import Costmap
from move_base.costmap.static_map import MapError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from move_base.costmap.sensors import Observation
    from move_base.costmap.snapshot import Snapshot
    from move_base.costmap.static_map import MapPart, StaticMap
    from move_base.parameters.parameters import CostmapParameters, MoveBaseParameters, ObservationSource

FUTURE_LIMIT = 0.5
"""A measurement whose stamp is this far ahead of the clock (s) is not believed."""

KEPT_MAPS = 3
"""Per topic: maps whose frames are not connected with the costmaps' yet."""

KEPT_OBSERVATIONS = 5
"""Per source: as many as can be waiting for their transform at any usual rate."""


class Transformer(Protocol):
    """Access to the tree of frames."""

    def lookup(self, target: str, source: str, stamp: float | None) -> NDArray[np.float64] | None:
        """Return the 4 x 4 transform from `source` to `target` at a time (None: newest), or None if there is none."""

    def newest(self, target: str, source: str) -> float | None:
        """Return the time of the newest transform between two frames, s; None where they are not connected."""


@dataclass
class _Sensor:
    """The data of one source."""

    source: ObservationSource
    recent: list[Observation] = field(default_factory=list)
    used: float = -math.inf  # stamp of the newest observation in a costmap

    def newest(self, after: float, target: str, frames: Transformer) -> tuple[Observation, NDArray[np.float64]] | None:
        """Return the newest observation later than `after` that can be transformed."""
        for observation in reversed(self.recent):
            if observation.stamp <= after:
                return None
            transform = frames.lookup(target, observation.frame, observation.stamp)
            if transform is not None:
                return observation, transform
        return None

    def trouble(self, now: float) -> str:
        """Return why no current data of it are in a costmap, or an empty text.

        The age is that of the newest measurement in a costmap; a measurement that can't be transformed does not count.
        """
        period = self.source.expected_update_rate
        if now - self.used <= period:
            return ""
        if self.recent and now - self.recent[-1].stamp <= period:
            return f"no transform for {self.source.topic} from its frame {self.recent[-1].frame!r}"
        return f"no current data from {self.source.topic}"


class Area:
    """A costmap with its rate and the stamps of what it has used."""

    def __init__(self, parameters: CostmapParameters) -> None:
        self.parameters = parameters
        self.costmap = Costmap(parameters)
        self.snapshot: Snapshot | None = None
        self.updated = -math.inf
        self.used: dict[tuple[str, str], float] = {}

    def reconfigure(self, parameters: CostmapParameters) -> None:
        """Take other parameters; the next update uses them, and it is due at once."""
        if parameters != self.parameters:
            self.parameters = parameters
            self.costmap.reconfigure(parameters)
            self.updated = -math.inf

    def due(self, now: float) -> bool:
        """Whether it is time for an update."""
        return self.snapshot is None or now - self.updated >= 1.0 / self.parameters.update_frequency - 1e-3

    def updated_at(self, now: float) -> None:
        """Note an update; rates hold on average even where steps and updates do not divide evenly."""
        period = 1.0 / self.parameters.update_frequency
        self.updated = max(self.updated + period, now - period) if math.isfinite(self.updated) else now

    def robot_pose(self, now: float, frames: Transformer) -> Pose | None:
        """Return the robot's pose in the costmap's frame; None where there is none, or it is too old."""
        p = self.parameters
        matrix = frames.lookup(p.global_frame, p.robot_base_frame, None)
        stamp = frames.newest(p.global_frame, p.robot_base_frame)
        if matrix is None or stamp is None or now - stamp > p.transform_tolerance:
            return None
        return Pose.from_matrix(matrix)


class Surroundings:
    """The global and the local costmap, and the sensors of both."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self.global_area = Area(parameters.global_costmap)
        self.local_area = Area(parameters.local_costmap)
        sources = [*parameters.global_costmap.all_sources, *parameters.local_costmap.all_sources]
        sources.sort(key=lambda source: source.expected_update_rate, reverse=True)  # the shortest period counts
        self._sensors = {source.stream: _Sensor(source) for source in sources}
        self._map_frames: dict[str, str] = {}  # of the maps in use, by topic
        self._waiting: dict[str, dict[str, StaticMap]] = {}  # maps that wait, by topic and frame; the newest last

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Take other parameters while the robot drives: obstacles stay."""
        self.global_area.reconfigure(parameters.global_costmap)
        self.local_area.reconfigure(parameters.local_costmap)

    @property
    def sources(self) -> list[ObservationSource]:
        """The sources to listen to, those that convert a topic's messages alike once."""
        return [sensor.source for sensor in self._sensors.values()]

    def set_map(self, static: StaticMap, frame: str, topic: str = "", frames: Transformer | None = None) -> str:
        """Take the static map of a topic; without one, it is for all static layers.

        A map whose frame is not connected with the global costmap's waits until it is. The one before stays in use
        meanwhile: anybody may publish a map.

        Args:
            static: the map.
            frame: its frame.
            topic: where it comes from.
            frames: the transforms; without them, only the costmap's own frame counts as connected at once.

        Returns:
            Why it waits, or an empty text.
        """
        frame = frame.removeprefix("/")
        own = self.global_area.parameters.global_frame
        if frame in ("", own, self._map_frame(topic)) or (frames and frames.lookup(own, frame, None) is not None):
            self._waiting.pop(topic, None)
            self._use_map(static, frame, topic)
            return ""
        waiting = self._waiting.setdefault(topic, {})
        waiting.pop(frame, None)
        waiting[frame] = static
        if len(waiting) > KEPT_MAPS:
            waiting.pop(next(iter(waiting)))
        return _no_transform(frame, own)

    def update_map(self, part: MapPart, topic: str) -> None:
        """Take a part of the static map of a topic.

        Raises:
            MapError: the part is not within the map.
        """
        areas = (self.global_area, self.local_area)
        waiting = self._waiting.get(topic, {}) if any(area.costmap.takes_updates(topic) for area in areas) else {}
        for frame, static in waiting.items():
            with suppress(MapError):
                waiting[frame] = static.updated(part)
        for area in areas:
            area.costmap.update_map(part, topic)
            area.updated = -math.inf

    def observe(self, observation: Observation, now: float) -> str:
        """Take a measurement; return why it was ignored, or an empty text."""
        sensor = self._sensors[observation.source.stream]
        if observation.stamp > now + FUTURE_LIMIT:
            return f"{observation.source.topic}: the stamp is more than {FUTURE_LIMIT:g} s ahead of the clock"
        if sensor.recent and observation.stamp <= sensor.recent[-1].stamp:
            return f"{observation.source.topic}: the stamp is not newer than the last message's"
        sensor.recent = [*sensor.recent[1 - KEPT_OBSERVATIONS :], observation]
        return ""

    def clear(self) -> None:
        """Forget all obstacles but those of the static map."""
        self.global_area.costmap.clear()
        self.local_area.costmap.clear()

    def reset_time(self) -> None:
        """Forget all stamps, after the clock was set back."""
        for sensor in self._sensors.values():
            sensor.recent, sensor.used = [], -math.inf
        for area in (self.global_area, self.local_area):
            area.updated, area.used = -math.inf, {}

    def update(self, now: float, frames: Transformer, robot: Pose | None, local_robot: Pose | None) -> str:
        """Update the costmaps that are due.

        Args:
            now: time in s.
            frames: the transforms.
            robot: pose in the global costmap's frame, if known.
            local_robot: the same in the local costmap's.

        Returns:
            What is missing for it: map or transform.
        """
        self._use_connected(frames)
        for area, pose in ((self.local_area, local_robot), (self.global_area, robot)):
            if area.costmap.needs_map:
                topic = area.costmap.missing_map()
                waiting = self._waiting.get(topic)
                if waiting:
                    return _no_transform(next(reversed(waiting)), self.global_area.parameters.global_frame)
                return f"no map received on {topic}"
            if pose is None or not area.due(now):
                continue
            map_poses = {}
            for topic in area.costmap.map_topics:
                map_pose = self._map_pose(topic, area, frames)
                if map_pose is None:
                    return _no_transform(self._map_frame(topic), area.parameters.global_frame)
                map_poses[topic] = map_pose
            area.snapshot = area.costmap.update(pose, self._observations_for(area, frames), map_poses)
            area.updated_at(now)
        for area, pose in ((self.global_area, robot), (self.local_area, local_robot)):
            if pose is None:
                p = area.parameters
                return f"no current transform from {p.robot_base_frame!r} to {p.global_frame!r}"
        return ""

    def stale_reason(self, now: float) -> str:
        """Name the first source whose data are too old, or return an empty text."""
        areas = (self.global_area, self.local_area)
        used = {source.stream for area in areas for source in area.parameters.sources}
        sensors = (sensor for stream, sensor in self._sensors.items() if stream in used)
        return next(filter(None, (sensor.trouble(now) for sensor in sensors)), "")

    def _observations_for(self, area: Area, frames: Transformer) -> list[tuple[Observation, NDArray[np.float64]]]:
        """Return the newest unused observation of each source, with its transform."""
        observations = []
        for source in area.parameters.sources:
            key = (source.layer, source.name)
            sensor = self._sensors[source.stream]
            found = sensor.newest(area.used.get(key, -math.inf), area.parameters.global_frame, frames)
            if found is not None:
                observation, transform = found
                observations.append((replace(observation, source=source), transform))
                area.used[key] = observation.stamp
                sensor.used = max(sensor.used, observation.stamp)
        return observations

    def _use_connected(self, frames: Transformer) -> None:
        """Use the newest map of each topic whose frame is connected now; older ones are forgotten, newer ones wait."""
        for topic, waiting in self._waiting.items():
            newer: dict[str, StaticMap] = {}
            for frame in reversed(waiting):
                if frames.lookup(self.global_area.parameters.global_frame, frame, None) is not None:
                    self._use_map(waiting[frame], frame, topic)
                    self._waiting[topic] = newer
                    break
                newer = {frame: waiting[frame], **newer}

    def _use_map(self, static: StaticMap, frame: str, topic: str) -> None:
        if not topic:
            self._map_frames.clear()
        self._map_frames[topic] = frame
        for area in (self.global_area, self.local_area):
            area.costmap.set_map(static, topic)
            area.snapshot = None

    def _map_frame(self, topic: str) -> str:
        return self._map_frames.get(topic) or self._map_frames.get("", "")

    def _map_pose(self, topic: str, area: Area, frames: Transformer) -> Pose | None:
        """Return the pose in the area's frame of the frame of a topic's map."""
        frame = self._map_frame(topic)
        if frame in ("", area.parameters.global_frame):
            return ORIGIN
        matrix = frames.lookup(area.parameters.global_frame, frame, None)
        return None if matrix is None else Pose.from_matrix(matrix)


def _no_transform(source: str, target: str) -> str:
    return f"no transform from {source!r} to {target!r}"
