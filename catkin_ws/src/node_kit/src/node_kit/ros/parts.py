"""Watches over the other parts of a system: each gives signs of life, and tells on /diagnostics when one is lost."""

from __future__ import annotations

import contextlib
import math
import threading
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from node_kit.io.background import again_and_again
from node_kit.io.inbox import Inbox
from node_kit.io.xml_rpc import CallError, Client, DeniedError, GoneError
from node_kit.parts import PERIOD, Answer, Parts, Sign

TOPIC = "metacontrol_parts"
"""Topic of the signs of life, in the robot's namespace."""
MESSAGE = "Part of the meta-controller"
"""`message` of the statuses about lost parts."""

_LOOK = 0.25  # s, wall, between two looks
_DEADLINE = 0.4  # s, wall, for an answer
_GOODBYE = 0.05  # s, wall, in which the last sign goes out
_REPEAT = 1.0  # s, wall: what is lost is told so often


def watch_parts(part: str) -> PartsWatch:
    """Give signs of life from now on, and tell which other parts are lost. The node must have begun.

    Args:
        part: what this node is in the system.
    """
    return PartsWatch(part)


def sign_of(status: DiagnosticStatus) -> Sign:
    """Return the sign of life in a message of the topic."""
    values = {value.key: value.value for value in status.values}
    try:
        started = float(values.get("started", ""))
    except ValueError:
        started = math.inf
    ends = status.level == DiagnosticStatus.STALE
    return Sign(status.name, values.get("part", ""), values.get("uri", ""), started, ends)


class PartsWatch:
    """Watches over the other parts in a thread of its own.

    Attributes:
        head_start: for how long others had run when this node was started, wall s, as far as they have been heard.
    """

    def __init__(self, part: str) -> None:
        """Begin (see `watch_parts`)."""
        self.head_start = 0.0
        self._part = part
        self._started = time.time()
        self._parts = Parts(rospy.get_name(), self._started)
        self._inbox = Inbox()
        self._signs = rospy.Publisher(TOPIC, DiagnosticStatus, queue_size=5)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=5)
        rospy.Subscriber(TOPIC, DiagnosticStatus, self._on_sign, queue_size=50)
        rospy.on_shutdown(self._end)
        self._given_at = self._asked_at = self._told_at = 0.0  # monotonic s
        self._news: dict[str, str] = {}
        threading.Thread(target=self._run, name="watch parts", daemon=True).start()

    def _on_sign(self, status: DiagnosticStatus) -> None:
        if status._connection_header.get("callerid") != status.name:  # one node can't speak for another
            return
        sign = sign_of(status)
        self._inbox.put(lambda: self._parts.hear(sign, time.monotonic()))

    def _run(self) -> None:
        again_and_again(self._look, lambda: not rospy.is_shutdown())

    def _look(self) -> None:
        self._inbox.do_next(wait_s=_LOOK)
        self._inbox.drain()
        now = time.monotonic()
        if now - self._given_at >= PERIOD:
            self._given_at = now
            self._give()
        if now - self._asked_at >= _LOOK:
            self._asked_at = now
            for sign in self._parts.doubtful(now):
                self._parts.note(sign.node, _ask(sign), time.monotonic())
        self.head_start = self._parts.head_start()
        before, news = self._news, self._parts.to_tell()
        is_new = any(before.get(node) != why for node, why in news.items())
        if news and (is_new or now - self._told_at >= _REPEAT):
            self._told_at = now
            self._tell(news, before)
        self._news = news

    def _tell(self, news: dict[str, str], before: dict[str, str]) -> None:
        """Tell on /diagnostics what is lost and what is there again, and in the log what is new of it."""
        for node, why in news.items():
            if why and not before.get(node):
                rospy.logerr("%s, a part of the meta-controller, is lost: %s", node, why)
            elif not why:
                rospy.loginfo("%s, a part of the meta-controller, is there again", node)
        array = DiagnosticArray(status=[self._status(node, why) for node, why in news.items()])
        array.header.stamp = rospy.Time.now()
        with contextlib.suppress(rospy.ROSException):  # the node ends
            self._diagnostics.publish(array)

    def _status(self, node: str, why: str) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=DiagnosticStatus.ERROR if why else DiagnosticStatus.OK,
            name=node,
            message=MESSAGE,
            values=[KeyValue("state", f"lost: {why}" if why else "there again")],
        )

    def _end(self) -> None:
        self._give(ends=True)
        time.sleep(_GOODBYE)

    def _give(self, *, ends: bool = False) -> None:
        level = DiagnosticStatus.STALE if ends else DiagnosticStatus.OK
        told = {"part": self._part, "uri": rospy.get_node_uri() or "", "started": repr(self._started)}
        values = [KeyValue(*pair) for pair in told.items()]
        with contextlib.suppress(rospy.ROSException):  # the node ends
            self._signs.publish(DiagnosticStatus(level, rospy.get_name(), MESSAGE, "", values))


def _ask(sign: Sign) -> Answer:
    """Ask a node for its process; of one that is gone or silent, ask the master.

    One that was asked to end, and whose last sign was lost, has taken its leave there, or has a successor.
    """
    try:
        with Client(sign.uri, rospy.get_name(), _DEADLINE, "node") as client:
            client.call("getPid")
    except GoneError:
        return _ask_master(sign)
    except CallError:
        return Answer.UNKNOWN if _ask_master(sign) is Answer.ENDED else Answer.SILENT
    return Answer.LIVES


def _ask_master(sign: Sign) -> Answer:
    """Ask the master about a node, and answer as if its process had ended."""
    try:
        with Client(rosgraph.get_master_uri(), rospy.get_name(), _DEADLINE) as master:
            return Answer.GONE if master.call("lookupNode", sign.node) == sign.uri else Answer.STARTS
    except DeniedError:
        return Answer.ENDED
    except CallError:
        return Answer.GONE
