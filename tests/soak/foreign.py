"""What a stranger does on the mission's master: `python -m soak.foreign WHAT ...`, one process for each fault.

    data PICK HOW SECONDS      publish wrong data on a topic that a node of ours hears
    service PICK HOW           call a service that a node of ours offers
    usurp NAME SECONDS         be a node of that name
    clock SECONDS              publish one message on /clock that is so many s off

It says in one line what it met, and then does it.
"""

from __future__ import annotations

import contextlib
import random
import sys
import threading
import time
from typing import Any

import rosgraph
import roslib.message
import rospy
import rosservice
from rosgraph_msgs.msg import Clock

from soak.plan import NODE, PARTS
from soak.spoiling import AS_IT_IS, can_spoil, differ, example, spoiled
from soak.striking import SAYS

OURS = {f"/{name}" for name in (*PARTS, NODE)}
FLOOD_HZ = 1000.0
_USUAL_HZ = 10.0
_LEFT_OUT = ("/clock", "/rosout", "/rosout_agg", "/tf_static")
"""Wrong words there break the simulator itself; /tf_static is latched: nobody could take it back."""


def main() -> None:
    """Do what the arguments say."""
    what, *arguments = sys.argv[1:]
    name = arguments[0] if what == "usurp" else "soak_stranger"
    rospy.init_node(name, anonymous=what != "usurp", disable_signals=True, log_level=rospy.FATAL)
    {"data": data, "service": service, "usurp": usurp, "clock": clock}[what](*arguments)


def say(text: str) -> None:
    """Tell what is met."""
    print(SAYS + text, flush=True)  # noqa: T201


def data(pick: str, how: str, seconds: str) -> None:
    """Publish wrong data on one of the topics that our nodes hear."""
    master = rosgraph.Master(rospy.get_name())
    _, subscribers, _ = master.getSystemState()
    heard = sorted(topic for topic, nodes in subscribers if OURS & set(nodes) and topic not in _LEFT_OUT)
    types = dict(master.getTopicTypes())
    kinds = {topic: roslib.message.get_message_class(types.get(topic, "")) for topic in heard}
    topic = chosen([one for one in heard if kinds[one] is not None and can_spoil(kinds[one], how)], float(pick))
    kind: Any = kinds[topic]
    message = example(kind)
    with contextlib.suppress(rospy.ROSException):
        heard_now = rospy.wait_for_message(topic, kind, 2.0)
        if how in AS_IT_IS or differ(heard_now, spoiled(heard_now, how, random.Random(pick))):
            message = heard_now
    publisher = rospy.Publisher(topic, kind, queue_size=10)
    _wait(lambda: publisher.get_num_connections() > 0)
    say(f"{topic}, {how}")
    wrong = spoiled(message, how, random.Random(pick))
    period = 1.0 / (FLOOD_HZ if how == "flood" else _USUAL_HZ)
    end = time.monotonic() + float(seconds)
    due = time.monotonic()
    while time.monotonic() < end and not rospy.is_shutdown():
        publisher.publish(wrong)
        due += period
        time.sleep(max(0.0, due - time.monotonic()))


def service(pick: str, how: str) -> None:
    """Call one of the services that our nodes offer."""
    _, _, services = rosgraph.Master(rospy.get_name()).getSystemState()
    offered = sorted(name for name, nodes in services if OURS & set(nodes))
    first = offered.index(chosen(offered, float(pick)))
    found = (one for one in (*offered[first:], *offered[:first]) if _can_ask(one, how))
    name = next(found, None) or chosen([], 0.0)
    kind = rosservice.get_service_class_by_name(name)
    request = spoiled(example(kind._request_class), how, random.Random(pick))
    say(f"{name}, {how}")
    times = 1000 if how == "repeat" else 1

    def call() -> None:
        proxy = rospy.ServiceProxy(name, kind)
        for _ in range(times):
            try:
                proxy(request)
            except (rospy.ServiceException, rospy.ROSException):
                continue

    caller = threading.Thread(target=call, daemon=True)
    caller.start()
    caller.join(5.0)


def _can_ask(name: str, how: str) -> bool:
    """Tell whether a request to a service can be wrong in a way; its node may hang, or have ended just now."""
    try:
        kind = rosservice.get_service_class_by_name(name)
    except rosservice.ROSServiceException:
        return False
    return kind is not None and can_spoil(kind._request_class, how)


def usurp(name: str, seconds: str) -> None:
    """Have a node's name for a while."""
    say(f"/{name}")
    end = time.monotonic() + float(seconds)
    _wait(rospy.is_shutdown, end - time.monotonic())


def clock(seconds: str) -> None:
    """Publish one time that is wrong."""
    publisher = rospy.Publisher("/clock", Clock, queue_size=1)
    _wait(lambda: publisher.get_num_connections() > 5)
    now = rospy.Time.now()
    publisher.publish(Clock(rospy.Time.from_sec(max(0.0, now.to_sec() + float(seconds)))))
    say(f"/clock {seconds} s off at {now.to_sec():.2f} s")
    time.sleep(0.5)


def chosen(names: list[str], pick: float) -> str:
    """Return one of the names, by a number from 0 to 1."""
    if not names:
        say("left out: there is none")
        sys.exit(0)
    return names[min(len(names) - 1, int(pick * len(names)))]


def _wait(condition: Any, longest: float = 3.0) -> None:
    end = time.monotonic() + longest
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)


if __name__ == "__main__":
    main()
