"""Node reasoner: R2 and R3 of the loop around the pure core, and the request for R4."""

from __future__ import annotations

import logging
import math
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, TypeVar

import actionlib
import rosgraph
import rospy
import yaml
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs import msg as messages
from ros_model.errors import ModelError
from std_msgs.msg import Bool

from mros1_reasoner import journal, mape
from mros1_reasoner.decision import DECIDED, EXECUTED, FAILED, Decision
from mros1_reasoner.diagnostics import (
    BindingFact,
    ComponentFact,
    DiagnosticsReader,
    LevelFact,
    Reading,
    Remark,
    StaleFact,
    TaskFact,
)
from mros1_reasoner.explain import line
from mros1_reasoner.knowledge_base import KnowledgeBase, KnowledgeBaseError
from mros1_reasoner.model import Facts, Objective
from mros1_reasoner.parameters import ParameterError, Parameters
from mros1_reasoner.pellet import make_reasoner
from mros1_reasoner.reasoner import Reasoner, ReasonerError
from mros1_reasoner.record import fill_message, record_of
from mros1_reasoner.services_node import Services
from mros1_reasoner.tasks import newest_goal
from mros1_reasoner.throttle import Throttle

_LOG = "[RosReasoner] -- %s"
_TIMER_PERIOD = 0.02  # s, wall, the shortest between two looks at ROS time while the core waits for a moment
_FASTEST = 10.0  # ROS time may run so much faster than wall time
_MASTER_PERIOD = 1.0  # s, wall, between two looks at the master
_SERVER_WAIT = 1.0  # s, wall, at most, for the connections to the manipulator
_WARM_UP = 4  # analyses before the node is ready: the JVM compiles what it has run
_QUEUE = 1000  # diagnostics that wait at most
_ANSWER_DEADLINE = 60.0  # s, wall, for a service; an analysis may have to start Pellet again

_T = TypeVar("_T")


