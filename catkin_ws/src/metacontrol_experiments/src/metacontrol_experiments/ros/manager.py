"""Node mission_manager: a manager in place of the reasoner.

Callbacks only queue what they get; everything else happens in the thread that calls `run`.
"""

from __future__ import annotations

import math
import threading
import time
from functools import partial
from typing import TYPE_CHECKING

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags import ownership
from metacontrol_bags.decision import DECIDED, Decision
from metacontrol_msgs.msg import ActiveConfiguration
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.loop.requesting import Wanted
from mros1_reasoner.ros.decisions import DecisionTopic
from mros1_reasoner.ros.requests import Requests
from node_kit.io.inbox import Inbox
from node_kit.io.xml_rpc import CallError
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.plugins import PluginError
from node_kit.ros.connections import latest
from node_kit.ros.lifetime import Lifetime
from ros_model.errors import ModelError

from metacontrol_experiments.io.driver_processes import DriverError, DriverProcesses
from metacontrol_experiments.io.input_files import PackageError
from metacontrol_experiments.io.node_processes import NodeProcessError, pid_of
from metacontrol_experiments.managers.d2_rules import RuleError
from metacontrol_experiments.managers.manager import ManagerError, Situation, make_manager
from metacontrol_experiments.mission.settings import MANAGER_NODE

if TYPE_CHECKING:
    from mros1_reasoner.loop.entries import Fact

STEP_S = 0.1
"""s of ROS time between two steps: as in lockstep."""
_WAIT_S = 0.02
"""Wall s for news, at most: ROS time may run several times as fast."""
_LOOK_S = 1.0
"""Wall s between two looks for drivers."""
_CALL_S = 1.0
"""Wall s for an answer of the master, and of a node's own API."""
_QUEUE = 1000

_REFUSALS = (
    KnowledgeBaseError,
    ManagerError,
    ModelError,
    PackageError,
    ParameterError,
    PluginError,
    ReasonerError,
    RuleError,
)


