"""Node reasoner: R2 and R3 of the loop around the pure core, and the request for R4."""

from __future__ import annotations

import logging
import math
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_msgs import msg as messages
from ros_model.errors import ModelError
from ros_model.files import resolve

from mros1_reasoner import mape
from mros1_reasoner.diagnostics import BadFact, BindingFact, ComponentFact, LevelFact, StaleFact, read_statuses
from mros1_reasoner.knowledge_base import KnowledgeBase, KnowledgeBaseError
from mros1_reasoner.model import Direction, Facts, Objective
from mros1_reasoner.pellet import make_reasoner
from mros1_reasoner.reasoner import Reasoner, ReasonerError

_LOG = "[RosReasoner] -- %s"
_WARN_PERIOD = 10.0  # s, wall, between two warnings of the same text
_TIMER_PERIOD = 0.02  # s, wall, the shortest between two looks at ROS time while the core waits for a moment
_FASTEST = 10.0  # ROS time may run so much faster than wall time
_MASTER_PERIOD = 1.0  # s, wall, between two looks at the master
_WARM_UP = 4  # analyses before the node is ready: the JVM compiles what it has run
_QUEUE = 1000  # messages that wait at most


class ParameterError(Exception):
    """A parameter can't be used; one line with its name, its value and what to do."""


