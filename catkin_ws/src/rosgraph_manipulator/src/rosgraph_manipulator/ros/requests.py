"""The actions by which changes are requested; requests wait for their turn here."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import actionlib
import rospy
from metacontrol_msgs.msg import (
    ChangeFunctionAction,
    ChangeFunctionResult,
    MvpReconfigurationAction,
    MvpReconfigurationResult,
)
from node_kit.io.inbox import Inbox

from rosgraph_manipulator.change.deployment import CancelledError, Outcome, Result
from rosgraph_manipulator.change.request_queue import Policy, RequestQueue
from rosgraph_manipulator.configuration.configurations import ManipulatorOptions
from rosgraph_manipulator.ros.action_server import ActionServer

CHANGE_FUNCTION = "rosgraph_manipulator/change_function"


@dataclass(frozen=True)
class Order:
    """What a request asks for.

    Attributes:
        function: the function to change.
        configuration: the one to deploy; empty: release the function.
        restart: nodes to restart even if they do not differ.
    """

    function: str
    configuration: str
    restart: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return what is asked for, in words."""
        return self.configuration or f"the release of {self.function}"


@dataclass(frozen=True)
class _Request:
    order: Order
    handle: actionlib.ServerGoalHandle
    result: Callable[[Outcome], Any]


class RequestServer:
    """Offers the two actions. The callbacks of actionlib run in other threads, orders in that of the inbox."""

    def __init__(
        self, options: ManipulatorOptions, policy: Policy, inbox: Inbox, carry_out: Callable[[Order], Outcome]
    ) -> None:
        """Begin without offering anything; `start` offers the actions.

        Args:
            options: the configurations that can be asked for.
            policy: what happens to a request while another one of its function is carried out.
            inbox: work of the thread that carries out orders.
            carry_out: carries out an order in that thread.
        """
        self._options, self._inbox, self._carry_out = options, inbox, carry_out
        self._queue = RequestQueue(policy)
        self._requests: dict[str, _Request] = {}
        self._lock = threading.Lock()
        self._interruption: CancelledError | None = None
        self._servers = [
            ActionServer(name, kind, on_goal, self._on_cancel, auto_start=False)
            for name, kind, on_goal in (
                (options.reconfiguration_action_name, MvpReconfigurationAction, self._on_configuration),
                (CHANGE_FUNCTION, ChangeFunctionAction, self._on_function),
            )
        ]

    def start(self) -> None:
        """Take requests from now on."""
        for server in self._servers:
            server.start()

    def check(self) -> None:
        """Raise where the order that is carried out must be given up.

        Raises:
            CancelledError: it was taken back or replaced.
        """
        interruption = self._interruption
        if interruption is not None:
            raise interruption

    def _on_configuration(self, handle: actionlib.ServerGoalHandle) -> None:
        name = handle.get_goal().desired_configuration_name
        configuration = self._options.configurations.get(name)
        order = Order(configuration.function, name) if configuration else None
        self._take(handle, order, self._unknown(name), lambda outcome: MvpReconfigurationResult(int(outcome.result)))

    def _on_function(self, handle: actionlib.ServerGoalHandle) -> None:
        goal = handle.get_goal()
        configuration = self._options.configurations.get(goal.configuration)
        order, problem = None, ""
        if goal.function not in self._options.all_functions:
            known = ", ".join(sorted(self._options.all_functions))
            problem = f"unknown function '{goal.function}'; known are: {known}"
        elif goal.configuration and configuration is None:
            problem = self._unknown(goal.configuration)
        elif configuration is not None and configuration.function != goal.function:
            problem = f"configuration {goal.configuration} is of function {configuration.function}, not {goal.function}"
        else:
            order = Order(goal.function, goal.configuration, tuple(map(rospy.resolve_name, goal.restart)))
        self._take(handle, order, problem, lambda outcome: ChangeFunctionResult(int(outcome.result), outcome.message))

    def _unknown(self, name: str) -> str:
        return f"unknown configuration '{name}'; known are: {', '.join(sorted(self._options.configurations))}"

    def _take(
        self,
        handle: actionlib.ServerGoalHandle,
        order: Order | None,
        problem: str,
        result: Callable[[Outcome], Any],
    ) -> None:
        if order is None:
            rospy.logerr("%s", problem)
            handle.set_accepted()
            handle.set_aborted(result(Outcome(Result.UNKNOWN, None, problem)), problem)
            return
        request = handle.get_goal_id().id
        with self._lock:
            arrival = self._queue.arrive(request, order.function)
            dropped = [self._requests.pop(old) for old in arrival.dropped]
            if arrival.accepted:
                self._requests[request] = _Request(order, handle, result)
            if arrival.interrupts:
                self._interruption = CancelledError(f"given up for {order}", superseded=True)
        for old in dropped:
            _cancel(old, f"given up for {order}")
        if not arrival.accepted:
            reason = "another change is under way"
            handle.set_rejected(result(Outcome(Result.FAILED, None, reason)), reason)
            return
        handle.set_accepted()
        self._inbox.put(self._next)

    def _on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        name = handle.get_goal_id().id
        waited = None
        with self._lock:
            if self._queue.take_back(name):
                waited = self._requests.pop(name)
            elif self._queue.running == name and self._interruption is None:
                self._interruption = CancelledError("the request was taken back")
        if waited:
            _cancel(waited, "taken back before its turn came")

    def _next(self) -> None:
        with self._lock:
            name = self._queue.next()
            request = self._requests.pop(name) if name else None
            self._interruption = None
        if request is None:
            return
        try:
            outcome = self._carry_out(request.order)
        finally:
            with self._lock:
                self._queue.finish()
                self._interruption = None
        result = request.result(outcome)
        if outcome.result is Result.OK:
            request.handle.set_succeeded(result, outcome.message)
        elif outcome.cancelled:
            request.handle.set_canceled(result, outcome.message)
        else:
            request.handle.set_aborted(result, outcome.message)


def _cancel(request: _Request, reason: str) -> None:
    request.handle.set_canceled(request.result(Outcome(Result.FAILED, None, reason)), reason)
