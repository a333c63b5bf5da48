"""Lockstep: simulation, drivers, navigation, observers, reasoner and mission stepped together, without ROS.

Deterministic: the same settings give the same log, byte for byte. What differs from ROS: messages take no time, nothing
ever waits for a processor, and detection and reconfiguration take times drawn at random (`metacontroller`).
`io.lockstep_setup` reads the files and puts the parts together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
from metacontrol_bags.goal_status import GoalStatus
from metacontrol_bags.record import ConfigurationReport, Event, GoalReport, MissionRecord, OccupancyMap
from metacontrol_msgs.msg import FunctionGrounding, MissionEvent
from move_base.navigation.result import Outcome as GoalOutcome
from pybullet_simulator.physics.simulation import LOCALISATION_STEPS, MOTION_STEPS

from metacontrol_experiments.contingency.contingency import InjectionError, Kind
from metacontrol_experiments.lockstep.fault_injection import FaultInjector, check
from metacontrol_experiments.lockstep.frames import Frames
from metacontrol_experiments.lockstep.navigation import Navigation
from metacontrol_experiments.lockstep.reconfiguration import navigation_parameters
from metacontrol_experiments.lockstep.recorder import Recorder
from metacontrol_experiments.lockstep.robot_topics import stamp_at
from metacontrol_experiments.lockstep.system import LockstepError
from metacontrol_experiments.managers.manager import Restart
from metacontrol_experiments.mission import mission
from metacontrol_experiments.mission.mission import Inject
from metacontrol_experiments.mission.settings import LOCKSTEP

if TYPE_CHECKING:
    from collections.abc import Callable

    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.world.grid import Grid

    from metacontrol_experiments.contingency.contingency import Contingency
    from metacontrol_experiments.lockstep.drivers import Drivers
    from metacontrol_experiments.lockstep.metacontroller import Change, Metacontroller
    from metacontrol_experiments.lockstep.system import System
    from metacontrol_experiments.mission.mission import State
    from metacontrol_experiments.mission.settings import Settings

SENSOR_STEPS = 10
"""Steps between two scans or images: 10 Hz, as the simulator node's defaults."""
SETTLE_S = 2.0
"""Simulated seconds before the goal, in which sensors and costmaps come up."""

_GOAL_ID = "lockstep-1"
_OCCUPIED = 50


@dataclass(frozen=True)
class Outcome:
    """The results of a run.

    Attributes:
        state: the mission's last state.
        record: what a bag would tell.
        log: a text, one line per 0.1 s and one per event.
    """

    state: State
    record: MissionRecord
    log: str


@dataclass(frozen=True)
class Robot:
    """The simulated robot in its world.

    Attributes:
        simulation: of robot and world.
        grid: the world's map.
        drivers: of the sensors.
    """

    simulation: Simulation
    grid: Grid
    drivers: Drivers


