"""What runs beside the robot in lockstep: observers, a manager and the manipulator's plans.

Detection and execution take times drawn at random, as on ROS, where messages, processes and the master take their time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_bags.decision import DECIDED, Decision
from metacontrol_bags.messages import diagnostics
from metacontrol_bags.record import ComponentReport, QualityReport
from metacontrol_msgs.msg import DiagnosticWords, FunctionGrounding
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.entries import ActiveFact
from pybullet_simulator.physics.simulation import STEP
from rosgraph_monitor.graph.desired import DesiredModel, Grounding

from metacontrol_experiments.lockstep.reconfiguration import plan_change, restarts
from metacontrol_experiments.lockstep.robot_topics import stamp_at
from metacontrol_experiments.lockstep.system import LockstepError
from metacontrol_experiments.managers.manager import Restart

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mros1_reasoner.loop.diagnostics import DiagnosticsReader
    from pybullet_simulator.physics.simulation import Simulation
    from rosgraph_manipulator.change.tactics import Tactic

    from metacontrol_experiments.lockstep.delays import Delays
    from metacontrol_experiments.lockstep.observation import Observers
    from metacontrol_experiments.lockstep.system import System
    from metacontrol_experiments.managers.manager import Manager

REASON_STEPS = 10
"""Steps between two looks of the reasoner: 10 Hz, the fastest observer's rate."""


@dataclass(frozen=True)
class Cores:
    """The parts that decide, of the nodes beside the robot.

    Attributes:
        manager: what adapts; where it observes nothing, the other parts are not used.
        observers: of the monitor.
        reader: of what observers say.
        period: of reasoning while only levels change, s.
        tactics: of the manipulator, by name.
    """

    manager: Manager
    observers: Observers
    reader: DiagnosticsReader
    period: float
    tactics: Mapping[str, Tactic]


@dataclass(frozen=True)
class Change:
    """A configuration that is RECONFIGURING or STABLE from now on, and whether its nodes are started anew."""

    configuration: str
    state: str
    restarts: bool


@dataclass
class _Pending:
    """A decision under way: whether it starts nodes anew, and when it is decided and done, s."""

    decision: Decision
    restarts: bool
    decided: float
    done: float
    begun: bool = False

    def change(self, state: str) -> Change:
        """Return what it does to the system."""
        return Change(self.decision.to_configuration, state, self.restarts)