class ReasonerNode:
    """Takes facts in from topics, lets the core decide, publishes decisions and has them carried out.

    Callbacks only queue what they get; everything else happens in the thread that calls `run`.
    """

    def __init__(self) -> None:
        """Read parameters and models, start Pellet, warm it up.

        Raises:
            ParameterError, KnowledgeBaseError, ReasonerError: the node can't work.
        """
        self._period = _positive("~reasoning_rate", 2.0)
        self._deadline = _positive("~execution_deadline", 60.0)
        self._asks = bool(rospy.get_param("~use_reconfigure_srv", True))
        self._nodes = _component_nodes()
        self._reasoner: Reasoner = make_reasoner()
        self._knowledge_base = _load_knowledge_base()
        objectives = _objectives(self._knowledge_base)
        settings = _settings(self._knowledge_base, grounds_itself=not self._asks)
        self._reasoner.load(self._knowledge_base.ontology)
        self._warm_up(objectives)
        self._core = mape.Mape(
            self._knowledge_base,
            self._reasoner,
            objectives,
            settings,
            clock=rospy.get_time,
            name=f"{rospy.get_name().strip('/')}-{int(time.time())}",
        )
        for objective in objectives:
            limits = ", ".join(f"{quality} {limit:g}" for quality, limit in sorted(objective.limits.items()))
            rospy.loginfo(_LOG, f"Objective created and set to ungrounded: {objective.name} ({limits or 'no limits'})")
        self._waiting: deque[Callable[[], None]] = deque(maxlen=_QUEUE)
        self._wake = threading.Condition()
        self._warned: dict[str, float] = {}
        self._request_ends = math.inf  # wall time
        self._publisher = rospy.Publisher("mros1_reasoner/decision", messages.Decision, queue_size=10)
        action = rospy.get_param("~reconfigure_srv_name", "rosgraph_manipulator_action_server")
        self._client = actionlib.ActionClient(action, messages.MvpReconfigurationAction) if self._asks else None
        self._goal: Any = None
        rospy.Subscriber("rosgraph_manipulator/active_configuration", messages.ActiveConfiguration, self._on_active)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=100)
        rospy.loginfo(_LOG, "Reasoner Initialization Ok")

    def run(self) -> None:
        """Work until the node is shut down or the master is gone."""
        heartbeat = master_check = time.monotonic()
        while not rospy.is_shutdown():
            now = time.monotonic()
            if now >= master_check:
                master_check = now + _MASTER_PERIOD
                if not _master_answers():
                    rospy.logerr(_LOG, "the ROS master is gone: shutting down; start the system again")
                    rospy.signal_shutdown("the master is gone")
                    break
            is_heartbeat = now >= heartbeat
            if is_heartbeat:
                heartbeat = now + self._period
            self._drain()
            self._check_deadline()
            self._step(heartbeat=is_heartbeat)
            until = min(heartbeat, master_check, self._next_look())
            with self._wake:
                if not self._waiting:
                    self._wake.wait(max(0.0, until - time.monotonic()))

    def _next_look(self) -> float:
        """Return the wall time at which to look whether the moment has come for which the core waits."""
        ros_now = rospy.get_time()
        due = self._core.due(ros_now)
        return math.inf if due is None else time.monotonic() + max(_TIMER_PERIOD, (due - ros_now) / _FASTEST)

    def close(self) -> None:
        """End Pellet's process."""
        self._reasoner.close()

    # R1: what comes in

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        facts = read_statuses(array.status, self._nodes)
        if facts:
            stamp = array.header.stamp.to_sec()
            self._queue(lambda: self._take_facts(facts, stamp))

    def _on_active(self, active: messages.ActiveConfiguration) -> None:
        self._queue(lambda: self._take_active(active))

    def _queue(self, work: Callable[[], None]) -> None:
        with self._wake:
            self._waiting.append(work)
            self._wake.notify()

    def _drain(self) -> None:
        while True:
            with self._wake:
                if not self._waiting:
                    return
                work = self._waiting.popleft()
            try:
                work()
            except (mape.MapeError, KnowledgeBaseError) as error:
                self._warn(str(error))

    def _take_facts(self, facts: list[Any], stamp: float) -> None:
        now = rospy.get_time()
        for fact in facts:
            try:
                match fact:
                    case LevelFact():
                        self._core.observe_level(now, fact.quality, fact.level, fact.grounding, stamp)
                        self._log_level(fact)
                    case StaleFact():
                        self._core.observe_stale(fact.quality)
                        self._warn(f"QA {fact.quality} can't be observed: {fact.reason or 'no reason given'}")
                    case ComponentFact():
                        if fact.component in self._knowledge_base.components:
                            self._core.observe_component(now, fact.component, fact.status, stamp)
                        else:  # nothing in the model requires it
                            text = f"component {fact.component} is not in the model: its status is left out"
                            self._throttled(text, partial(rospy.loginfo, _LOG, text), math.inf)
                    case BindingFact():
                        self._core.observe_binding(now, fact.grounding, fact.in_error)
                    case BadFact():
                        self._warn(fact.warning)
            except mape.MapeError as error:
                self._warn(str(error))

    def _log_level(self, fact: LevelFact) -> None:
        """Log a level as published tools expect it, but at most once in a period for each quality."""
        text = f"QA value received!\tTYPE: {fact.quality}\tVALUE: {fact.level}"
        self._throttled(f"level of {fact.quality}", lambda: rospy.loginfo(text), self._period)

    def _take_active(self, active: messages.ActiveConfiguration) -> None:
        now = rospy.get_time()
        for function in active.functions:
            if function.configuration:
                self._core.observe_active(now, function.function, function.configuration, function.state)

    # R2 and R3

    def _step(self, *, heartbeat: bool) -> None:
        try:
            decisions = self._core.step(rospy.get_time(), heartbeat=heartbeat)
        except ReasonerError as error:
            self._warn(f"analysis failed: {error}")
            return
        for decision in decisions:
            log = rospy.loginfo if decision.to_configuration else rospy.logwarn
            log(_LOG, decision.explanation)
            self._publish(decision)
            if decision.state == mape.DECIDED:
                self._execute(decision)

    def _warm_up(self, objectives: tuple[Objective, ...]) -> None:
        """Let the JVM compile what an analysis runs, with every kind of fact."""
        facts = Facts(
            objectives=objectives,
            groundings={o.name: d.name for o in objectives for d in self._knowledge_base.solving(o.function)[:1]},
            levels={(o.name, quality): limit for o in objectives for quality, limit in o.limits.items()},
            components=dict.fromkeys(self._knowledge_base.components, "FALSE"),
        )
        for _ in range(_WARM_UP):
            self._knowledge_base.analyse(facts, self._reasoner)

    # R4

    def _execute(self, decision: mape.Decision) -> None:
        if self._client is None:
            self._report(decision.id, True)
            return
        if not self._client.wait_for_server(rospy.Duration(-1)):  # one look, without waiting
            message = f"the manipulator's action server {self._client.ns} is not there"
            self._report(decision.id, False, message, blame=False)
            return
        self._request_ends = time.monotonic() + self._deadline
        goal = messages.MvpReconfigurationGoal(desired_configuration_name=decision.to_configuration)
        self._goal = self._client.send_goal(goal, transition_cb=lambda handle: self._on_transition(handle, decision.id))

    def _on_transition(self, handle: actionlib.ClientGoalHandle, decision_id: str) -> None:
        if handle.get_comm_state() != actionlib.CommState.DONE:
            return
        status, result = handle.get_goal_status(), handle.get_result()
        text = handle.get_goal_status_text()
        code = result.result if result is not None else None
        self._queue(lambda: self._take_result(decision_id, status, code, text))

    def _take_result(self, decision_id: str, status: int, code: int | None, text: str) -> None:
        if self._core.pending is None or self._core.pending.id != decision_id:
            return  # it came after the deadline
        ok = code == 1 and status == GoalStatus.SUCCEEDED
        meanings = {0: "the manipulator restored the former one", -1: "the manipulator does not know it"}
        reason = text or meanings.get(code if code is not None else -2, "the manipulator gave no result")
        self._report(decision_id, ok, reason, blame=code in (0, -1))

    def _check_deadline(self) -> None:
        pending = self._core.pending
        if pending is None or time.monotonic() < self._request_ends:
            return
        if self._goal is not None:
            self._goal.cancel()
        self._report(pending.id, False, f"no result within {self._deadline:g} s")

    def _report(self, decision_id: str, ok: bool, message: str = "", *, blame: bool = True) -> None:
        self._request_ends, self._goal = math.inf, None
        decision = self._core.report(rospy.get_time(), decision_id, ok, message, blame=blame)
        self._publish(decision)
        if ok:
            rospy.loginfo(_LOG, "Exited timer_cb after successful reconfiguration")
        else:
            target = decision.to_configuration
            rospy.logwarn(_LOG, f"reconfiguration of {decision.objective} to {target} failed: {message}")
        self._queue(lambda: None)  # look at once at what happened meanwhile

    # What goes out

    def _publish(self, decision: mape.Decision) -> None:
        message = messages.Decision()
        for item in fields(decision):
            value = getattr(decision, item.name)
            if item.name.startswith("stamp_"):
                setattr(message, item.name, rospy.Time.from_sec(max(0.0, value)))
            elif item.name == "candidates":
                message.candidates = [_candidate(candidate) for candidate in value]
            elif item.name in message.__slots__:
                setattr(message, item.name, list(value) if isinstance(value, tuple) else value)
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)

    def _warn(self, text: str) -> None:
        self._throttled(text, lambda: rospy.logwarn(_LOG, text), _WARN_PERIOD)

    def _throttled(self, key: str, action: Callable[[], None], period: float) -> None:
        now = time.monotonic()
        if now - self._warned.get(key, -math.inf) < period:
            return
        if len(self._warned) > _QUEUE:
            self._warned.clear()
        self._warned[key] = now
        action()


