"""Keeps the pending goal of an action while its server is replaced; the decisions are in `goal_keeper`.

As long as the goal is pending, it is stored in the parameter `ACTION/resume_goal`. A server that knows the parameter
continues the goal before it publishes its first status. Where it deletes the parameter, the goal is stored again, since
that server may die, too. `~kept_goals` has the goal for a manipulator that is started again: the former one may have
died just after a server took the goal. A goal that came without an id is stored when the server has named it and
works at it, or is replaced. Where a newer goal has come of which the server has not told whether it takes it, the first
parameter has the one at work, and `~kept_goals` has all.
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
        self._for_server = f"{action}/resume_goal"
        self._for_manipulator = f"~kept_goals/{action.strip('/').replace('/', '__')}"
        self._goal_type = action_type + "Goal"
        self._keeper = GoalKeeper()
        self._clients = GoalClients(action)
        self._lock = threading.RLock()
        self._stored: tuple[str | None, tuple[str, ...]] = None, ()  # ids of the goals in the two parameters
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
                self._keeper.client_is_gone(client)
                self._store()
            elif self._keeper.next_id == goal.goal_id.id:  # still: to ask may take a while
                rospy.loginfo("sending the pending goal %s to the new server of %s", goal.goal_id.id, self._action)
                self._goal_publisher.publish(goal)
        return False

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
        """Update the parameters, where they do not have the present goals; where they do, only if `again`.

        A goal that the server will name is not stored.
        """
        ids, first_id = self._keeper.kept_ids, self._keeper.first_id
        if not (again or self._keeper.server_is_changing):
            if first_id == "":
                return
            ids = tuple(filter(None, ids))
        if (first_id, ids) == self._stored and not (again and ids):
            return
        with contextlib.suppress(rospy.ROSException, OSError):  # without a master there is nothing to keep it for
            if ids:
                goals = [self._encoded(*one) for one in self._keeper.kept]
                rospy.set_param(self._for_manipulator, goals[: len(ids)])  # only the last one has no id
                if again or first_id != self._stored[0]:
                    rospy.set_param(self._for_server, self._encoded(*self._keeper.first_for_next_server))
            else:
                self._delete()
            self._stored = first_id, ids

    def _encoded(self, goal: Any, client: Client | None) -> dict[str, Any]:
        buffer = io.BytesIO()
        goal.serialize(buffer)
        data = base64.b64encode(buffer.getvalue()).decode("ascii")
        return {"type": self._goal_type, "data": data, **({"client": [client.node, client.address]} if client else {})}

    def _recall(self, goal_class: Any, adopt: bool) -> None:
        if not adopt:
            self._delete()
            return
        kept, first = (rospy.get_param(name, None) for name in (self._for_manipulator, self._for_server))
        at_server = self._decoded([first], goal_class)
        own = self._decoded(kept, goal_class) if isinstance(kept, list) else []
        found = own or at_server
        for goal, client in found:
            if why_gone := self._clients.why_gone(client):
                rospy.logwarn("%s: goal %s is not kept: %s", self._action, goal.goal_id.id, why_gone)
            else:
                self._keeper.adopt(goal, client)
                rospy.loginfo("took over the pending goal %s of %s", goal.goal_id.id, self._action)
        if self._keeper.first_id is None:
            self._delete()
            return
        # The server has deleted its parameter where the goal has ended meanwhile.
        first_id = at_server[0][0].goal_id.id if at_server else self._keeper.first_id
        self._stored = first_id, tuple(goal.goal_id.id for goal, _ in own)
        self._store()

    def _decoded(self, kept: list[Any], goal_class: Any) -> list[tuple[Any, Client | None]]:
        """Return the goals of a parameter, and who waits for each; none where one of them is from another time."""
        goals = []
        with contextlib.suppress(KeyError, TypeError, ValueError, binascii.Error, genpy.DeserializationError):
            for one in kept:
                if one["type"] != self._goal_type:
                    return []
                goal = goal_class().deserialize(base64.b64decode(one["data"], validate=True))
                goals.append((goal, Client(*map(str, one["client"])) if "client" in one else None))
            return goals
        return []

    def _delete(self) -> None:
        for parameter in (self._for_manipulator, self._for_server):
            with contextlib.suppress(KeyError):
                rospy.delete_param(parameter)


def _message_class(name: str) -> Any:
    message_class = roslib.message.get_message_class(name)
    if message_class is None:
        raise ConfigurationError(f"parameter 'goal_msg_type': message type {name} is not installed")
    return message_class
