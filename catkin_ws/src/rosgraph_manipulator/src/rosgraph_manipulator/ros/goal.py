"""Keeps the pending goal of an action while its server is replaced; the decisions are in `goal_keeper`.

As long as the goal is pending, it is stored in the parameter `ACTION/resume_goal`. A server that knows the parameter
continues the goal before it publishes its first status. Where it deletes the parameter, the goal is stored again, since
that server may die, too. `~kept_goals` has the same goal for a manipulator that is started again: the former one may
have died just after a server took the goal. A goal that came without an id is stored when the server has named it and
works at it, or is replaced.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import io
import threading
import time
from collections.abc import Callable, Collection
from typing import Any

import genpy
import roslib.message
import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from node_kit.ros.action_server import heeded

from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.goals.clients import Client
from rosgraph_manipulator.goals.goal_keeper import GoalKeeper
from rosgraph_manipulator.ros.goal_clients import GoalClients
from rosgraph_manipulator.ros.waiting import wait_until

QUEUE = 10
STATUS_TIMEOUT = 1.0  # s, wall, for a status of the server: actionlib's have one every 0.2 s


class PendingGoal:
    """Watches an action, and hands its pending goal to a new server."""

    def __init__(self, action: str, action_type: str, adopt: bool = False, changing: bool = False) -> None:
        """Begin to watch the action.

        Args:
            action: its name.
            action_type: e.g. `move_base_msgs/MoveBaseAction`.
            adopt: whether to keep the goal that an earlier manipulator has left; otherwise that goal is deleted.
            changing: whether the action's server is being replaced at this moment.

        Raises:
            ConfigurationError: the type is not installed.
        """
        self._action = action
        self._parameters = (f"{action}/resume_goal", f"~kept_goals/{action.strip('/').replace('/', '__')}")
        self._goal_type = action_type + "Goal"
        self._keeper = GoalKeeper()
        self._clients = GoalClients(action)
        self._lock = threading.RLock()
        self._stored: str | None = None  # id of the goal in the parameter
        self._server: object = None  # what stands for the present server's connection
        self._old_server: object = None
        goal_class = _message_class(self._goal_type)
        result_class = _message_class(action_type + "Result")
        self._keeper.server_changes(changing)
        self._recall(goal_class, adopt)
        self._goal_publisher = rospy.Publisher(f"{action}/goal", goal_class, queue_size=1)
        self._cancel_publisher = rospy.Publisher(f"{action}/cancel", GoalID, queue_size=QUEUE)
        self._subscribers = [
            rospy.Subscriber(f"{action}/goal", goal_class, self._on_goal, queue_size=QUEUE),
            rospy.Subscriber(f"{action}/result", result_class, self._locked(self._keeper.on_result), queue_size=QUEUE),
            rospy.Subscriber(f"{action}/cancel", GoalID, self._locked(self._on_cancel), queue_size=QUEUE),
            rospy.Subscriber(f"{action}/status", GoalStatusArray, self._on_status, queue_size=QUEUE),
        ]

    @property
    def status_topic(self) -> str:
        """Full name of the server's status topic."""
        return str(rospy.resolve_name(f"{self._action}/status"))

    def server_stops(self, leaving: Collection[str] = (), died: bool = False, is_back: bool = False) -> None:
        """Note that the server will be stopped now, or has died; drop the goal where nobody waits for it any more.

        Args:
            leaving: the nodes that will be stopped together with it.
            died: whether it has died.
            is_back: whether it was started again, so that the last status may be that of the new one.
        """
        if not died:
            # A goal that has ended while there was no manipulator is dropped by the first status of the server, and no
            # later one of this server can be taken for one of the next.
            wait_until(lambda: self._server is not None, STATUS_TIMEOUT)
        with self._lock:
            clients = self._keeper.clients
        why_gone = {client: self._clients.why_gone(client, leaving) for client in clients}
        for goal_id in self._keeper.missed:
            missed = f"its client sent it before {rospy.get_name()} was connected to it: use action_relay"
            rospy.logwarn("%s: goal %s is not kept: %s", self._action, goal_id, missed)
        with self._lock:
            dropped = self._keeper.keep_for_next_server(why_gone, died)
            self._keeper.server_changes(True)
            self._server = None if is_back else self._server
            self._old_server = self._server
            self._store(again=True)
        for line in dropped:
            rospy.logwarn("%s: %s", self._action, line)

    @property
    def is_between_servers(self) -> bool:
        """Whether a server was stopped, and `server_started` has not been called since."""
        return self._keeper.server_is_changing

    @property
    def server_is_new(self) -> bool:
        """Whether a server has published its status that is another one than the server before `server_stops`."""
        return self._server is not None and self._server is not self._old_server

    def server_started(self) -> None:
        """Note that a new server is there, and cancel at it what was cancelled meanwhile."""
        with self._lock:
            self._keeper.server_changes(False)
            self._store(again=True)  # the server may have taken it from there
            self._cancel_strays()

    def drop(self) -> None:
        """Forget the pending goal: its function is needed no longer."""
        with self._lock:
            self._keeper.server_changes(False)
            self._keeper.drop()
            self._store()

    def deliver(self) -> bool:
        """Send the goal if it is time; return whether the server has it or no goal is pending."""
        with self._lock:
            goal, client = self._keeper.to_send(time.monotonic())
            if goal is None and self._keeper.is_delivered:
                self._cancel_strays()  # what was cancelled since the server is there
                return True
        if goal is None:
            return False
        why_gone = self._clients.why_gone(client)
        with self._lock:
            if why_gone:
                rospy.logwarn("%s: goal %s is not sent to the new server: %s", self._action, goal.goal_id.id, why_gone)
                self._keeper.give_up(goal.goal_id.id)
                self._store()
            elif self._keeper.keeps(goal.goal_id.id):
                rospy.loginfo("sending the pending goal %s to the new server of %s", goal.goal_id.id, self._action)
                self._goal_publisher.publish(goal)
            return self._keeper.is_delivered

    def _cancel_strays(self) -> None:
        for goal_id in self._keeper.strays:
            self._cancel_publisher.publish(GoalID(id=goal_id))

    def _on_goal(self, goal: Any) -> None:
        client = self._clients.of(goal)  # it asks the master, so nobody is kept waiting
        with self._lock:
            self._keeper.on_goal(goal, client)
            self._store()

    def _on_cancel(self, goal_id: GoalID) -> None:
        goal_id = heeded(goal_id)
        if goal_id is not None:
            self._keeper.on_cancel(goal_id)

    def _on_status(self, status: GoalStatusArray) -> None:
        # Each connection has a header of its own, so another one is another process.
        with self._lock:
            is_new = self._server is not status._connection_header
            self._server = status._connection_header
            self._keeper.on_status(status)
            self._store(again=is_new)  # it has taken the goal from there; if it dies at once, the next one needs it

    def _locked(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        def locked(message: Any) -> None:
            with self._lock:
                callback(message)
                self._store()

        return locked

    def _store(self, again: bool = False) -> None:
        """Update the parameters, where another goal is the first for the next server, or the same one `again`."""
        goal_id = self._keeper.first_id
        is_unnamed = goal_id == "" and not self._keeper.server_is_changing
        if (goal_id == self._stored or is_unnamed) and not (again and goal_id is not None):
            return
        with contextlib.suppress(rospy.ROSException, OSError):  # without a master there is nothing to keep it for
            if goal_id is None:
                self._delete()
            else:
                buffer = io.BytesIO()
                goal, client = self._keeper.first_for_next_server
                goal.serialize(buffer)
                data = base64.b64encode(buffer.getvalue()).decode("ascii")
                waits = {"client": [client.node, client.address]} if client else {}
                for parameter in self._parameters:
                    rospy.set_param(parameter, {"type": self._goal_type, "data": data, **waits})
            self._stored = goal_id

    def _recall(self, goal_class: Any, adopt: bool) -> None:
        found = (rospy.get_param(parameter, None) for parameter in self._parameters)
        left = next((value for value in found if value is not None), None)
        if left is None:
            return
        try:
            if not adopt or left["type"] != self._goal_type:
                raise ValueError("it is from another time")
            goal = goal_class().deserialize(base64.b64decode(left["data"], validate=True))
            client = Client(*map(str, left["client"])) if "client" in left else None
            if why_gone := self._clients.why_gone(client):
                rospy.logwarn("%s: goal %s is not kept: %s", self._action, goal.goal_id.id, why_gone)
                raise ValueError(why_gone)
        except (KeyError, TypeError, ValueError, binascii.Error, genpy.DeserializationError):
            self._delete()
            return
        self._keeper.adopt(goal, client)
        self._stored = goal.goal_id.id
        rospy.loginfo("took over the pending goal %s of %s", goal.goal_id.id, self._action)

    def _delete(self) -> None:
        for parameter in self._parameters:
            with contextlib.suppress(KeyError):
                rospy.delete_param(parameter)


def _message_class(name: str) -> Any:
    message_class = roslib.message.get_message_class(name)
    if message_class is None:
        raise ConfigurationError(f"parameter 'goal_msg_type': message type {name} is not installed")
    return message_class
