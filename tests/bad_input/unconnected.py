"""A ROS without a master: nodes are made as always, and a test gives their callbacks messages."""

from __future__ import annotations

import io
import threading
import xmlrpc.client
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import actionlib
import genpy
import rospy
from node_kit.io.inbox import Inbox
from node_kit.ros.kept_parameter import KeptParameter
from rospy.exceptions import ROSSerializationException
from rospy.impl.tcpros_service import convert_return_to_response

NAME = "/node"
NOW = 100.0
"""s of ROS time."""
_MISSING = object()


class Subscriber:
    """What a node listens by."""

    def __init__(
        self, name: str, data_class: Any, callback: Any = None, callback_args: Any = _MISSING, **_: object
    ) -> None:
        self.name = self.resolved_name = rospy.resolve_name(name)
        self.data_class, self._callback, self._arguments = data_class, callback, callback_args
        _ROS[-1].subscribers.append(self)

    def received(self, data: bytes) -> Any:
        """Return a message as it comes over a connection.

        Raises:
            Exception: it is none; rospy says so and goes on.
        """
        message = self.data_class()
        if isinstance(message, rospy.AnyMsg):
            message._buff = data
        else:
            message.deserialize(data)
        message._connection_header = {"callerid": "/other", "type": _ROS[-1].types.get(self.name, ""), "latching": "0"}
        return message

    def give(self, message: Any) -> None:
        """Call back, with a message as it is."""
        if self._callback is None:
            return
        if self._arguments is _MISSING or self._arguments is None:
            self._callback(message)
        else:
            self._callback(message, self._arguments)

    def unregister(self) -> None:
        """Listen no more."""
        if _ROS and self in _ROS[-1].subscribers:
            _ROS[-1].subscribers.remove(self)

    def get_num_connections(self) -> int:
        """Return that somebody publishes."""
        return 1


class Publisher:
    """What a node publishes by: messages are serialised, and nobody gets them."""

    def __init__(self, name: str, data_class: Any, *_: object, **__: object) -> None:
        self.name = self.resolved_name = rospy.resolve_name(name)
        self.data_class, self.impl, self.md5sum, self.type = data_class, self, "", data_class._type

    def publish(self, *arguments: Any, **named: Any) -> None:
        """Serialise a message, as rospy does.

        Raises:
            ROSSerializationException: it has a value that its type can't hold.
        """
        message = arguments[0] if len(arguments) == 1 and isinstance(arguments[0], genpy.Message) else None
        message = message or self.data_class(*arguments, **named)
        try:
            message.serialize(io.BytesIO())
        except genpy.SerializationError as error:
            raise ROSSerializationException(str(error)) from error

    def get_num_connections(self) -> int:
        """Return that somebody listens."""
        return 1

    def has_connections(self) -> bool:
        """Return that somebody listens."""
        return True

    def unregister(self) -> None:
        """Publish no more."""


class Service(Subscriber):
    """What a node offers: it listens to requests under the service's name."""

    def __init__(self, name: str, service_class: Any, handler: Any, *_: object, **__: object) -> None:
        super().__init__(name, service_class._request_class, handler)
        self.service_class, self.handler = service_class, handler

    def give(self, message: Any) -> None:
        """Call it; the answer goes over a connection, as rospy sends it.

        Raises:
            Exception: the node has none; rospy tells the caller, and logs a traceback.
        """
        try:
            answer = self.handler(message)
        except rospy.ServiceException as error:  # it is refused
            _ROS[-1].say(str(error))
            return
        convert_return_to_response(answer, self.service_class._response_class).serialize(io.BytesIO())

    def shutdown(self, *_: object) -> None:
        """Offer it no more."""
        self.unregister()


class _Nothing:
    """Takes any call."""

    def __init__(self, *_: object, **__: object) -> None: ...

    def __getattr__(self, _name: str) -> Any:
        return lambda *_, **__: None

    def __call__(self, *_: object, **__: object) -> Any:
        raise rospy.ServiceException("there is no master")


