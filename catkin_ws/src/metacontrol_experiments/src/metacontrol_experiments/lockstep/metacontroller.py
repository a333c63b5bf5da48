"""The meta-controller in lockstep: the observers and the reasoner's core.

Detection and execution take times drawn at random, as on ROS, where messages, processes and the master take their time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml
from geometry_msgs.msg import TransformStamped
from metacontrol_bags.decision import DECIDED, Decision
from metacontrol_bags.record import ComponentReport, QualityReport
from metacontrol_msgs.msg import DiagnosticWords, FunctionGrounding
from mros1_reasoner.knowledge.knowledge_base import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.parameters import ParameterError, Parameters
from mros1_reasoner.pellet.process import make_reasoner
from pybullet_simulator.ros.messages import ODOM, OdometryWriter
from ros_model.io.models import read_system
from ros_model.language.metamodel import compose
from rosgraph_monitor.observers.energy import EnergyQualityObserver
from rosgraph_monitor.observers.safety import SafetyQualityObserver
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage

from metacontrol_experiments.lockstep.delays import DelayError, Delays, read_delays

if TYPE_CHECKING:
    from pathlib import Path

    import genpy
    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.robot.robot import Robot
    from rosgraph_monitor.observer import TopicObserver

REASON_STEPS = 10
"""Steps between two looks of the reasoner: 10 Hz, the fastest observer's rate."""
HEARTBEAT_STEPS = 200
"""Steps between two looks at levels that have merely changed: reasoning_rate, 2 s."""


class ManagerError(RuntimeError):
    """The meta-controller cannot run."""


@dataclass(frozen=True)
class Change:
    """A configuration that is RECONFIGURING or STABLE from now on, and whether that takes navigation to start anew."""

    configuration: str
    state: str
    restarts: bool


@dataclass
class _Pending:
    """A decision under way: when it is decided and done, s, and whether navigation is started anew."""

    decision: Decision
    decided: float
    done: float
    restarts: bool
    begun: bool = False

    def change(self, state: str) -> Change:
        """What it does to the system."""
        return Change(self.decision.to_configuration, state, self.restarts)