class ReasonerNode:
    """Takes facts in from topics, lets the core decide, publishes decisions and has them carried out.

    Callbacks only queue what they get; everything else happens in the thread that calls `run`.
    """

    def __init__(self) -> None:
        """Read parameters and models, start Pellet, warm it up.

        Raises:
            ParameterError, KnowledgeBaseError, ModelError, ReasonerError: the node can't work.
        """
        parameters = Parameters(rospy.get_param(rospy.get_name(), None) or {})
        self._period, self._deadline = parameters.period, parameters.execution_deadline
        files = [*parameters.model_files, *parameters.vocabulary_files]
        self._reasoner: Reasoner = make_reasoner()
        self.knowledge_base = parameters.knowledge_base()
        objectives = parameters.objectives(self.knowledge_base)
        settings = parameters.settings(self.knowledge_base)
        self._reasoner.load(self.knowledge_base.ontology)
        for path in files:
            rospy.loginfo(f"Loaded ontology: {path}")
        _warm_up(self.knowledge_base, self._reasoner, objectives)
        name = f"{rospy.get_name().strip('/')}-{int(time.time())}"
        self.core = mape.Mape(
            self.knowledge_base, self._reasoner, objectives, settings, clock=rospy.get_time, name=name
        )
        self._waiting: deque[Callable[[], object]] = deque()
        self._wake = threading.Condition()
        self._reader = DiagnosticsReader(
            self.knowledge_base.qualities, self.knowledge_base.components, parameters.nodes
        )
        self._throttle, self._levels_told = Throttle(), Throttle(self._period, burst=1)
        self._told: set[str] = set()
        self._taken_over: set[str] = set()
        self._goals: dict[str, tuple[str, bool]] = {}  # newest goal of an objective's task, and whether it failed
        self._request_ends = math.inf  # wall time
        self._goal: Any = None
        self._failures, self._trouble = 0, ""
        self._journal = _JournalTopic(name, parameters, files)
        self._decisions = rospy.Publisher("mros1_reasoner/decision", messages.Decision, queue_size=10, latch=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        asks = parameters.asks and not settings.dry_run
        action = parameters.action
        self._client = actionlib.ActionClient(action, messages.MvpReconfigurationAction) if asks else None
        self._listen(parameters.task_actions)
        self._services = Services(self, parameters.save_folder)
        for objective in objectives:
            self._tell_objective(objective)
        rospy.loginfo(_LOG, "Reasoner Initialization Ok")

    def _listen(self, task_actions: dict[str, str]) -> None:
        active = "rosgraph_manipulator/active_configuration"
        rospy.Subscriber(active, messages.ActiveConfiguration, self._on_active)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=100)
        rospy.Subscriber("obj_error", Bool, self._on_obj_error)
        for objective, action in task_actions.items():
            listen = partial(self._on_task_status, objective, action)
            rospy.Subscriber(f"{action}/status", GoalStatusArray, listen)

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
                self._report_trouble()
            self._drain()
            self._check_deadline()
            self._take("step", is_heartbeat)
            self._journal.flush()
            until = min(heartbeat, master_check, self._next_look())
            with self._wake:
                if not self._waiting:
                    self._wake.wait(max(0.0, until - time.monotonic()))

    def _next_look(self) -> float:
        """Return the wall time at which to look whether the moment has come for which the core waits."""
        ros_now = rospy.get_time()
        due = self.core.due(ros_now)
        return math.inf if due is None else time.monotonic() + max(_TIMER_PERIOD, (due - ros_now) / _FASTEST)

    def close(self) -> None:
        """End Pellet's process."""
        self._reasoner.close()

    # What comes in

    def ask(self, work: Callable[[], _T]) -> _T:
        """Have the loop's thread do something; wait for what it returns.

        Raises:
            MapeError, KnowledgeBaseError, ReasonerError, ValueError: as `work` does.
            TimeoutError: the loop is busy for too long.
        """
        answer: Future[_T] = Future()

        def run() -> None:
            if not answer.set_running_or_notify_cancel():
                return  # nobody waits any more
            try:
                answer.set_result(work())
            except (mape.MapeError, KnowledgeBaseError, ReasonerError, ValueError) as error:
                answer.set_exception(error)

        self._queue(run)
        try:
            return answer.result(_ANSWER_DEADLINE)
        except TimeoutError:
            answer.cancel()
            raise

    def command(self, kind: str, *values: object) -> None:
        """Take in what an operator asks for, in the loop's thread; kinds and values: journal.py.

        Raises:
            MapeError, ReasonerError: it does not fit.
        """
        self._announce(self._applied(kind, *values))
        shown = " ".join(str(value) for value in values)
        rospy.loginfo(_LOG, f"operator: {kind} {shown}".strip())
        if kind == "add_objective":
            self._tell_objective(self.core.objectives[str(values[0])])

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        reading = self._reader.read(array.status)
        if not reading.facts and not reading.remarks:
            return
        if len(self._waiting) > _QUEUE:
            reading = Reading(
                remarks=(Remark("queue", "diagnostics come faster than they can be read: some are lost"),)
            )
            self._queue(lambda: self._take_reading(reading, 0.0), at_most=_QUEUE + 1)
            return
        stamp = array.header.stamp.to_sec()
        self._queue(lambda: self._take_reading(reading, stamp))

    def _on_active(self, active: messages.ActiveConfiguration) -> None:
        self._queue(lambda: self._take_active(active))

    def _on_obj_error(self, message: Bool) -> None:
        self._queue(lambda: self._take("task", "", message.data, 0.0, "reported on obj_error"))

    def _on_task_status(self, objective: str, action: str, statuses: GoalStatusArray) -> None:
        """Take in how the newest goal of an objective's action fares, where that is new."""
        newest = newest_goal(statuses)
        if newest is None or self._goals.get(objective) == newest:
            return
        self._goals[objective] = newest
        self._queue(lambda: self._take("task", objective, newest[1], 0.0, f"a goal of {action} was aborted"))

    def _queue(self, work: Callable[[], object], at_most: float = math.inf) -> None:
        with self._wake:
            if len(self._waiting) <= at_most:
                self._waiting.append(work)
            self._wake.notify()

    def _drain(self) -> None:
        with self._wake:
            works, self._waiting = self._waiting, deque()
        for work in works:
            work()

    def _take(self, kind: str, *values: object) -> bool:
        """Take something in and announce what follows; say what is wrong where it does not fit."""
        try:
            self._announce(self._applied(kind, *values))
        except (mape.MapeError, KnowledgeBaseError) as error:
            self._warn(kind, str(error))
        except ReasonerError as error:
            self._warn("analysis", f"analysis failed: {error}")
        else:
            return True
        return False

    def _applied(self, kind: str, *values: object) -> list[Decision]:
        item = journal.entry(rospy.get_time(), kind, *values)
        decisions = journal.apply(self.core, item)
        self._journal.append(item)
        for brought in journal.decided(item.now, decisions):
            self._journal.append(brought)
        return decisions

    def _take_reading(self, reading: Reading, stamp: float) -> None:
        for remark in reading.remarks:
            self._tell_remark(remark)
        for fact in reading.facts:
            match fact:
                case LevelFact():
                    if self._take("level", fact.quality, fact.level, fact.grounding, stamp):
                        self._tell_level(fact)
                case StaleFact():
                    self._take("stale", fact.quality)
                    self._warn("stale", f"QA {fact.quality} can't be observed: {fact.reason or 'no reason given'}")
                case ComponentFact():
                    self._take("component", fact.component, fact.status, stamp)
                case BindingFact():
                    self._take("binding", fact.grounding, fact.in_error)
                case TaskFact():
                    self._take("task", fact.name, fact.failed, stamp, "reported as a diagnostic")

    def _take_active(self, active: messages.ActiveConfiguration) -> None:
        for function in active.functions:
            if not function.configuration:
                continue
            taken = self._take("active", function.function, function.configuration, function.state)
            if taken and function.function not in self._taken_over:
                self._taken_over.add(function.function)
                say = f"{function.function} runs {function.configuration} ({function.state}): taken over as it is"
                rospy.loginfo(_LOG, say)

    # What goes out

    def _announce(self, decisions: list[Decision]) -> None:
        """Tell of decisions and have those carried out that are to be."""
        for decision in decisions:
            self._publish(decision)
            self._tell_decision(decision)
            if decision.state == DECIDED:
                self._execute(decision)

    def _tell_decision(self, decision: Decision) -> None:
        if decision.state == EXECUTED:
            rospy.loginfo("Exited timer_cb after successful reconfiguration")
            took = f"{decision.objective} has {decision.to_configuration} after {decision.execute_wall_s:.2f} s"
            rospy.loginfo(_LOG, f"executed: {took} ({decision.id})")
        elif decision.state == FAILED and decision.to_configuration:
            rospy.logwarn(_LOG, f"failed: {decision.explanation} ({decision.id})")
        else:
            (rospy.loginfo if decision.to_configuration else rospy.logwarn)(_LOG, line(record_of(decision)))

    def _publish(self, decision: Decision) -> None:
        record = record_of(decision)
        message = fill_message(messages.Decision(), record, rospy.Time.from_sec, messages)
        message.header.stamp = rospy.Time.now()
        self._decisions.publish(message)

    def _execute(self, decision: Decision) -> None:
        if self._client is None:
            self._report(decision.id, True)
            return
        if not self._finds(self._client):
            message = f"the manipulator's action server {rospy.resolve_name(self._client.ns)} is not there"
            self._report(decision.id, False, message, blame=False)
            return
        self._request_ends = time.monotonic() + self._deadline
        goal = messages.MvpReconfigurationGoal(desired_configuration_name=decision.to_configuration)
        self._goal = self._client.send_goal(goal, transition_cb=lambda handle: self._on_transition(handle, decision.id))

    def _finds(self, client: actionlib.ActionClient) -> bool:
        """Look for the manipulator's action server; just after a start its connections may be on their way."""
        until = time.monotonic() + _SERVER_WAIT
        while not client.wait_for_server(rospy.Duration(-1)):  # one look: its own waiting needs a running clock
            if time.monotonic() > until or rospy.is_shutdown():
                return False
            time.sleep(0.02)
        return True

    def _on_transition(self, handle: actionlib.ClientGoalHandle, decision_id: str) -> None:
        if handle.get_comm_state() != actionlib.CommState.DONE:
            return
        status, result = handle.get_goal_status(), handle.get_result()
        text = handle.get_goal_status_text()
        code = result.result if result is not None else None
        self._queue(lambda: self._take_result(decision_id, status, code, text))

    def _take_result(self, decision_id: str, status: int, code: int | None, text: str) -> None:
        if self.core.pending is None or self.core.pending.id != decision_id:
            return  # it came after the deadline
        ok = code == 1 and status == GoalStatus.SUCCEEDED
        meanings = {0: "the manipulator restored the former one", -1: "the manipulator does not know it"}
        reason = text or meanings.get(code if code is not None else -2, "the manipulator gave no result")
        self._report(decision_id, ok, "" if ok else reason, blame=code in (0, -1))

    def _check_deadline(self) -> None:
        pending = self.core.pending
        if pending is None or time.monotonic() < self._request_ends:
            return
        if self._goal is not None:
            self._goal.cancel()
        self._report(pending.id, False, f"no result within {self._deadline:g} s")

    def _report(self, decision_id: str, ok: bool, message: str = "", *, blame: bool = True) -> None:
        self._request_ends, self._goal = math.inf, None
        was_in_trouble = bool(self._trouble)
        self._failures, self._trouble = (0, "") if ok else (self._failures + 1, message)
        self._take("result", decision_id, ok, message, blame)
        if self._trouble or was_in_trouble:
            self._report_trouble(is_over=ok)
        self._queue(lambda: None)  # look at once at what happened meanwhile

    def _report_trouble(self, *, is_over: bool = False) -> None:
        """Publish the state of reconfigurations as a diagnostic while they fail, and once when they no longer do."""
        if not self._trouble and not is_over:
            return
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if is_over else DiagnosticStatus.ERROR,
            name=f"{rospy.get_name().strip('/')}: reconfiguration",
            message="Reconfiguration works" if is_over else f"Reconfiguration fails: {self._trouble}",
            hardware_id=rospy.get_name(),
            values=[KeyValue("failed attempts in a row", str(self._failures))],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)

    # What is logged

    def _tell_objective(self, objective: Objective) -> None:
        rospy.loginfo("Objective created and set to ungrounded")
        limits = ", ".join(f"{quality} {limit:g}" for quality, limit in sorted(objective.limits.items()))
        rospy.loginfo(_LOG, f"{objective.name} needs {objective.function} with {limits or 'no limits'}")

    def _tell_level(self, fact: LevelFact) -> None:
        """Log a level as published tools expect it, but at most once in a period for each quality."""
        text = f"QA value received!\tTYPE: {fact.quality}\tVALUE: {fact.text}"
        if self._levels_told.admit(time.monotonic(), fact.quality, text):
            rospy.loginfo(text)

    def _tell_remark(self, remark: Remark) -> None:
        if remark.is_warning:
            self._warn(remark.kind, remark.text)
        elif remark.text not in self._told and len(self._told) < _QUEUE:
            self._told.add(remark.text)
            rospy.loginfo(_LOG, remark.text)

    def _warn(self, kind: str, text: str) -> None:
        said = self._throttle.admit(time.monotonic(), kind, text)
        if said:
            is_published = text.startswith("Unsupported QA TYPE received: ")  # tools wait for that line as it is
            rospy.logwarn(said) if is_published else rospy.logwarn(_LOG, said)


