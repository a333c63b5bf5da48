"""ROS shell of what monitor and manipulator said in a bag that is played.

Diagnostics are passed on, but for levels that an observer reports anew. The configurations come later than they were
recorded: they are the answer to decisions, and must not overtake those of the reasoner that runs now.
"""

from __future__ import annotations

import contextlib
import queue
from typing import TYPE_CHECKING, Any

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_msgs.msg import ActiveConfiguration, DiagnosticWords
from node_kit.ros.lifetime import Lifetime

if TYPE_CHECKING:
    from collections.abc import Callable

_QUEUE = 1000  # messages of a bag that is played fast
_ACTIVE = "rosgraph_manipulator/active_configuration"
_LOOK_S = 0.2  # s, wall, until it is seen that somebody has asked the node to end


class _FirstPeer(rospy.SubscribeListener):
    """Calls a function when somebody listens to a topic."""

    def __init__(self, call: Callable[[], None]) -> None:
        self._call: Callable[[], None] | None = call

    def peer_subscribe(self, *_: Any) -> None:
        call, self._call = self._call, None
        if call is not None:
            call()


def main() -> None:
    """Run the node. It listens when somebody listens to it, so a player that waits for listeners waits for all."""
    with Lifetime("recorded_reports") as life:
        life.start()
        observed = frozenset(map(str, rospy.get_param("~observed", [])))
        delay = rospy.Duration(float(rospy.get_param("~delay", 1.5)))
        waiting: queue.Queue[tuple[rospy.Time, ActiveConfiguration]] = queue.Queue()

        def pass_on(message: DiagnosticArray) -> None:
            message.status = [status for status in message.status if _is_kept(status, observed)]
            if message.status:
                diagnostics.publish(message)

        def listen() -> None:
            rospy.Subscriber("recorded/diagnostics", DiagnosticArray, pass_on, queue_size=_QUEUE)

        active = rospy.Publisher(_ACTIVE, ActiveConfiguration, queue_size=_QUEUE, latch=True)
        diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, _FirstPeer(listen), queue_size=_QUEUE)
        rospy.Subscriber(
            "recorded/active_configuration",
            ActiveConfiguration,
            lambda message: waiting.put((rospy.Time.now(), message)),
            queue_size=_QUEUE,
        )
        is_first = True  # what runs when the bag begins
        while not rospy.is_shutdown():
            try:
                received, message = waiting.get(timeout=_LOOK_S)
            except queue.Empty:
                continue
            if not is_first:
                with contextlib.suppress(rospy.ROSTimeMovedBackwardsException):  # the bag is played again
                    rospy.sleep(_left(received, rospy.Time.now(), delay))
            is_first = False
            active.publish(message)


def _left(received: rospy.Time, now: rospy.Time, delay: rospy.Duration) -> rospy.Duration:
    """Return how much is left of a delay; nothing where the clock was set back since."""
    left = received + delay - now
    return left if left <= delay else rospy.Duration()


def _is_kept(status: Any, observed: frozenset[str]) -> bool:
    """Leave the levels of some qualities out of a status; return whether anything is left of it."""
    if status.message not in (DiagnosticWords.QA_STATUS, DiagnosticWords.QA_STALE):
        return True
    status.values = [pair for pair in status.values if pair.key not in observed]
    return bool(status.values)