class Manager:
    """Observers and reasoner; what they decide is carried out after a while.

    Attributes:
        configuration: name of the one in force.
        decisions: all so far, as a bag would tell them.
        observed: what the observers said, as a bag would tell it.
        components: what the monitor said of components, as a bag would tell it.
    """

    def __init__(
        self, package: Path, robot: Robot, configuration: str, thresholds: dict[str, float], seed: int
    ) -> None:
        """Load the models and start the reasoner's process.

        Args:
            package: metacontrol_sim's folder.
            robot: for its sensors' places.
            configuration: in force at the start.
            thresholds: quality attribute -> required level.
            seed: of the delays.

        Raises:
            ManagerError: models or reasoner cannot be used.
        """
        self.configuration = configuration
        self.decisions: list[Decision] = []
        self.observed: list[QualityReport] = []
        self.components: list[ComponentReport] = []
        self._package = package
        self._base = read_system(package / "models" / "d2.rossystem")
        self._rng = np.random.default_rng([seed, 10])
        try:
            self._delays: Delays = read_delays()
        except DelayError as error:
            raise ManagerError(str(error)) from error
        self._writer = OdometryWriter(ODOM)
        self._safety, self._energy = SafetyQualityObserver(), EnergyQualityObserver()
        self._safety.receive("/tf_static", _static_frames(robot), 0.0)
        self._follow()
        config = yaml.safe_load((package / "config" / "reasoner.yaml").read_text(encoding="utf-8"))
        parameters = Parameters(config | {f"nfr_{name}": level for name, level in thresholds.items()})
        try:
            self._reasoner = make_reasoner()
        except ReasonerError as error:
            raise ManagerError(str(error)) from error
        try:
            knowledge = parameters.knowledge_base()
            objectives = parameters.objectives(knowledge)
            self._reasoner.load(knowledge.ontology)
            behaviour = parameters.settings(knowledge)
            self._core = Mape(knowledge, self._reasoner, objectives, behaviour, wall=lambda: 0.0, name="lockstep")
        except (ParameterError, KnowledgeBaseError, ReasonerError) as error:
            self.close()
            raise ManagerError(str(error)) from error
        self.function = objectives[0].function
        self._core.observe_active(0.0, self.function, configuration, FunctionGrounding.STABLE)
        self._due: list[tuple[float, str, str]] = []  # time, component, status
        self._pending: _Pending | None = None

    def close(self) -> None:
        """End the reasoner's process."""
        self._reasoner.close()

    @property
    def wanted_topics(self) -> set[str]:
        """Topics of sensors that the observers listen to now."""
        return {topic for topic, _ in self._safety.topics}

    def hear(self, topic: str, message: Any, now: float) -> None:
        """Take a sensor's message."""
        if topic in self.wanted_topics:
            self._safety.receive(topic, message, now)

    def component_changed(self, now: float, component: str, works: bool) -> None:
        """A component's node died or came back; the monitor finds out after a while."""
        status = DiagnosticWords.COMPONENT_RECOVERED if works else DiagnosticWords.COMPONENT_FALSE
        self._due.append((now + self._delays.draw("detect", self._rng), component, status))

    def step(self, now: float, step: int, simulation: Simulation, stamp: genpy.Time) -> Change | None:
        """Observe, reason, and carry out.

        Args:
            now: simulated time, s.
            step: number of the simulation's step.
            simulation: what is observed.
            stamp: the same time for messages.

        Returns:
            The change that has just begun or ended, else None.

        Raises:
            ManagerError: the analysis failed.
        """
        found = [entry for entry in self._due if entry[0] <= now]
        for due in found:
            self._due.remove(due)
            self._core.observe_component(now, due[1], due[2], stamp=now)
            self.components.append(ComponentReport(now, due[1], due[2]))
        if step % REASON_STEPS == 0:
            self._observe(now, step, simulation, stamp)
        if self._pending is not None:
            return self._carry_out(now)
        if found or step % REASON_STEPS == 0:
            self._reason(now, heartbeat=step % HEARTBEAT_STEPS == 0)
        return None

    def _observe(self, now: float, step: int, simulation: Simulation, stamp: genpy.Time) -> None:
        odometry = simulation.odometry
        velocity = (*odometry.velocity[:2], odometry.turn_rate)
        self._safety.receive("odometry/filtered", self._writer.write(stamp, odometry.filtered, velocity), now)
        self._evaluate(self._safety, now)
        if step % 100 == 0:
            self._energy.receive("power_load", Float32(simulation.load), now)
            self._evaluate(self._energy, now)

    def _evaluate(self, observer: TopicObserver, now: float) -> None:
        for status in observer.evaluate(now):
            for pair in status.values:
                if status.message == DiagnosticWords.QA_STATUS:
                    self._core.observe_level(now, pair.key, float(pair.value), stamp=now)
                    self.observed.append(QualityReport(now, pair.key, float(pair.value)))
                elif status.message == DiagnosticWords.QA_STALE:
                    self._core.observe_stale(pair.key)
                    self.observed.append(QualityReport(now, pair.key, None))

    def _reason(self, now: float, *, heartbeat: bool) -> None:
        """Let the reasoner look at what is known.

        Raises:
            ManagerError: the analysis failed.
        """
        try:
            decisions = self._core.step(now, heartbeat=heartbeat)
        except ReasonerError as error:
            raise ManagerError(str(error)) from error
        for decision in decisions:
            if decision.state == DECIDED:
                decided = now + self._delays.draw("decide", self._rng)
                names = (decision.from_configuration, decision.to_configuration)
                restarts = len({observation_sources(self._package, name) for name in names}) > 1
                done = decided + self._delays.draw("restart" if restarts else "parameters", self._rng)
                self._pending = _Pending(decision, decided, done, restarts)
            else:
                self.decisions.append(replace(decision, stamp=now))

    def _carry_out(self, now: float) -> Change | None:
        """Begin what is decided by now, and report what is done by now."""
        pending = self._pending
        if pending is None:
            return None
        if not pending.begun and now >= pending.decided:
            pending.begun = True
            self.decisions.append(replace(pending.decision, stamp=now))
            return pending.change(FunctionGrounding.RECONFIGURING)
        if now < pending.done:
            return None
        self._pending = None
        self.configuration = pending.decision.to_configuration
        self._core.observe_active(now, self.function, self.configuration, FunctionGrounding.STABLE)
        self.decisions.append(replace(self._core.report(now, pending.decision.id, True), stamp=now))
        self._follow()
        return pending.change(FunctionGrounding.STABLE)

    def _follow(self) -> None:
        """Let the observers know which system is active."""
        variant = read_system(self._package / "models" / "variants" / f"{self.configuration}.rossystem")
        system = compose(self._base, variant)
        self._safety.follow(system)
        self._energy.follow(system)


def observation_sources(package: Path, configuration: str) -> tuple[str, ...]:
    """Return what a configuration navigates by: between two that differ in it, navigation is started anew."""
    navigation = read_system(package / "models" / "variants" / f"{configuration}.rossystem").component("move_base")
    parameters = navigation.parameters if navigation else ()
    return tuple(str(p.value) for p in parameters if p.key.endswith("observation_sources"))


def _static_frames(robot: Robot) -> TFMessage:
    """Return the frames of the robot's sensors, as robot_state_publisher tells them."""
    transforms = []
    for mount in (robot.front_laser.mount, robot.rear_laser.mount, robot.camera.mount):
        transform = TransformStamped(child_frame_id=mount.frame)
        transform.header.frame_id = "base_link"
        place, turn = transform.transform.translation, transform.transform.rotation
        place.x, place.y, place.z = mount.x, mount.y, mount.z
        turn.z, turn.w = math.sin(mount.yaw / 2.0), math.cos(mount.yaw / 2.0)
        transforms.append(transform)
    return TFMessage(transforms)