class _JournalTopic:
    """Publishes what the loop takes in, so that a bag holds what a replay needs; a new subscriber gets what was before.

    The loop's thread appends and flushes; subscribers come in rospy's threads.
    """

    def __init__(self, name: str, parameters: Parameters, files: list[Any]) -> None:
        self._name = name
        self._parameters = yaml.safe_dump(dict(parameters.values))
        self._files = [str(path) for path in files]
        self._contents = [path.read_text(encoding="utf-8", errors="replace") for path in files]
        self._journal = journal.Journal()
        self._lock = threading.Lock()
        self._fresh: list[journal.Entry] = []
        self._first = 0
        listener = rospy.SubscribeListener()
        listener.peer_subscribe = lambda _topic, _publish, publish_to_peer: publish_to_peer(self._beginning())
        self._publisher = rospy.Publisher(
            "mros1_reasoner/journal", messages.ReasonerJournal, subscriber_listener=listener, queue_size=1000
        )

    def append(self, item: journal.Entry) -> None:
        """Add an entry."""
        with self._lock:
            number = self._journal.append(item)
        if not self._fresh:
            self._first = number
        self._fresh.append(item)

    def flush(self) -> None:
        """Publish the entries since the last flush."""
        fresh, self._fresh = self._fresh, []
        if fresh and self._publisher.get_num_connections():
            self._publisher.publish(self._message(self._first, fresh))

    def _beginning(self) -> messages.ReasonerJournal:
        with self._lock:
            first, entries = self._journal.snapshot()
        message = self._message(first, entries)
        message.parameters, message.files, message.contents = self._parameters, self._files, self._contents
        return message

    def _message(self, first: int, entries: list[journal.Entry]) -> messages.ReasonerJournal:
        message = messages.ReasonerJournal(name=self._name, first=first)
        message.header.stamp = rospy.Time.now()
        message.entries = [messages.JournalEntry(item.now, item.kind, list(item.values)) for item in entries]
        return message


