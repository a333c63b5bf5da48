"""The actions by which changes are requested; `change.requests` decides what becomes of a request."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
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

from rosgraph_manipulator.change.deployment import Outcome
from rosgraph_manipulator.change.request_queue import Policy
from rosgraph_manipulator.change.requests import Order, Requests
from rosgraph_manipulator.configuration.configurations import ManipulatorOptions
from rosgraph_manipulator.ros.action_server import ActionServer

CHANGE_FUNCTION = "rosgraph_manipulator/change_function"


class RequestServer:
    """Offers the two actions. The callbacks of actionlib run in other threads, orders in that of the inbox."""

    def __init__(
        self,
        options: ManipulatorOptions,
        policy: Policy,
        inbox: Inbox,
        carry_out: Callable[[Order], Outcome],
        none_follows: Callable[[str], object],
    ) -> None:
        """Begin without offering anything; `start` offers the actions.

        Args:
            options: the configurations that can be asked for.
            policy: what happens to a request while another one of its function is carried out.
            inbox: work of the thread that carries out orders.
            carry_out: carries out an order in that thread.
            none_follows: is called there with a function of which a waiting request was taken back.
        """
        self._requests = Requests(options, policy, carry_out, inbox.put, threading.Lock(), none_follows)
        self.check = self._requests.check
        self._reconfiguration = options.reconfiguration_action_name
        self._servers = [
            ActionServer(name, kind, on_goal, partial(self._on_cancel, name), auto_start=False)
            for name, kind, on_goal in (
                (self._reconfiguration, MvpReconfigurationAction, self._on_configuration),
                (CHANGE_FUNCTION, ChangeFunctionAction, self._on_function),
            )
        ]

    def start(self) -> None:
        """Take requests from now on."""
        for server in self._servers:
            server.start()

    def _on_configuration(self, handle: actionlib.ServerGoalHandle) -> None:
        order, problem = self._requests.order_for(handle.get_goal().desired_configuration_name)
        action = self._reconfiguration
        self._take(action, handle, order, problem, lambda outcome: MvpReconfigurationResult(int(outcome.result)))

    def _on_function(self, handle: actionlib.ServerGoalHandle) -> None:
        goal = handle.get_goal()
        restart = tuple(map(rospy.resolve_name, goal.restart))
        order, problem = self._requests.order_of_function(goal.function, goal.configuration, restart)

        def result(outcome: Outcome) -> ChangeFunctionResult:
            return ChangeFunctionResult(int(outcome.result), outcome.message)

        self._take(CHANGE_FUNCTION, handle, order, problem, result)

    def _take(
        self,
        action: str,
        handle: actionlib.ServerGoalHandle,
        order: Order | None,
        problem: str,
        result: Callable[[Outcome], Any],
    ) -> None:
        if order is None:
            rospy.logerr("%s", problem)
            self._requests.refuse(handle, problem, result)
        else:
            self._requests.take(_request(action, handle), order, handle, result)

    def _on_cancel(self, action: str, handle: actionlib.ServerGoalHandle) -> None:
        self._requests.take_back(_request(action, handle))


def _request(action: str, handle: actionlib.ServerGoalHandle) -> str:
    """Return the name of a request: ids of goals are chosen by clients, so both actions may have the same one."""
    return f"{action} {handle.get_goal_id().id}"
