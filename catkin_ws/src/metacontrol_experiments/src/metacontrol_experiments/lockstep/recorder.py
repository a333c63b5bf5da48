"""The record of a mission in lockstep, as a bag would hold it, and the lines of its log."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from metacontrol_bags.record import MissionRecord
from metacontrol_msgs.msg import MissionEvent
from pybullet_simulator.physics.simulation import ENERGY_STEPS, MOTION_STEPS, SAFETY_STEPS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from metacontrol_bags.decision import Decision
    from metacontrol_bags.record import (
        ComponentReport,
        ConfigurationReport,
        Event,
        GoalReport,
        OccupancyMap,
        QualityReport,
    )
    from pybullet_simulator.physics.simulation import Simulation

    from metacontrol_experiments.lockstep.metacontroller import Metacontroller

LOG_STEPS = 10
"""Steps between two lines of the log: 0.1 s."""


class Recorder:
    """Collects what a bag would hold."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.commands: list[float] = []
        self.goals: list[GoalReport] = []
        self.results: list[GoalReport] = []
        self.configurations: list[ConfigurationReport] = []
        self.decisions: list[Decision] = []
        self.observed: list[QualityReport] = []
        self.components: list[ComponentReport] = []
        self._events: list[Event] = []
        self._poses: list[tuple[float, float, float]] = []
        self._safety: list[tuple[float, float]] = []
        self._energy: list[tuple[float, float]] = []
        self._contacts: list[tuple[float, float]] = []

    def take_from(self, metacontroller: Metacontroller) -> None:
        """Keep the reports of the meta-controller."""
        self.decisions, self.observed = metacontroller.decisions, metacontroller.observed
        self.components = metacontroller.components

    def event(self, event: Event) -> None:
        """Keep an event."""
        self._events.append(event)
        values = " ".join(f"{key}={value}" for key, value in event.values.items() if key != "commit")
        self.lines.append(f"{event.stamp:.2f} {event.kind} {event.name} {values}".rstrip())

    def sample(self, simulation: Simulation, step: int, *, started: bool) -> None:
        """Keep what the simulator node would publish after a step."""
        now, pose = simulation.time, simulation.pose
        if step % MOTION_STEPS == 0:
            self._poses.append((now, pose.x, pose.y))
        if step % SAFETY_STEPS == 0:
            self._safety.append((now, simulation.safety))
        if step % ENERGY_STEPS == 0:
            self._energy.append((now, simulation.energy))
        if step % ENERGY_STEPS == 0 or not self._contacts or self._contacts[-1][1] != simulation.contacts:
            self._contacts.append((now, float(simulation.contacts)))
        if started and step % LOG_STEPS == 0:
            numbers = (pose.x, pose.y, pose.yaw, *simulation.velocity, simulation.safety, simulation.energy)
            self.lines.append(f"{now:.2f} " + " ".join(f"{number:.6f}" for number in numbers))

    def record(self, drawn: OccupancyMap, obstacles: Iterable[tuple[float, float]]) -> MissionRecord:
        """Return it as plain data, with the map and the places (m) of the clutter."""
        return MissionRecord(
            events=tuple(self._events),
            poses=np.array(self._poses, dtype=np.float64).reshape(-1, 3),
            true_quality={"safety": tuple(self._safety), "energy": tuple(self._energy)},
            contacts=tuple(self._contacts),
            configurations=tuple(self.configurations),
            decisions=tuple(self.decisions),
            observed=tuple(self.observed),
            components=tuple(self.components),
            goals=tuple(self.goals),
            results=tuple(self.results),
            commands=tuple(self.commands),
            obstacles=tuple(obstacles),
            map=drawn,
            first_stamp=self._poses[0][0],
            last_stamp=self._poses[-1][0],
        )


def with_wall_time(record: MissionRecord, wall_s: float) -> MissionRecord:
    """Return a record whose end tells how long the run took (wall s); the log never does."""
    events = tuple(
        replace(event, values=event.values | {"wall_duration_s": f"{wall_s:.3f}"})
        if event.kind == MissionEvent.MISSION_END
        else event
        for event in record.events
    )
    return replace(record, events=events)
