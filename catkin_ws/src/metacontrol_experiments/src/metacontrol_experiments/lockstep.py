"""Lockstep: simulation, drivers, navigation, observers, reasoner and mission stepped together in one process, no ROS.

Deterministic: the same settings give the same log, byte for byte. What differs from ROS: messages take no time, nothing
ever waits for a processor, and detection and reconfiguration take times drawn at random (`lockstep_manager`).
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import rospkg
import yaml
from metacontrol_sim.clutter import ClutterError, scatter
from metacontrol_sim.faults import Fault, Outlet
from metacontrol_sim.geometry import Pose
from metacontrol_sim.grid_messages import occupancy_grid
from metacontrol_sim.messages import stamp
from metacontrol_sim.motion_sensors import REAL
from metacontrol_sim.obstacles import CLUTTER_MASS, CLUTTER_SIZE, ObstacleError
from metacontrol_sim.sensor_messages import laser_scan, point_cloud
from metacontrol_sim.sensors import DepthProjector, measure_depth, measure_ranges
from metacontrol_sim.simulation import (
    ENERGY_STEPS,
    LOCALISATION_STEPS,
    MOTION_STEPS,
    SAFETY_STEPS,
    STEP,
    Simulation,
    SimulationError,
)
from metacontrol_sim.simulation import Settings as SimulationSettings
from metacontrol_sim.world import Box, WorldError, rasterise
from metacontrol_sim.world_file import read_world
from move_base import geometry
from move_base.costmap import StaticMap
from move_base.navigator import Navigator
from move_base.navigator import Outcome as GoalOutcome
from move_base.parameters import MoveBaseParameters, read_parameters
from move_base.sensors import cloud_observation, scan_observation
from ros_model.reader import read_system

from metacontrol_experiments import mission
from metacontrol_experiments.contingency import Kind
from metacontrol_experiments.lockstep_frames import Frames
from metacontrol_experiments.lockstep_manager import Manager, ManagerError
from metacontrol_experiments.mission import GoalStatus, Strike
from metacontrol_experiments.record import (
    ComponentReport,
    ConfigurationReport,
    DecisionReport,
    Event,
    GoalReport,
    MissionRecord,
    OccupancyMap,
    QualityReport,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from metacontrol_experiments.contingency import Contingency
    from metacontrol_experiments.mission import State
    from metacontrol_experiments.settings import Settings

SENSOR_STEPS = 10
"""Steps between two scans or images: 10 Hz, as the simulator node's defaults."""
SETTLE_S = 2.0
"""Simulated seconds before the goal, in which sensors and costmaps come up."""
LASER_NOISE, DEPTH_NOISE = 0.01, 0.001
"""Defaults of the driver nodes."""

_GOAL_ID = "lockstep-1"
_OCCUPIED = 50


class LockstepError(RuntimeError):
    """The mission cannot be run in lockstep; the message says why."""


@dataclass(frozen=True)
class Outcome:
    """What is left of a run.

    Attributes:
        state: the mission's last state.
        record: what a bag would tell.
        log: a text, one line per 0.1 s and one per event.
    """

    state: State
    record: MissionRecord
    log: str


class Drivers:
    """The front laser's and the camera's driver; one that does not run is silent."""

    TOPICS = ("front/scan", "camera/depth/points")

    def __init__(self, simulation: Simulation, seed: int) -> None:
        """Start both, with the random numbers that the nodes have."""
        self._simulation = simulation
        self._laser_rng = np.random.default_rng([seed, 3])
        self._camera_rng = np.random.default_rng([seed, 8])
        camera = simulation.robot.camera
        self._projector = DepthProjector(camera.width, camera.height, camera.field_of_view)
        self._silent: dict[str, Kind] = {}  # component -> what made it so
        self._outlets = {"front_laser": Outlet(), "camera": Outlet(), "rear_laser": Outlet()}

    def strike(self, kind: Kind, component: str) -> None:
        """Let something happen to a driver; only what was frozen thaws."""
        if kind.spoils_data:
            self._outlets[component].fault = Fault(kind.value)
        elif kind is not Kind.THAW:
            self._silent[component] = kind
        else:
            self._outlets[component].fault = None
            if self._silent.get(component) is Kind.FREEZE:
                del self._silent[component]

    def message(self, topic: str, stamp: Any) -> Any | None:
        """Return a driver's message, a ROS one so that navigation takes it as on ROS; None where it is silent."""
        robot = self._simulation.robot
        if topic == "front/scan":
            if "front_laser" in self._silent:
                return None
            laser = robot.front_laser
            ranges = self._simulation.scan(laser)
            noisy = measure_ranges(ranges, laser.range_min, laser.range_max, LASER_NOISE, self._laser_rng)
            return self._outlets["front_laser"].pass_on(laser_scan(laser, noisy, stamp))
        if topic.strip("/") == "camera/depth/points":
            if "camera" in self._silent:
                return None
            depth = measure_depth(self._simulation.depth_image(), self._simulation.light, DEPTH_NOISE, self._camera_rng)
            points = self._projector.points(depth, robot.camera.range_min, robot.camera.range_max)
            return self._outlets["camera"].pass_on(point_cloud(points, robot.camera.mount.frame, stamp))
        raise LockstepError(f"navigation wants {topic}, which no driver publishes in lockstep")


