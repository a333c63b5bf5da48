"""The action by which components are repaired: by a service, or by the driver that is started again.

A repair has a thread of its own, so that it keeps nobody waiting. Only the processes of a driver are started by the
thread that changes functions, one thing after the other.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import actionlib
import rospy
from metacontrol_msgs.msg import RepairAction, RepairResult
from node_kit.io.background import NoThreadError, in_background, start_thread
from node_kit.io.inbox import Inbox
from node_kit.ros.services import SERVICE_FAILURES
from rosservice import ROSServiceException, get_service_type
from std_srvs.srv import Empty, Trigger

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.execution import LOOK_PERIOD, DriverStart, Execution
from rosgraph_manipulator.change.repairs import (
    TRIGGER,
    RepairedDrivers,
    RepairOutcome,
    RepairsUnderWay,
    told_by_launcher,
    told_by_service,
    why_not_called,
)
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions, Repair
from rosgraph_manipulator.ros.action_server import ActionServer

ACTION = "rosgraph_manipulator/repair"


class _CancelledError(Exception):
    """The goal was cancelled."""


@dataclass(frozen=True)
class _Run:
    """A repair that is under way."""

    repair: Repair
    handle: actionlib.ServerGoalHandle
    cancelled: threading.Event = field(default_factory=threading.Event)


class RepairServer:
    """Offers the action, and keeps repaired drivers running."""

    def __init__(self, options: ManipulatorOptions, inbox: Inbox, executor: Execution, timeout: float) -> None:
        """Begin without offering anything; `start` offers the action.

        Args:
            options: has the repairs.
            inbox: work of the thread that changes functions.
            executor: starts drivers, in that thread.
            timeout: how long a service may take to answer, and a driver to be up after its start, s, wall.
        """
        self._repairs, self._inbox, self._executor, self._timeout = options.repairs, inbox, executor, timeout
        self._drivers = RepairedDrivers(options.drivers.values(), executor.report)
        self._told: dict[str, str] = {}  # why a driver could not be started again, by its name
        self._under_way = RepairsUnderWay(options.repairs)
        self._lock = threading.Lock()
        self._runs: dict[str, _Run] = {}  # by the goal's id
        self._server = ActionServer(ACTION, RepairAction, self._on_goal, self._on_cancel, auto_start=False)

    def start(self) -> None:
        """Take goals from now on."""
        self._server.start()

    def follow_launcher(self) -> None:
        """Start drivers again that have ended with their launcher, and tell which ones it has given up."""
        for report in self._drivers.given_up():
            rospy.logerr("%s: %s", report.function, report.message)
        self.look()

    def look(self) -> None:
        """Start drivers again that have ended with their launcher; try it again where that has failed a while ago."""
        for driver in self._drivers.lost(time.monotonic()):
            if self._executor.is_unconnected(driver.function):
                continue  # a launcher that is gone would be waited for, and functions could not be changed meanwhile
            try:
                self._start_now(driver)
                rospy.logwarn("%s: started again, because the launcher has ended", driver.name)
                self._told.pop(driver.name, None)
            except (DeploymentError, *SERVICE_FAILURES) as error:
                if self._told.get(driver.name) != _line(error):
                    self._told[driver.name] = _line(error)
                    rospy.logerr("%s: %s; it is tried again", driver.name, _line(error))
            self._drivers.tried(driver, time.monotonic())

    # -- the action -----------------------------------------------------------------------------------------------

    def _on_goal(self, handle: actionlib.ServerGoalHandle) -> None:
        component = handle.get_goal().component
        with self._lock:
            refusal = self._under_way.begin(component)
            if not refusal:
                run = _Run(self._repairs[component], handle)
                self._runs[handle.get_goal_id().id] = run
        if refusal:
            rospy.logwarn("%s", refusal)
            handle.set_rejected(RepairResult(False, refusal), refusal)
            return
        handle.set_accepted()
        try:
            start_thread(partial(self._make, run), f"repair {component}")
        except NoThreadError as error:
            self._end(run, RepairOutcome(False, _line(error)))

    def _on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        with self._lock:
            run = self._runs.get(handle.get_goal_id().id)
        if run:
            run.cancelled.set()

    def _make(self, run: _Run) -> None:
        """Make a repair, in a thread of its own."""
        outcome = None
        try:
            outcome = self._start(run, run.repair.driver) if run.repair.driver else self._call(run)
        except _CancelledError:
            rospy.loginfo("the repair of %s is cancelled", run.repair.component)
        except (DeploymentError, ROSServiceException, *SERVICE_FAILURES) as error:
            outcome = RepairOutcome(False, _line(error))
        except Exception as error:  # nobody would hear of it in this thread
            outcome = RepairOutcome(False, f"{type(error).__name__}: {_line(error)}")
        self._end(run, outcome)

    def _end(self, run: _Run, outcome: RepairOutcome | None) -> None:
        """End a repair, and tell how; None: it was cancelled."""
        component = run.repair.component
        with self._lock:
            self._under_way.end(component)
            self._runs.pop(run.handle.get_goal_id().id)
        if outcome is None:
            run.handle.set_canceled(RepairResult(False, "cancelled"), "cancelled")
        elif outcome.ok:
            rospy.loginfo("repair of %s: %s", component, outcome.message)
            run.handle.set_succeeded(RepairResult(True, ""), outcome.message)
        else:
            rospy.logerr("the repair of %s has failed: %s", component, outcome.message)
            run.handle.set_aborted(RepairResult(False, outcome.message), outcome.message)

    # -- by a service ---------------------------------------------------------------------------------------------

    def _call(self, run: _Run) -> RepairOutcome:
        component, service = run.repair.component, rospy.resolve_name(run.repair.service)
        silence = f"{service} has not answered within {self._timeout:g} s: look at the node that offers it"
        deadline = time.monotonic() + self._timeout
        kind = self._answer(run, lambda: get_service_type(service), deadline, silence)
        if reason := why_not_called(component, service, kind):
            return RepairOutcome(False, reason)
        # Only a persistent proxy can be closed while it waits for the answer, so that its thread ends.
        proxy = rospy.ServiceProxy(service, Trigger if kind == TRIGGER else Empty, persistent=True)
        try:
            return told_by_service(service, self._answer(run, proxy, deadline, silence))
        finally:
            proxy.close()

    def _answer(self, run: _Run, ask: Callable[[], Any], deadline: float, silence: str) -> Any:
        """Return the answer to a question; ask it in yet another thread, because it may hang."""
        answer = in_background(ask, f"ask for {run.repair.component}")
        while not wait([answer], LOOK_PERIOD).done:
            if run.cancelled.is_set():
                raise _CancelledError
            if time.monotonic() > deadline:
                raise DeploymentError(silence)
        return answer.result()

    # -- by its driver --------------------------------------------------------------------------------------------

    def _start(self, run: _Run, driver: Configuration) -> RepairOutcome:
        """Have a driver started in the thread that changes functions, and wait here until it is up."""
        begun: Future[DriverStart] = Future()
        self._inbox.put(lambda: self._begin(begun, driver))
        while not wait([begun], LOOK_PERIOD).done:
            if run.cancelled.is_set() and begun.cancel():
                raise _CancelledError
        start, deadline = begun.result(), time.monotonic() + self._timeout
        while True:
            if run.cancelled.is_set():
                raise _CancelledError
            is_late = time.monotonic() > deadline
            missing = [node for node in start.nodes if not start.names.is_up(node)]
            conflict = start.names.conflict(missing[0]) if missing else ""
            report = self._executor.report(driver.function)
            outcome = told_by_launcher(report, start.number, missing, conflict, self._timeout if is_late else None)
            if outcome:
                return outcome
            start.held.look(missing)
            time.sleep(LOOK_PERIOD)

    def _begin(self, begun: Future[DriverStart], driver: Configuration) -> None:
        if not begun.set_running_or_notify_cancel():
            return
        try:
            begun.set_result(self._start_now(driver))
        except Exception as error:  # it ends the repair, and not the thread that changes functions
            begun.set_exception(error)

    def _start_now(self, driver: Configuration) -> DriverStart:
        start = self._executor.start_driver(driver)
        self._drivers.started(driver)
        return start


def _line(error: Exception) -> str:
    return " ".join(str(error).split())
