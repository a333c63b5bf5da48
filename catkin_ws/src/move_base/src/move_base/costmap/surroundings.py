"""The robot's knowledge of its surroundings: both costmaps, updated at their rates from the map and the sensors.

It also tells what keeps them from being current: a missing map or transform, a sensor that is silent.
"""

from __future__ import annotations

import math
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
"""Per topic: maps whose frames are not connected with the costmap's yet."""

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
        self._waiting: dict[str, dict[str, StaticMap]] = {}  # maps, by topic and frame; the newest last

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
        return self._current_pose(self.parameters.robot_base_frame, now, frames)

    def take_map(self, static: StaticMap, topic: str, now: float, frames: Transformer | None) -> str:
        """Use a static map, or have it wait until its frame is connected with the costmap's.

        Returns:
            Why it waits although another one is in use, or an empty text: what is missing is told by `missing_map`.
        """
        if not self.costmap.takes_map(topic):
            return ""
        problem = self._use(static, topic, now, frames)
        if not problem:
            self._waiting.pop(topic, None)
            return ""
        waiting = self._waiting.setdefault(topic, {})
        waiting.pop(static.frame, None)
        waiting[static.frame] = static
        if len(waiting) > KEPT_MAPS:
            waiting.pop(next(iter(waiting)))
        return "" if self.costmap.missing_map() else problem

    def use_connected(self, now: float, frames: Transformer) -> None:
        """Use the newest map of each topic whose frame is connected now; older ones are forgotten, newer ones wait."""
        for topic, waiting in self._waiting.items():
            if not self.costmap.takes_map(topic):  # any more
                waiting.clear()
            newer: dict[str, StaticMap] = {}
            for frame in reversed(waiting):
                if not self._use(waiting[frame], topic, now, frames):
                    self._waiting[topic] = newer
                    break
                newer = {frame: waiting[frame], **newer}

    def missing_map(self, now: float, frames: Transformer) -> str:
        """Return why a static layer has no map yet, or an empty text."""
        topic = self.costmap.missing_map()
        if not topic:
            return ""
        waiting = self._waiting.get(topic) or self._waiting.get("")
        if waiting:
            return self._use(waiting[next(reversed(waiting))], topic, now, frames)
        return f"no map received on {topic}"

    def update_map(self, part: MapPart, topic: str) -> None:
        """Take a part of a static map: of the one in the part's frame, or of the newest, also where that waits.

        Raises:
            MapError: the part is not within the map, or there is none in its frame.
        """
        if not self.costmap.takes_updates(topic):
            return
        waiting = self._waiting.get(topic) or {}
        frame = part.frame or next(reversed(waiting), "")
        if frame in waiting:
            waiting[frame] = waiting[frame].updated(part)
        else:
            self.costmap.update_map(part, topic)
            self.updated = -math.inf

    def map_poses(self, frames: Transformer) -> dict[str, Pose] | str:
        """Return the poses in the costmap's frame of its maps' frames, or which transform is missing."""
        poses = {}
        for frame in sorted(self.costmap.map_frames):
            pose = self._pose(frame, frames)
            if pose is None:
                return _no_transform(frame, self.parameters.global_frame)
            poses[frame] = pose
        return poses

    def _use(self, static: StaticMap, topic: str, now: float, frames: Transformer | None) -> str:
        """Use a static map; return why that can't be, or an empty text."""
        own = static.frame in ("", self.parameters.global_frame)
        pose = ORIGIN if own else self._current_pose(static.frame, now, frames) if frames else None
        if pose is None:
            return _no_transform(static.frame, self.parameters.global_frame)
        try:
            self.costmap.set_map(static, topic, pose)
        except MapError as error:
            return str(error)
        self.snapshot = None
        return ""

    def _pose(self, frame: str, frames: Transformer) -> Pose | None:
        """Return the newest known pose of a frame in the costmap's."""
        if frame in ("", self.parameters.global_frame):
            return ORIGIN
        matrix = frames.lookup(self.parameters.global_frame, frame, None)
        return None if matrix is None else Pose.from_matrix(matrix)

    def _current_pose(self, frame: str, now: float, frames: Transformer) -> Pose | None:
        """Return the pose of a frame in the costmap's; None where there is none, or it is too old."""
        p = self.parameters
        matrix = frames.lookup(p.global_frame, frame, None)
        stamp = frames.newest(p.global_frame, frame)
        if matrix is None or stamp is None or now - stamp > p.transform_tolerance:
            return None
        return Pose.from_matrix(matrix)


class Surroundings:
    """The global and the local costmap, and the sensors of both."""

    def __init__(self, parameters: MoveBaseParameters) -> None:
        self.global_area = Area(parameters.global_costmap)
        self.local_area = Area(parameters.local_costmap)
        self._areas = (self.global_area, self.local_area)
        sources = [*parameters.global_costmap.all_sources, *parameters.local_costmap.all_sources]
        sources.sort(key=lambda source: source.expected_update_rate, reverse=True)  # the shortest period counts
        self._sensors = {source.stream: _Sensor(source) for source in sources}

    def reconfigure(self, parameters: MoveBaseParameters) -> None:
        """Take other parameters while the robot drives: obstacles stay."""
        self.global_area.reconfigure(parameters.global_costmap)
        self.local_area.reconfigure(parameters.local_costmap)

    @property
    def sources(self) -> list[ObservationSource]:
        """The sources to listen to, those that convert a topic's messages alike once."""
        return [sensor.source for sensor in self._sensors.values()]

    def set_map(self, static: StaticMap, topic: str = "", now: float = 0.0, frames: Transformer | None = None) -> str:
        """Take the static map of a topic; without one, it is for all static layers.

        A map waits in each costmap until its frame is connected with that of the costmap. The one before stays in use
        meanwhile: anybody may publish a map.

        Args:
            static: the map. Without a frame, it lies in the global costmap's.
            topic: where it comes from.
            now: time in s.
            frames: the transforms; without them, only the costmap's own frame counts as connected at once.

        Returns:
            Why it waits while another one stays in use, or an empty text.
        """
        static = static if static.frame else replace(static, frame=self.global_area.parameters.global_frame)
        problems = [area.take_map(static, topic, now, frames) for area in self._areas]
        return next(filter(None, problems), "")

    def update_map(self, part: MapPart, topic: str) -> None:
        """Take a part of the static map of a topic.

        Raises:
            MapError: the part is not within the map, or there is none in its frame.
        """
        problems = []
        for area in self._areas:
            try:
                area.update_map(part, topic)
            except MapError as error:
                problems.append(error)
        if problems:
            raise problems[0]

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
        for area in self._areas:
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
        for area, pose in ((self.local_area, local_robot), (self.global_area, robot)):
            area.use_connected(now, frames)
            missing = area.missing_map(now, frames)
            if missing:
                return missing
            if pose is None or not area.due(now):
                continue
            map_poses = area.map_poses(frames)
            if isinstance(map_poses, str):
                return map_poses
            area.snapshot = area.costmap.update(pose, self._observations_for(area, frames), map_poses)
            area.updated_at(now)
        for area, pose in ((self.global_area, robot), (self.local_area, local_robot)):
            if pose is None:
                p = area.parameters
                return f"no current transform from {p.robot_base_frame!r} to {p.global_frame!r}"
        return ""

    def stale_reason(self, now: float) -> str:
        """Name the first source whose data are too old, or return an empty text."""
        used = {source.stream for area in self._areas for source in area.parameters.sources}
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


def _no_transform(source: str, target: str) -> str:
    return f"no transform from {source!r} to {target!r}"
