"""Listens to topics for a while, to see which of them are periodic."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import partial

import rospy
from node_kit.ros import command

_LOOK_PERIOD = 0.05  # s, wall


def listen(topics: Iterable[str], duration: float) -> dict[str, tuple[float, ...]]:
    """Return when messages came on topics, s of ROS time.

    Args:
        topics: their resolved names.
        duration: for so long, s of wall time.

    Raises:
        CallError: the master does not answer.
    """
    command.join("doctor")
    found: dict[str, list[float]] = {topic: [] for topic in topics}
    subscribers = [
        rospy.Subscriber(topic, rospy.AnyMsg, partial(_note, arrivals), tcp_nodelay=True)
        for topic, arrivals in found.items()
    ]
    deadline = time.monotonic() + duration
    while time.monotonic() < deadline and not rospy.is_shutdown():
        time.sleep(_LOOK_PERIOD)
    for subscriber in subscribers:
        subscriber.unregister()
    return {topic: tuple(arrivals) for topic, arrivals in found.items()}


def _note(arrivals: list[float], _message: rospy.AnyMsg) -> None:
    arrivals.append(rospy.get_time())