def main() -> None:
    """Run the node; exit status 2 when it can't start."""
    try:
        rospy.init_node("reasoner")
        logger = logging.getLogger("mros1_reasoner")
        logger.setLevel(logging.INFO)
        logger.propagate = False
        logger.addHandler(_RosLog())
        node = ReasonerNode()
    except (ParameterError, KnowledgeBaseError, ReasonerError, ModelError, rospy.ROSInitException) as error:
        sys.stderr.write(f"reasoner: {' '.join(str(error).split())}\n")
        sys.stderr.flush()
        rospy.signal_shutdown("it can't start")
        os._exit(2)  # rospy's threads would keep the process
    try:
        node.run()
    finally:
        node.close()


class _RosLog(logging.Handler):
    """Takes what the core logs to rosout."""

    def emit(self, record: logging.LogRecord) -> None:
        """Log a record as the node's own."""
        log = rospy.logwarn if record.levelno >= logging.WARNING else rospy.loginfo
        log(_LOG, record.getMessage())


def _candidate(candidate: Any) -> messages.Candidate:
    return messages.Candidate(
        name=candidate.design.name,
        expected_qas=[messages.ExpectedQA(name, level) for name, level in sorted(candidate.design.expected.items())],
        utility=candidate.utility,
        chosen=candidate.chosen,
        refused_because=candidate.refused_because,
    )