class Lockstep:
    """One mission, stepped."""

    def __init__(self, settings: Settings, robot: Robot, system: System, metacontroller: Metacontroller) -> None:
        """Start navigation.

        Args:
            settings: the mission.
            robot: at the start of the route.
            system: what runs beside the robot.
            metacontroller: what observes, and what adapts.

        Raises:
            LockstepError: a contingency cannot happen in lockstep, or the initial configuration cannot run.
        """
        self._settings = settings
        self._plan = settings.plan
        try:
            for contingency in self._plan.contingencies:
                check(contingency, robot.drivers.components)
        except InjectionError as error:
            raise LockstepError(str(error)) from error
        self._grid = robot.grid
        self._simulation = robot.simulation
        self._drivers = robot.drivers
        self._system = system
        self._metacontroller = metacontroller
        self._frames = Frames(self._simulation.robot)
        way = settings.route.start, settings.route.goal
        self._injector = FaultInjector(self._simulation, self._drivers, self._grid, way)
        self._navigation = Navigation(navigation_parameters(system, settings.initial_configuration), robot.grid)
        self._steps = 0
        self._state: State | None = None
        self._recorder = Recorder()

    def run(self, watch: Callable[[Simulation], None] = lambda _simulation: None) -> Outcome:
        """Run the mission to its end.

        Args:
            watch: is called after each step of 10 ms.

        Raises:
            LockstepError: a contingency of the start cannot happen, or an analysis failed.
            MissionError: the goal is no goal from here.
        """
        cv2.setNumThreads(1)  # as in navigation's own process
        try:
            while self._simulation.time < 1.0 + SETTLE_S:
                self._step()
            self._begin()
            while not self._mission.over:
                self._step()
                watch(self._simulation)
            self._end()
        finally:
            self.close()
        self._recorder.take_from(self._metacontroller)
        record = self._recorder.record(self._drawn_map(), self._injector.obstacles)
        return Outcome(self._mission, record, "\n".join(self._recorder.lines) + "\n")

    def close(self) -> None:
        """End simulation and manager."""
        self._simulation.close()
        self._metacontroller.close()

    @property
    def _mission(self) -> State:
        if self._state is None:
            raise RuntimeError("the mission has not started")
        return self._state

    def _begin(self) -> None:
        """Inject the contingencies of the start, then send the goal.

        Raises:
            LockstepError: something of the start cannot happen.
            MissionError: the goal is no goal from here.
        """
        due = [entry for entry in self._plan.contingencies if entry.when.at_start]
        try:
            injected = [(entry.event, self._inject(entry)) for entry in due]
        except InjectionError as error:
            raise LockstepError(str(error)) from error
        now, pose = self._simulation.time, self._simulation.localised
        self._state = mission.start(self._plan, now, pose.x, pose.y)
        told = self._settings.describe() | {
            "engine": LOCKSTEP,
            "controller_hz": repr(self._navigation.parameters.controller_frequency),
        }
        self._recorder.event(Event(now, MissionEvent.MISSION_START, self._settings.route.name, told))
        for name, values in injected:
            self._recorder.event(Event(now, MissionEvent.PERTURBATION, name, {"share": "0.0000"} | values))
        self._navigation.set_goal(self._settings.route.goal, now)
        self._recorder.goals.append(GoalReport(now, _GOAL_ID))
        initial = self._settings.initial_configuration
        self._recorder.configurations.append(
            ConfigurationReport(now, self._system.function(initial), initial, FunctionGrounding.STABLE)
        )

    def _end(self) -> None:
        state = self._mission
        told = {"outcome": state.outcome.value if state.outcome else "unknown", "reason": state.reason}
        now = state.ended_s if state.ended_s is not None else self._simulation.time
        self._recorder.event(Event(now, MissionEvent.MISSION_END, self._settings.route.name, told))

    def _step(self) -> None:
        """Advance everything by 10 ms: the world, what senses it, what drives through it, and the mission."""
        simulation = self._simulation
        simulation.step()
        self._steps += 1
        now = simulation.time
        if self._steps % MOTION_STEPS == 0:
            self._frames.add(now, simulation.map_to_odom, simulation.odometry.filtered)
        if self._steps % SENSOR_STEPS == 0:
            self._sense(now)
        self._navigate(now)
        self._manage(now)
        self._recorder.sample(simulation, self._steps, started=self._state is not None)
        if self._state is not None:
            self._follow(now)

    def _sense(self, now: float) -> None:
        """Make the drivers that have listeners measure, and pass on their messages."""
        heard = self._navigation.topics | self._metacontroller.wanted_topics
        for topic in self._drivers.topics:
            message = self._drivers.message(topic, stamp_at(now)) if topic in heard else None
            if message is None:
                continue
            self._metacontroller.receive(topic, message, now)
            self._navigation.receive(topic, message, now)

    def _manage(self, now: float) -> None:
        """Step the meta-controller, and do what it decides."""
        self._metacontroller.listen(self._simulation, self._steps, now)
        if self._state is None:
            return
        for change in self._metacontroller.step(now, self._steps):
            if isinstance(change, Restart):
                self._start_driver(change.component, now)
            else:
                self._deploy(change, now)

    def _start_driver(self, component: str, now: float) -> None:
        """Start a dead driver again; it ends at once where its device is gone."""
        runs = self._drivers.start(component)
        self._recorder.lines.append(f"{now:.2f} {component} {'started again' if runs else 'has no device'}")
        if runs:
            self._metacontroller.component_changed(now, component, works=True)
        else:
            self._metacontroller.ended(now, component)

    def _deploy(self, change: Change, now: float) -> None:
        """Let a change happen to navigation."""
        name, state = change.configuration, change.state
        self._recorder.configurations.append(ConfigurationReport(now, self._system.function(name), name, state))
        self._recorder.lines.append(f"{now:.2f} {name} {state}")
        self._state, _ = mission.on_configuration(self._mission, now, state == FunctionGrounding.STABLE)
        if state != FunctionGrounding.STABLE:
            if change.restarts:
                self._navigation.stop()
            return
        self._navigation.deploy(navigation_parameters(self._system, name), self._settings.route.goal, now)

    def _navigate(self, now: float) -> None:
        """Let navigation drive the robot."""
        result = self._navigation.step(now, self._frames, self._simulation.odometry)
        if result is None:
            return
        if result.velocity is not None:
            command = result.velocity
            self._simulation.command(command.x, command.y, command.yaw)
            self._recorder.commands.append(now)
        if result.outcome is not None and self._state is not None:
            status = GoalStatus.SUCCEEDED if result.outcome is GoalOutcome.SUCCEEDED else GoalStatus.ABORTED
            self._recorder.results.append(GoalReport(now, _GOAL_ID, status.value, result.text))
            self._state, _ = mission.on_goal_result(self._state, now, status, result.text)

    def _follow(self, now: float) -> None:
        """Feed the mission's state machine as the node /mission does."""
        if self._steps % LOCALISATION_STEPS == 0:
            pose = self._simulation.localised
            self._take(mission.on_pose(self._plan, self._mission, now, pose.x, pose.y))
            self._state, _ = mission.on_goal_status(self._mission, now, GoalStatus.ACTIVE)
        self._take(mission.on_time(self._plan, self._mission, now))

    def _take(self, step: mission.Step) -> None:
        self._state, actions = step
        for action in actions:
            if isinstance(action, Inject):
                contingency = self._plan.contingencies[action.index]
                share = {"share": f"{self._mission.share:.4f}"}
                try:
                    values = self._inject(contingency)
                except InjectionError as error:
                    reason = f"a contingency could not strike: {error}"
                    self._state = mission.abort(self._mission, self._simulation.time, reason)
                    return
                event = Event(self._simulation.time, MissionEvent.PERTURBATION, contingency.event, share | values)
                self._recorder.event(event)

    def _inject(self, contingency: Contingency) -> dict[str, str]:
        """Make a contingency happen now; return a description of it.

        Raises:
            InjectionError: it cannot.
        """
        values = self._injector.inject(contingency)
        kind = contingency.kind
        if kind.hits_component and not kind.spoils_data:
            self._metacontroller.component_changed(self._simulation.time, contingency.target, kind is Kind.THAW)
        if kind.ends_process:
            self._metacontroller.ended(self._simulation.time, contingency.target)
        return values

    def _drawn_map(self) -> OccupancyMap:
        grid = self._grid
        return OccupancyMap(grid.resolution, grid.origin_x, grid.origin_y, grid.cells >= _OCCUPIED)