class ManagerNode:
    """Tells a manager what monitor, manipulator and drivers do, and lets happen what it decides."""

    def __init__(self) -> None:
        """Read parameters and models, make the manager, and listen.

        Raises:
            ManagerError, PluginError: there is no such manager, or it cannot be made.
            KnowledgeBaseError, ModelError, ParameterError: a model or a parameter cannot be used.
        """
        values = rospy.get_param(rospy.get_name(), None) or {}
        own, parameters = ParameterTree(values), Parameters(values)
        knowledge = parameters.knowledge_base() if values.get("model_file") else None
        objectives = parameters.objectives(knowledge) if knowledge else ()
        situation = Situation(
            own.text("initial_configuration"),
            own.whole("seed", 0, low=0),
            knowledge,
            objectives,
            values,
            starts_take_time=True,
        )
        self._manager = make_manager(own.text("manager"), situation, *_REFUSALS)
        self._functions = {objective.name: objective.function for objective in objectives}
        self._period = parameters.period
        self._inbox = Inbox()
        self._reader = DiagnosticsReader(
            {*knowledge.qualities, *knowledge.environment} if knowledge else (),
            knowledge.components if knowledge else (),
            parameters.nodes,
        )
        self._active: set[str] = set()  # functions for which something runs
        self._decided: set[str] = set()  # ids of decisions under way
        self._stepped = 0.0
        self._decisions = DecisionTopic()
        self._requests = Requests(
            parameters.action,
            parameters.execution_deadline,
            self._inbox.put,
            self._report,
            lambda _: None,
            rospy.logwarn,
        )
        self._drivers = DriverProcesses()
        self._listen(parameters.nodes)
        rospy.loginfo(f"manager {own.text('manager')} is ready")

    def run(self) -> None:
        """Work until the node is shut down; in the main thread, whose end ends the drivers that it has started."""
        heartbeat = time.monotonic()
        while not rospy.is_shutdown():
            self._inbox.drain(_WAIT_S)
            self._requests.look()
            now = rospy.get_time()
            for component in self._drivers.ended():
                rospy.logwarn(f"the process of {component} has ended")
                self._manager.ended(now, component)
            if self._stepped <= now < self._stepped + STEP_S:  # it is not where the clock was set back
                continue
            self._stepped, is_heartbeat = now, time.monotonic() >= heartbeat
            if is_heartbeat:
                heartbeat = time.monotonic() + self._period
            if not self._decided:
                self._step(now, is_heartbeat)

    # What comes in

    def _listen(self, nodes: dict[str, str]) -> None:
        """Listen to what the manager observes, and look for the drivers' processes."""
        if self._manager.observes:
            self._namespace, self._topic = rospy.get_namespace(), rospy.resolve_name(ownership.TOPIC)
            rospy.Subscriber(ownership.TOPIC, DiagnosticArray, self._on_diagnostics, queue_size=100)
            active = "rosgraph_manipulator/active_configuration"
            rospy.Subscriber(
                active, ActiveConfiguration, latest(lambda message: self._inbox.put(lambda: self._take_active(message)))
            )
        threading.Thread(target=self._look_for_drivers, args=(nodes,), name="drivers", daemon=True).start()

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        publisher = array._connection_header.get("callerid", "")
        own = ownership.own(array.status, self._namespace, publisher, self._topic)
        facts = self._reader.read(own, array.header.stamp.to_sec()).facts
        for fact in facts:
            self._inbox.put(partial(self._take, fact), at_most=_QUEUE)

    def _take_active(self, message: ActiveConfiguration) -> None:
        running = {function.function: function for function in message.functions if function.configuration}
        for name in self._active - running.keys():
            self._take(ActiveFact(name, "", ""))
        for name, function in running.items():
            self._take(ActiveFact(name, function.configuration, function.state))
        self._active = set(running)

    def _take(self, fact: Fact) -> None:
        try:
            self._manager.take(rospy.get_time(), fact)
        except MapeError as error:
            rospy.logwarn_throttle(10.0, str(error))
        if isinstance(fact, ComponentFact):
            self._stepped = -math.inf  # a failure is heeded at once

    def _look_for_drivers(self, nodes: dict[str, str]) -> None:
        """Have the processes of nodes watched as soon as they are there."""
        while not rospy.is_shutdown():
            for node, component in nodes.items():
                if component not in self._drivers.running and (pid := _pid_of(rospy.resolve_name(node))):
                    self._inbox.put(partial(self._watch, component, pid))
            time.sleep(_LOOK_S)

    def _watch(self, component: str, pid: int) -> None:
        if component in self._drivers.running:
            return
        try:
            self._drivers.watch(component, pid)
        except DriverError as error:
            rospy.logdebug(str(error))  # it has just ended

    # What goes out

    def _step(self, now: float, is_heartbeat: bool) -> None:
        """Let the manager decide, and do what it says."""
        try:
            found = self._manager.step(now, heartbeat=is_heartbeat)
        except ReasonerError as error:
            rospy.logwarn_throttle(10.0, f"analysis failed: {error}")
            return
        for item in found:
            if not isinstance(item, Decision):
                self._restart(item.component)
                continue
            self._tell(item)
            if item.state == DECIDED:
                self._decided.add(item.id)
                self._requests.ask(item.id, Wanted(self._functions.get(item.objective, ""), item.to_configuration))

    def _restart(self, component: str) -> None:
        try:
            self._drivers.start(component)
        except DriverError as error:
            rospy.logerr(str(error))
        else:
            rospy.logwarn(f"{component} is started again")

    def _report(self, decision: str, ok: bool, message: str = "", *, blame: bool = True) -> None:  # noqa: ARG002
        """Tell the manager the outcome of a decision."""
        self._decided.discard(decision)
        now = rospy.get_time()
        done = self._manager.executed(now, decision) if ok else self._manager.failed(now, decision, message)
        self._tell(done)

    def _tell(self, decision: Decision) -> None:
        self._decisions.publish(decision)
        rospy.loginfo(f"{decision.state}: {decision.explanation} ({decision.id})")


def _pid_of(node: str) -> int | None:
    """Return the process of a node on this host; None where there is none, as far as is seen."""
    try:
        return pid_of(node, rospy.get_name(), _CALL_S)
    except (CallError, NodeProcessError):
        return None


def main() -> None:
    """Run the node; exit status 2 when it cannot start."""
    with Lifetime(MANAGER_NODE, *_REFUSALS) as life:
        life.start()
        ManagerNode().run()
