"""Node action_relay: offers an action of its own in front of a server that may be replaced."""

from __future__ import annotations

import threading
from typing import Any

import actionlib
import roslib.message
import rospy
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding, LaunchedFunctions
from node_kit.io.inbox import Inbox
from node_kit.ros.action_server import is_connected
from node_kit.ros.connections import latest
from node_kit.ros.lifetime import Lifetime

from rosgraph_manipulator.configuration.configurations import ConfigurationError, action_type
from rosgraph_manipulator.goals.clients import Client
from rosgraph_manipulator.goals.relay import Ending, Link, ServedFunctions
from rosgraph_manipulator.ros.action_server import ActionServer
from rosgraph_manipulator.ros.goal_clients import GoalClients
from rosgraph_manipulator.ros.launcher_reports import TOPIC as LAUNCHED

PERIOD = 0.05  # s, wall, between two looks at whether goals can be sent
BUSY = (FunctionGrounding.RECONFIGURING, FunctionGrounding.RECOVERING)


class _Goal:
    """A client's goal with its counterpart at the server behind."""

    def __init__(self, outer: actionlib.ServerGoalHandle) -> None:
        self.outer = outer
        self.link = Link()
        self.inner: actionlib.ClientGoalHandle | None = None


class Relay:
    """Passes goals to the server, and feedback and results to the clients.

    actionlib calls back while it holds a lock: that of the server where a client wants something, that of a goal where
    the server behind has done something. What follows may need the other lock. So callbacks only leave work, and the
    thread that spins does it, without a lock.
    """

    def __init__(self, action: str, server: str, kind: Any, function: str = "") -> None:
        """Begin to offer an action.

        Args:
            action: its name.
            server: name of the action that pursues its goals.
            kind: type of both.
            function: the function whose nodes serve that action; empty: those that the launchers tell.
        """
        self._goals: dict[str, _Goal] = {}
        self._inbox = Inbox()
        self._busy: frozenset[str] = frozenset()  # the functions that change or recover
        self._served = ServedFunctions(function)
        self._client = actionlib.ActionClient(server, kind)
        self._server = ActionServer(action, kind, self._on_goal, self._on_cancel, auto_start=False)
        rospy.Subscriber(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, latest(self._on_configuration)
        )
        rospy.Subscriber(LAUNCHED, LaunchedFunctions, latest(self._on_launched), queue_size=20)
        self._waits = GoalClients(action, server)
        self._waiting: dict[str, Client | None] = {}  # who waits for each goal
        self._subscriber = rospy.Subscriber(f"{action}/goal", type(kind().action_goal), self._on_goal_message)
        self._server.start()

    def spin(self) -> None:
        """Do what callbacks leave, and send waiting goals when the server can take them, until the node ends."""
        end = threading.Event()
        rospy.on_shutdown(end.set)
        while not end.is_set():
            self._inbox.drain(wait_s=PERIOD)
            self._send_goals()

    @property
    def _changing(self) -> bool:
        """Whether a function changes or recovers whose nodes serve the action behind, as far as is known."""
        return self._served.concern(self._busy)

    def _send_goals(self) -> None:
        if status := self._client.last_status_msg:
            self._served.served_by({status._connection_header["callerid"]})
        if not any(goal.link.needs_sending(self._changing) for goal in self._goals.values()):
            return
        if not is_connected(self._client):
            return
        again = [name for name, goal in self._goals.items() if goal.inner and goal.link.needs_sending(False)]
        gone = {name: why for name in again if (why := self._waits.why_gone(self._waiting.get(name)))}
        for name, goal in list(self._goals.items()):
            if name in gone:
                rospy.logwarn("goal %s is not sent again: %s", name, gone[name])
                self._end(goal, Ending.CANCELLED, None, gone[name])
            elif goal.link.needs_sending(self._changing):
                goal.link.sent = True
                goal.inner = self._client.send_goal(
                    goal.outer.get_goal(),
                    transition_cb=lambda inner, goal=goal: self._on_transition(goal, inner),
                    feedback_cb=lambda _inner, feedback, goal=goal: goal.outer.publish_feedback(feedback),
                )

    def _on_goal_message(self, message: Any) -> None:
        client = self._waits.of(message)
        self._inbox.put(lambda: self._note_client(message.goal_id.id, client))

    def _note_client(self, goal_id: str, client: Client | None) -> None:
        known = {name: self._waiting[name] for name in self._goals if name in self._waiting}
        self._waiting = {**known, goal_id: client}

    def _on_goal(self, handle: actionlib.ServerGoalHandle) -> None:
        handle.set_accepted()
        self._inbox.put(lambda: self._take(handle))

    def _take(self, handle: actionlib.ServerGoalHandle) -> None:
        self._goals[handle.get_goal_id().id] = _Goal(handle)

    def _on_cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        self._inbox.put(lambda: self._cancel(handle.get_goal_id().id))

    def _cancel(self, name: str) -> None:
        goal = self._goals.get(name)
        if goal is None:
            return
        ending = goal.link.cancel()
        if ending:
            self._end(goal, ending, None, "taken back while there was no server")
        elif goal.inner is not None:
            goal.inner.cancel()

    def _on_transition(self, goal: _Goal, inner: actionlib.ClientGoalHandle) -> None:
        if inner.get_comm_state() != actionlib.CommState.DONE:
            return
        state, result, text = inner.get_terminal_state(), inner.get_result(), inner.get_goal_status_text()
        changing = self._changing
        self._inbox.put(lambda: self._take_end(goal, state, result, text, changing))

    def _take_end(self, goal: _Goal, state: int, result: Any, text: str, changing: bool) -> None:
        if not goal.link.sent:
            return
        ending = goal.link.ended_behind(state, changing)
        if ending:
            self._end(goal, ending, result, text)
        else:
            rospy.loginfo("goal %s is sent again to the next server", goal.outer.get_goal_id().id)

    def _end(self, goal: _Goal, ending: Ending, result: Any, text: str) -> None:
        self._goals.pop(goal.outer.get_goal_id().id, None)
        finish = {
            Ending.SUCCEEDED: goal.outer.set_succeeded,
            Ending.ABORTED: goal.outer.set_aborted,
            Ending.CANCELLED: goal.outer.set_canceled,
        }[ending]
        finish(result, text)

    def _on_configuration(self, active: ActiveConfiguration) -> None:
        self._busy = frozenset(grounding.function for grounding in active.functions if grounding.state in BUSY)

    def _on_launched(self, message: LaunchedFunctions) -> None:
        nodes = {function.function: function.nodes for function in message.functions}
        self._served.launched(message._connection_header["callerid"], nodes)


def main() -> None:
    """Run the node; exit with status 2 where a parameter can't be used."""
    with Lifetime("action_relay", ConfigurationError) as life:
        life.start()
        names = [rospy.get_param(f"~{key}", "") for key in ("action", "server")]
        if not all(isinstance(name, str) and name for name in names) or names[0] == names[1]:
            raise ConfigurationError("parameters '~action' and '~server' must be two different names of actions")
        kind = action_type(rospy.get_param("~type", ""), "~type")
        message_class = roslib.message.get_message_class(kind)
        if message_class is None:
            raise ConfigurationError(f"parameter '~type': message type {kind} is not installed")
        function = rospy.get_param("~function", "")
        if not isinstance(function, str):
            raise ConfigurationError(f"parameter '~function' is {function!r}: it must be the name of a function")
        Relay(names[0], names[1], message_class, function).spin()