class Ros:
    """What stands for ROS in the meantime.

    Attributes:
        parameters: of the parameter server, by full names.
        types: of topics that are listened to without a type.
        subscribers: of the nodes that were made.
        said: warnings and errors that were logged.
    """

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self.parameters = dict(parameters)
        self.types: dict[str, str] = {}
        self.subscribers: list[Subscriber] = []
        self.said: list[str] = []

    def listening(self, topic: str) -> list[Subscriber]:
        """Return who listens to a topic."""
        return [one for one in self.subscribers if one.name == topic]

    def get_param(self, name: str, default: Any = _MISSING) -> Any:
        """Return a parameter."""
        full = rospy.resolve_name(name).rstrip("/")
        node: Any = self.parameters.get(full, _MISSING)
        if node is _MISSING and (above := next((a for a in self.parameters if full.startswith(f"{a}/")), None)):
            node = self.parameters[above]
            for key in full.removeprefix(f"{above}/").split("/"):
                node = node.get(key, _MISSING) if isinstance(node, dict) else _MISSING
        if node is not _MISSING:
            return node
        if default is _MISSING:
            raise KeyError(name)
        return default

    def say(self, text: Any, *arguments: Any, **_: Any) -> None:
        """Take a warning."""
        self.said.append(str(text) % arguments if arguments else str(text))

    def say_throttled(self, _period: float, text: Any, *arguments: Any, **named: Any) -> None:
        """Take a warning that is not repeated."""
        self.say(text, *arguments, **named)


_ROS: list[Ros] = []


@contextmanager
def unconnected(parameters: Mapping[str, Any] | None = None) -> Iterator[Ros]:
    """Let nodes be made without a master.

    Args:
        parameters: trees by the full names of their roots; those of the node itself are at `/node`.
    """
    ros = Ros(parameters or {})
    _ROS.append(ros)
    rospy.names._set_caller_id(NAME)
    rospy.rostime.set_rostime_initialized(True)
    rospy.rostime._set_rostime(rospy.Time.from_sec(NOW))
    replaced = {
        "Subscriber": Subscriber,
        "Publisher": Publisher,
        "Service": Service,
        "ServiceProxy": _Nothing,
        "Timer": _Nothing,
        "get_param": ros.get_param,
        "set_param": ros.parameters.__setitem__,
        "has_param": lambda name: ros.get_param(name, None) is not None,
        "delete_param": lambda name: ros.parameters.pop(rospy.resolve_name(name), None),
        "search_param": lambda _: None,
        "on_shutdown": lambda _: None,
        "init_node": lambda *_, **__: None,
        "get_node_uri": lambda: "http://localhost:1/",
        "wait_for_service": _Nothing(),
        "sleep": lambda _: None,
        **dict.fromkeys(("logwarn", "logerr", "logfatal"), ros.say),
        **dict.fromkeys(("loginfo", "logdebug", "loginfo_throttle", "logdebug_throttle", "loginfo_once"), _silent),
        **dict.fromkeys(("logwarn_throttle", "logerr_throttle", "logwarn_throttle_identical"), ros.say_throttled),
    }
    with ExitStack() as stack:
        for name, value in replaced.items():
            stack.enter_context(patch.object(rospy, name, value))
        stack.enter_context(patch.object(threading.Thread, "start", lambda _: None))
        stack.enter_context(patch.object(Inbox, "call", _call))
        stack.enter_context(patch.object(KeptParameter, "set", _keep))
        stack.enter_context(patch.object(actionlib.ActionServer, "publish_status_async", lambda _: None))
        try:
            yield ros
        finally:
            _ROS.remove(ros)


def _call(inbox: Inbox, work: Callable[[], Any], *_: object) -> Any:
    """Do what a service leaves for the node's loop, which is this thread: after all that was left before."""
    inbox.drain()
    return work()


def _keep(kept: KeptParameter, value: Any, *_: object) -> None:
    """Write a parameter at once, as the master would read it.

    Raises:
        Exception: XML-RPC can't tell it, so it would never be kept.
    """
    _ROS[-1].parameters[kept._name] = told_by_master(value)


def told_by_master(value: Any) -> Any:
    """Return a parameter as the master gives it back.

    Raises:
        Exception: XML-RPC can't tell it.
    """
    (read,), _name = xmlrpc.client.loads(xmlrpc.client.dumps((value,)))
    return read


def _silent(*_: object, **__: object) -> None:
    """Say nothing."""