class Lockstep:
    """One mission, stepped."""

    def __init__(self, settings: Settings, simulation_package: Path | None = None) -> None:
        """Build world, robot and navigation.

        Raises:
            LockstepError: something of it is not there in lockstep, or cannot be used.
        """
        package = simulation_package or Path(rospkg.RosPack().get_path("metacontrol_sim"))
        self._settings = settings
        self._plan = settings.plan
        for contingency in self._plan.contingencies:
            _check_target(contingency)
        start = settings.route.start
        errors = SimulationSettings(Pose(start.x, start.y, start.yaw), settings.seed, REAL)
        try:
            world = read_world(settings.world or package / "worlds" / "factory.yaml")
            self._grid = rasterise(world)
            self._simulation = Simulation(world, errors)
        except (WorldError, SimulationError) as error:
            raise LockstepError(str(error)) from error
        self._frames = Frames(self._simulation.robot)
        self._drivers = Drivers(self._simulation, settings.seed)
        self._package = package
        self._parameters = navigation_parameters(package, settings.initial_configuration)
        self._navigator: Navigator | None = self._new_navigator()
        self._manager = None
        if settings.metacontrol:
            robot, configuration = self._simulation.robot, settings.initial_configuration
            try:
                self._manager = Manager(package, robot, configuration, settings.thresholds, settings.seed)
            except ManagerError as error:
                self._simulation.close()
                raise LockstepError(str(error)) from error
        self._steps = 0
        self._next_tick = 0.0
        self._state: State | None = None
        self._memory = _Memory()

    def run(self) -> Outcome:
        """Run the mission to its end.

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
            self._end()
        finally:
            self._simulation.close()
            if self._manager is not None:
                self._manager.close()
        if self._manager is not None:
            self._memory.decisions, self._memory.observed = self._manager.decisions, self._manager.observed
            self._memory.components = self._manager.components
        return Outcome(self._mission, self._memory.record(self._map()), "\n".join(self._memory.lines) + "\n")

    @property
    def _mission(self) -> State:
        if self._state is None:
            raise RuntimeError("the mission has not started")
        return self._state

    def _begin(self) -> None:
        """Let clutter lie there, then send the goal."""
        struck = [(entry.event, self._strike(entry)) for entry in self._plan.contingencies if entry.when.at_start]
        now, pose = self._simulation.time, self._simulation.localised
        self._state = mission.start(self._plan, now, pose.x, pose.y)
        told = self._settings.describe() | {
            "engine": "lockstep",
            "controller_hz": repr(self._parameters.controller_frequency),
        }
        self._memory.event(Event(now, "MISSION_START", self._settings.route.name, told))
        for name, values in struck:
            self._memory.event(Event(now, "PERTURBATION", name, {"share": "0.0000"} | values))
        self._set_goal(now)
        self._memory.goals.append(GoalReport(now, _GOAL_ID))
        self._memory.configurations.append(
            ConfigurationReport(now, "f_navigate", self._settings.initial_configuration, "STABLE")
        )

    def _end(self) -> None:
        state = self._mission
        told = {"outcome": state.outcome.value if state.outcome else "unknown", "reason": state.reason}
        now = state.ended_s if state.ended_s is not None else self._simulation.time
        self._memory.event(Event(now, "MISSION_END", self._settings.route.name, told))

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
        if now >= self._next_tick - 1e-9:
            self._next_tick = max(self._next_tick, now - STEP) + 1.0 / self._parameters.controller_frequency
            self._navigate(now)
        self._manage(now)
        self._memory.sample(simulation, self._steps, started=self._state is not None)
        if self._state is not None:
            self._follow(now)

    def _sense(self, now: float) -> None:
        """Let the drivers measure that somebody listens to, and hand it on."""
        sources = {source.topic: source for source in self._navigator.sources} if self._navigator else {}
        heard = self._manager.wanted_topics if self._manager else set()
        for topic in Drivers.TOPICS:
            if topic not in sources and topic not in heard:
                continue
            message = self._drivers.message(topic, _stamp(now))
            if message is None:
                continue
            if self._manager is not None:
                self._manager.hear(topic, message, now)
            if self._navigator is not None and topic in sources:
                convert = scan_observation if sources[topic].data_type == "LaserScan" else cloud_observation
                self._navigator.observe(convert(message, sources[topic]), now)

    def _manage(self, now: float) -> None:
        """Let the meta-controller do its part, and deploy what it has decided."""
        if self._manager is None or self._state is None:
            return
        try:
            change = self._manager.step(now, self._steps, self._simulation, _stamp(now))
        except ManagerError as error:
            raise LockstepError(str(error)) from error
        if change is None:
            return
        configuration, state = change
        new = navigation_parameters(self._package, configuration)
        restarts = _sources(new) != _sources(self._parameters)
        self._memory.configurations.append(ConfigurationReport(now, self._manager.function, configuration, state))
        self._memory.lines.append(f"{now:.2f} {configuration} {state}")
        self._state, _ = mission.on_configuration(self._mission, now, state == "STABLE")
        if state != "STABLE":
            if restarts:
                self._navigator = None  # its process is stopped first
            return
        self._parameters = new
        if self._navigator is None:
            self._navigator = self._new_navigator()
            self._set_goal(now)
        else:
            self._navigator.reconfigure(new)

    def _new_navigator(self) -> Navigator:
        navigator = Navigator(self._parameters)
        message = occupancy_grid(self._grid, _stamp(0.0))
        info = message.info
        origin = (self._grid.origin_x, self._grid.origin_y, self._grid.origin_yaw)
        navigator.set_map(StaticMap.create(message.data, info.width, info.height, info.resolution, origin), "map")
        return navigator

    def _set_goal(self, now: float) -> None:
        goal = self._settings.route.goal
        if self._navigator is not None:
            self._navigator.set_goal(geometry.Pose(goal.x, goal.y, goal.yaw), now)

    def _navigate(self, now: float) -> None:
        if self._navigator is None:
            return
        odometry = self._simulation.odometry
        velocity = geometry.Velocity(*odometry.velocity[:2], odometry.turn_rate)
        result = self._navigator.step(now, self._frames, velocity)
        if result.velocity is not None:
            command = result.velocity
            self._simulation.command(command.x, command.y, command.yaw)
            self._memory.commands.append(now)
        if result.outcome is not None and self._state is not None:
            status = GoalStatus.SUCCEEDED if result.outcome is GoalOutcome.SUCCEEDED else GoalStatus.ABORTED
            self._memory.results.append(GoalReport(now, _GOAL_ID, status.value, result.text))
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
            if isinstance(action, Strike):
                contingency = self._plan.contingencies[action.index]
                share = {"share": f"{self._mission.share:.4f}"}
                try:
                    values = self._strike(contingency)
                except LockstepError as error:
                    reason = f"a contingency could not strike: {error}"
                    self._state = mission.abort(self._mission, self._simulation.time, reason)
                    return
                event = Event(self._simulation.time, "PERTURBATION", contingency.event, share | values)
                self._memory.event(event)

    def _strike(self, contingency: Contingency) -> dict[str, str]:
        """Let a contingency happen now; return what is worth telling of it.

        Raises:
            LockstepError: it cannot.
        """
        simulation, kind = self._simulation, contingency.kind
        if kind.hits_component:
            self._drivers.strike(kind, contingency.target)
            if self._manager is not None and not kind.spoils_data:
                self._manager.component_changed(simulation.time, contingency.target, kind is Kind.THAW)
            return {"how": kind.value}
        if kind is Kind.POWER:
            simulation.set_consumption_factor(contingency.value)
            return {"factor": f"{contingency.value:g}"}
        if kind is Kind.LIGHT:
            simulation.set_light(contingency.value)
            return {"light": f"{contingency.value:g}"}
        return self._clutter(contingency)

    def _clutter(self, contingency: Contingency) -> dict[str, str]:
        start, goal = self._settings.route.start, self._settings.route.goal
        places = tuple(Pose(x, y, 0.0) for x, y in contingency.places)
        try:
            if not places:
                way = (Pose(start.x, start.y, start.yaw), Pose(goal.x, goal.y, goal.yaw))
                places = scatter(self._grid, *way, contingency.count, contingency.seed or 0)
            for place in places:
                box = Box("", "clutter", place.x, place.y, *CLUTTER_SIZE, place.yaw)
                self._simulation.spawn(box, CLUTTER_MASS)
        except (ClutterError, ObstacleError) as error:
            raise LockstepError(f"{contingency}: {error}") from error
        self._memory.obstacles += [(round(place.x, 1), round(place.y, 1)) for place in places]
        return {"places": " ".join(f"{place.x:.3f},{place.y:.3f}" for place in places)}

    def _map(self) -> OccupancyMap:
        grid = self._grid
        return OccupancyMap(grid.resolution, grid.origin_x, grid.origin_y, grid.cells >= _OCCUPIED)


class _Memory:
    """Collects what a bag would hold."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.commands: list[float] = []
        self.obstacles: list[tuple[float, float]] = []
        self.goals: list[GoalReport] = []
        self.results: list[GoalReport] = []
        self.configurations: list[ConfigurationReport] = []
        self.decisions: list[DecisionReport] = []
        self.observed: list[QualityReport] = []
        self.components: list[ComponentReport] = []
        self._events: list[Event] = []
        self._poses: list[tuple[float, float, float]] = []
        self._safety: list[tuple[float, float]] = []
        self._energy: list[tuple[float, float]] = []
        self._contacts: list[tuple[float, float]] = []

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
        if started and step % SENSOR_STEPS == 0:
            numbers = (pose.x, pose.y, pose.yaw, *simulation.velocity, simulation.safety, simulation.energy)
            self.lines.append(f"{now:.2f} " + " ".join(f"{number:.6f}" for number in numbers))

    def record(self, drawn: OccupancyMap) -> MissionRecord:
        """Return it as plain data."""
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
            obstacles=tuple(self.obstacles),
            map=drawn,
            first_stamp=self._poses[0][0],
            last_stamp=self._poses[-1][0],
        )


