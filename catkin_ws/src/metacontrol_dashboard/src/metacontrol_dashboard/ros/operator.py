"""What an operator asks of the reasoner and of the manipulator, by their services and actions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import rospy
from metacontrol_msgs import srv as services
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.replay.recording import RecordingError
from node_kit.io.background import NoThreadError, in_background
from node_kit.ros.services import SERVICE_FAILURES
from rosgraph_manipulator.ros import client
from std_srvs.srv import Trigger

if TYPE_CHECKING:
    from metacontrol_dashboard.io.server import Answer
    from metacontrol_dashboard.ros.reasoner import ReasonerFollower
    from metacontrol_dashboard.state.requests import Request

_REASONER, _MANIPULATOR, _SHADOW = "reasoner", "rosgraph_manipulator", "metacontrol_dashboard"
_ASKED = {"deploy": _MANIPULATOR, "suppose": _SHADOW}
"""Action -> who is asked; the others are for the reasoner."""
_WAIT = 3.0  # s, wall, for a service to be there
_DEADLINES = {_REASONER: 15.0, _MANIPULATOR: 120.0, _SHADOW: 30.0}
"""s, wall, for an answer; the manipulator answers when what it starts is up."""
_MOST_AT_ONCE = 4
"""Requests to one of them that wait for an answer."""
_TRIGGERS = ("pause", "resume", "lock", "unlock")
_ERRORS = (
    *(*SERVICE_FAILURES, client.ClientError),
    *(MapeError, ReasonerError, RecordingError),
)


class Operator:
    """Does what an operator asks for, each request in a thread of its own: whoever is asked may never answer."""

    def __init__(self, follower: ReasonerFollower) -> None:
        """Ask the reasoner and manipulator in the node's namespace.

        Args:
            follower: tells what the reasoner would do.
        """
        self._follower = follower
        self._waiting: dict[str, list[Future[Answer]]] = {}  # by who is asked

    async def act(self, request: Request) -> Answer:
        """Do what is asked for; the answer says how it went, or that nobody has answered in time."""
        asked = _ASKED.get(request.action, _REASONER)
        waiting = [answer for answer in self._waiting.get(asked, ()) if not answer.done()]
        self._waiting[asked] = waiting
        if len(waiting) >= _MOST_AT_ONCE:
            return _refused(f"{asked} has not answered the last {len(waiting)} requests: look at that node")
        answer = in_background(partial(self._act, request), f"operator: {request.action}")
        waiting.append(answer)
        deadline = _DEADLINES[asked]
        await asyncio.wait([asyncio.wrap_future(answer)], timeout=deadline)
        if not answer.done():
            late = f"{asked} has not answered {request.action} within {deadline:g} s"
            return _refused(f"{late}, and may still do it: look at that node")
        try:
            return answer.result()
        except NoThreadError as error:
            return _refused(str(error))

    def _act(self, request: Request) -> Answer:
        if request.action not in ("suppose", "feasible"):
            rospy.loginfo("an operator asks for %s %s", request.action, " ".join(request.texts.values()))
        try:
            return self._do(request)
        except _ERRORS as error:
            return _refused(str(error))

    def _do(self, request: Request) -> Answer:
        texts = request.texts
        if request.action in _TRIGGERS:
            found = _call(request.action, Trigger)
            return {"ok": found.success, "message": found.message}
        kinds: dict[str, Callable[[], Any]] = {
            "approve": lambda: _call("approve", services.ApproveDecision, texts["id"]),
            "reject": lambda: _call("reject", services.ApproveDecision, texts["id"]),
            "set_limit": lambda: _call("set_nfr", services.SetNfr, texts["objective"], texts["quality"], request.value),
        }
        if request.action in kinds:
            found = kinds[request.action]()
            return {"ok": found.ok, "message": found.message}
        if request.action == "deploy":
            answer = client.request(texts["configuration"])
            return {"ok": answer.done, "message": answer.text}
        if request.action == "feasible":
            found = _call("feasible", services.Feasible, "")
            functions = {f.function: {"designs": list(f.designs), "message": f.message} for f in found.functions}
            return {"ok": found.ok, "message": found.message, "functions": functions}
        supposed = self._follower.suppose(rospy.get_time(), request.failed, request.limits)
        decisions = [asdict(decision) for decision in supposed.decisions]
        return {"ok": True, "message": supposed.note, "after": supposed.after, "decisions": decisions}


def _refused(why: str) -> Answer:
    return {"ok": False, "message": " ".join(why.split())}


def _call(name: str, kind: Any, *values: Any) -> Any:
    full = f"{_REASONER}/{name}"
    rospy.wait_for_service(full, _WAIT)
    return rospy.ServiceProxy(full, kind)(*values)