class _Ended(BaseException):
    """A signal asks the process to end."""


def main() -> None:
    """Run the node; exit status 2 when it can't start."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end)
    node = None
    try:
        rospy.init_node("reasoner", disable_signals=True)
        logger = logging.getLogger("mros1_reasoner")
        logger.setLevel(logging.INFO)
        logger.propagate = False
        logger.addHandler(_RosLog())
        node = ReasonerNode()
        node.run()
    except (ParameterError, KnowledgeBaseError, ReasonerError, ModelError, rospy.ROSInitException) as error:
        sys.stderr.write(f"reasoner: {' '.join(str(error).split())}\n")
        sys.stderr.flush()
        rospy.signal_shutdown("it can't start")
        os._exit(2)  # rospy's threads would keep the process
    except _Ended:
        rospy.signal_shutdown("it was asked to end")
    finally:
        if node is not None:
            node.close()


def _end(*_: object) -> None:
    """Unwind the main thread; rospy's own handler calls the master from here, and hangs where a call is under way."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    raise _Ended


class _RosLog(logging.Handler):
    """Takes what the core logs to rosout."""

    def emit(self, record: logging.LogRecord) -> None:
        """Log a record as the node's own."""
        log = rospy.logwarn if record.levelno >= logging.WARNING else rospy.loginfo
        log(_LOG, record.getMessage())


def _warm_up(knowledge_base: KnowledgeBase, reasoner: Reasoner, objectives: tuple[Objective, ...]) -> None:
    """Let the JVM compile what an analysis runs, with every kind of fact."""
    facts = Facts(
        objectives=objectives,
        groundings={o.name: d.name for o in objectives for d in knowledge_base.solving(o.function)[:1]},
        levels={(o.name, quality): limit for o in objectives for quality, limit in o.limits.items()},
        components=dict.fromkeys(knowledge_base.components, "FALSE"),
    )
    for _ in range(_WARM_UP):
        knowledge_base.analyse(facts, reasoner)


def _master_answers() -> bool:
    try:
        rosgraph.Master(rospy.get_name()).getPid()
    except (OSError, rosgraph.MasterException):
        return False
    return True