def with_wall_time(record: MissionRecord, wall_s: float) -> MissionRecord:
    """Return a record whose end tells how long the run took (wall s); the log never does."""
    events = tuple(
        replace(event, values=event.values | {"wall_duration_s": f"{wall_s:.3f}"})
        if event.kind == "MISSION_END"
        else event
        for event in record.events
    )
    return replace(record, events=events)


def navigation_parameters(package: Path, configuration: str) -> MoveBaseParameters:
    """Return the parameters of a variant over those that all share, as the launch files load them.

    Raises:
        LockstepError: the variant has no move_base.
    """
    tree = yaml.safe_load((package / "config" / "move_base.yaml").read_text(encoding="utf-8"))
    component = read_system(package / "models" / "variants" / f"{configuration}.rossystem").component("move_base")
    if component is None:
        raise LockstepError(f"{configuration} has no component move_base, which lockstep needs")
    tree = json.loads(json.dumps(tree))  # what the file's anchors share is no longer one object
    for path, value in _values(component):
        *folders, name = path.split("/")
        branch = tree
        for folder in folders:
            branch = branch.setdefault(folder, {})
        branch[name] = value
    return read_parameters(tree)


def _values(component: Any) -> Iterator[tuple[str, Any]]:
    """Yield the names in the node's namespace, and the values, of a component's parameters."""
    for parameter in component.parameters:
        if parameter.value is not None:
            yield parameter.key, parameter.value


def _sources(parameters: MoveBaseParameters) -> tuple[str, ...]:
    return tuple(source.topic for source in parameters.global_costmap.sources)


def _check_target(contingency: Contingency) -> None:
    """Raise LockstepError for a component that does not run in lockstep."""
    known = ("front_laser", "rear_laser", "camera")
    if contingency.kind.hits_component and contingency.target not in known:
        raise LockstepError(f"{contingency}: in lockstep there are only the components {', '.join(known)}")


def _stamp(now: float) -> Any:
    return stamp(round(now * 1e9))
