"""What an operator asks of the reasoner and of the manipulator, by their services and actions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

import rospy
from metacontrol_msgs import srv as services
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.readable_state import MapeError
from mros1_reasoner.replay.recording import RecordingError
from rosgraph_manipulator.ros import client
from std_srvs.srv import Trigger

if TYPE_CHECKING:
    from metacontrol_dashboard.io.server import Answer
    from metacontrol_dashboard.ros.reasoner import ReasonerFollower
    from metacontrol_dashboard.state.requests import Request

_REASONER = "reasoner"
_WAIT = 3.0  # s, wall, for a service to be there
_MOST_AT_ONCE = 4
_TRIGGERS = ("pause", "resume", "lock", "unlock")
_ERRORS = (
    *(OSError, rospy.ROSException, rospy.ServiceException, client.ClientError),
    *(MapeError, ReasonerError, RecordingError),
)


class Operator:
    """Does what an operator asks for, in threads of its own: a service may take long."""

    def __init__(self, follower: ReasonerFollower) -> None:
        """Ask the reasoner and manipulator in the node's namespace.

        Args:
            follower: tells what the reasoner would do.
        """
        self._follower = follower
        self._threads = ThreadPoolExecutor(_MOST_AT_ONCE, thread_name_prefix="operator")

    async def act(self, request: Request) -> Answer:
        """Do what is asked for; the answer says how it went."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, partial(self._act, request))

    def _act(self, request: Request) -> Answer:
        if request.action not in ("suppose", "feasible"):
            rospy.loginfo("an operator asks for %s %s", request.action, " ".join(request.texts.values()))
        try:
            return self._do(request)
        except _ERRORS as error:
            return {"ok": False, "message": " ".join(str(error).split())}

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


def _call(name: str, kind: Any, *values: Any) -> Any:
    full = f"{_REASONER}/{name}"
    rospy.wait_for_service(full, _WAIT)
    return rospy.ServiceProxy(full, kind)(*values)