def _load_knowledge_base() -> KnowledgeBase:
    models = _files("~model_file")
    if not models:
        raise ParameterError("parameter ~model_file is not set: give the application's OWL file")
    directions = {}
    given = rospy.get_param("~qa_direction", {})
    if not isinstance(given, dict):
        raise ParameterError(f"parameter ~qa_direction is {given!r}: expected a mapping QA -> direction")
    for quality, direction in given.items():
        try:
            directions[quality] = Direction(direction)
        except ValueError as error:
            known = " or ".join(d.value for d in Direction)
            raise ParameterError(f"parameter ~qa_direction/{quality} is {direction!r}: expected {known}") from error
    return KnowledgeBase(models, _files("~tomasys_file"), directions)


def _files(parameter: str) -> list[Path]:
    """Return the files that a parameter names: one, several separated by commas, or a list."""
    value = rospy.get_param(parameter, "")
    names = value if isinstance(value, list) else str(value).split(",")
    return [resolve(str(name).strip()) for name in names if str(name).strip()]


def _objectives(knowledge_base: KnowledgeBase) -> tuple[Objective, ...]:
    """Return the model's objectives, else one for each function that no design requires, with the `~nfr_` limits."""
    objectives = knowledge_base.objectives
    if not objectives:
        required = {function for design in knowledge_base.designs.values() for function in design.requires}
        objectives = tuple(
            Objective(f"o_{function.removeprefix('f_')}A", function)
            for function in knowledge_base.functions
            if function not in required
        )
    limits = {}
    for name in rospy.get_param(rospy.get_name(), None) or {}:
        if not name.startswith("nfr_"):
            continue
        quality = name.removeprefix("nfr_")
        if quality not in knowledge_base.qualities:
            rospy.logwarn(_LOG, f"parameter ~{name}: Unsupported QA TYPE received: {quality}: left out")
            continue
        limits[quality] = _finite(f"~{name}", 0.0)
    return tuple(Objective(o.name, o.function, {**o.limits, **limits}) for o in objectives)


def _settings(knowledge_base: KnowledgeBase, *, grounds_itself: bool) -> mape.Settings:
    defaults = mape.Settings()
    desired = str(rospy.get_param("~desired_configuration", "") or "")
    if desired and desired not in knowledge_base.designs:
        raise ParameterError(f"parameter ~desired_configuration is {desired!r}: no FunctionDesign of the model")
    utility = str(rospy.get_param("~utility", defaults.utility))
    if utility not in knowledge_base.qualities:
        rospy.logwarn(_LOG, f"parameter ~utility: no QA is called {utility!r}: every design is as useful as another")
    names = (
        "violation_window",
        "cool_down",
        "level_timeout",
        "error_log_expiry",
        "backoff",
        "backoff_limit",
        "busy_limit",
    )
    return mape.Settings(
        **{name: _not_negative(f"~{name}", getattr(defaults, name)) for name in names},
        start_grace=0.0 if grounds_itself else _not_negative("~start_grace", defaults.start_grace),
        utility=utility,
        desired=desired,
        always_improve=bool(rospy.get_param("~always_improve", False)),
        approval=bool(rospy.get_param("~approval", False)),
    )


def _component_nodes() -> dict[str, str]:
    """Return component by node from `~components`: {component: {node: name}}."""
    given = rospy.get_param("~components", {})
    if not isinstance(given, dict):
        raise ParameterError(f"parameter ~components is {given!r}: expected a mapping component -> {{node: name}}")
    return {
        str(entry["node"]).strip("/"): component
        for component, entry in given.items()
        if isinstance(entry, dict) and entry.get("node")
    }


def _finite(parameter: str, default: float) -> float:
    value = rospy.get_param(parameter, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ParameterError(f"parameter {parameter} is {value!r}: expected a finite number")
    return float(value)


def _not_negative(parameter: str, default: float) -> float:
    value = _finite(parameter, default)
    if value < 0:
        raise ParameterError(f"parameter {parameter} is {value:g}: expected 0 or more")
    return value


def _positive(parameter: str, default: float) -> float:
    value = _finite(parameter, default)
    if value <= 0:
        raise ParameterError(f"parameter {parameter} is {value:g}: expected more than 0")
    return value


def _master_answers() -> bool:
    try:
        rosgraph.Master(rospy.get_name()).getPid()
    except (OSError, rosgraph.MasterException):
        return False
    return True