class Metacontroller:
    """Observes, lets the manager decide, and carries out its decisions after a while.

    Attributes:
        configuration: name of the one in force.
        decisions: all so far, as a bag would tell them.
        observed: what the observers said, as a bag would tell it.
        components: what the monitor said of components, as a bag would tell it.
    """

    def __init__(self, system: System, cores: Cores, delays: Delays, configuration: str, seed: int) -> None:
        """Start with a configuration in force.

        Args:
            system: what can be deployed.
            cores: what decides.
            delays: times that things take on ROS.
            configuration: in force at the start.
            seed: of the delays.
        """
        self.configuration = configuration
        self.decisions: list[Decision] = []
        self.observed: list[QualityReport] = []
        self.components: list[ComponentReport] = []
        self._system = system
        self._cores = cores
        self._delays = delays
        self._rng = np.random.default_rng([seed, 10])
        self._desired = DesiredModel(system.base, system.variant)
        self._heartbeat_steps = max(1, round(cores.period / STEP))
        self._due: list[tuple[float, str, str]] = []  # time, component, status
        self._pending: _Pending | None = None
        if cores.manager.observes:
            self._take_active(0.0)

    @property
    def wanted_topics(self) -> set[str]:
        """Topics that the observers listen to now."""
        return self._cores.observers.wanted_topics

    def close(self) -> None:
        """End the manager."""
        self._cores.manager.close()

    def receive(self, topic: str, message: Any, now: float) -> None:
        """Take a sensor's message."""
        self._cores.observers.receive(topic, message, now)

    def listen(self, simulation: Simulation, step: int, now: float) -> None:
        """Take what the robot publishes in this step."""
        self._cores.observers.listen(simulation, step, now)

    def ended(self, now: float, component: str) -> None:
        """Note that the process of a component's driver has ended."""
        self._cores.manager.ended(now, component)

    def component_changed(self, now: float, component: str, works: bool) -> None:
        """Note that a component's node died or came back; the monitor detects it after a while."""
        if not self._cores.manager.observes:
            return
        status = DiagnosticWords.COMPONENT_RECOVERED if works else DiagnosticWords.COMPONENT_FALSE
        self._due.append((now + self._delays.draw("detect", self._rng), component, status))

    def step(self, now: float, step: int) -> list[Change | Restart]:
        """Observe, reason, and carry out.

        Args:
            now: simulated time, s.
            step: number of the simulation's step.

        Returns:
            The changes that have just begun or ended, and drivers to start again.

        Raises:
            LockstepError: an observer or the analysis failed, or what was decided cannot be deployed.
        """
        found = [entry for entry in self._due if entry[0] <= now]
        for due in found:
            self._due.remove(due)
            self._take_statuses([_component_status(due[1], due[2])], now)
        for statuses in self._cores.observers.evaluate(step, now):
            self._take_statuses(statuses, now)
        if self._pending is not None:
            return self._carry_out(now)
        if found or step % REASON_STEPS == 0:
            return self._reason(now, heartbeat=step % self._heartbeat_steps == 0)
        return []

    def _take_statuses(self, statuses: list[DiagnosticStatus], now: float) -> None:
        """Take in what the monitor or an observer says, as the reasoner's node does."""
        array = DiagnosticArray(status=statuses)
        array.header.stamp = stamp_at(now)
        reports = diagnostics(array, now)
        self.observed += [report for report in reports if isinstance(report, QualityReport)]
        self.components += [report for report in reports if isinstance(report, ComponentReport)]
        for fact in self._cores.reader.read(statuses).facts:
            self._cores.manager.take(now, fact)

    def _reason(self, now: float, *, heartbeat: bool) -> list[Change | Restart]:
        """Let the manager decide, and return the drivers to start again.

        Raises:
            LockstepError: the analysis failed, or what was decided cannot be deployed.
        """
        try:
            decisions = self._cores.manager.step(now, heartbeat=heartbeat)
        except ReasonerError as error:
            raise LockstepError(str(error)) from error
        again: list[Change | Restart] = [decision for decision in decisions if isinstance(decision, Restart)]
        for decision in decisions:
            if isinstance(decision, Restart):
                continue
            if decision.state == DECIDED and not decision.repair:
                self._pending = self._prepare(decision, now)
                continue
            self.decisions.append(replace(decision, stamp=now))
            if decision.state == DECIDED:
                again.append(Restart(decision.repair))
        return again

    def _prepare(self, decision: Decision, now: float) -> _Pending:
        """Return how and when a decision will be carried out.

        Raises:
            LockstepError: it cannot be deployed.
        """
        decided = now + self._delays.draw("decide", self._rng)
        plan = plan_change(self._system, self.configuration, decision.to_configuration, self._cores.tactics)
        fixed = self._cores.manager.reconfiguration_s
        if fixed is not None:
            return _Pending(decision, True, decided, decided + fixed)
        done = decided + self._delays.draw("restart" if restarts(plan) else "parameters", self._rng)
        return _Pending(decision, restarts(plan), decided, done)

    def _carry_out(self, now: float) -> list[Change | Restart]:
        """Begin decisions that are due, and report those that are done."""
        pending = self._pending
        if pending is None:
            return []
        if not pending.begun and now >= pending.decided:
            pending.begun = True
            self.decisions.append(replace(pending.decision, stamp=now))
            return [pending.change(FunctionGrounding.RECONFIGURING)]
        if now < pending.done:
            return []
        self._pending = None
        self.configuration = pending.decision.to_configuration
        self._take_active(now)
        self.decisions.append(replace(self._cores.manager.executed(now, pending.decision.id), stamp=now))
        return [pending.change(FunctionGrounding.STABLE)]

    def _take_active(self, now: float) -> None:
        """Let manager and observers know which configuration is active."""
        grounding = Grounding(self._system.function(self.configuration), self.configuration, FunctionGrounding.STABLE)
        active = ActiveFact(grounding.function, grounding.configuration, grounding.state)
        self._cores.manager.take(now, active)
        desired = self._desired.follow([grounding])
        if desired.problem:
            raise LockstepError(desired.problem)
        self._cores.observers.follow(desired.system)


def _component_status(component: str, status: str) -> DiagnosticStatus:
    """Return what the monitor's node publishes of a component."""
    return DiagnosticStatus(
        name=component, message=DiagnosticWords.COMPONENT_STATUS, values=[KeyValue(component, status)]
    )
