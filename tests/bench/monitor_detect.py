"""Times to the diagnostic of a topic that falls silent, a parameter that drifts, a master that is lost."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from typing import Any

from support.figures import entry, percentile
from support.stand import DEADLINE, NODE, stand

_SAMPLES = 20
_LOSSES = 5
_MAX_AGE = 0.5
_MODEL = (
    "RosSystem { Name 'bench' RosComponents ( ComponentInterface { name 'tuned' RosParameters { "
    "RosParameter 'speed' { RefParameter 'p.a.tuned.speed' value 0.5 } } } ) }"
)


def run() -> list[dict[str, Any]]:
    """Return the times in s: 95th percentiles, that of the topic beyond its max_age, and the worst of the master's."""
    with stand() as system:
        system.proxy.setParam("/bench", "/tuned/speed", 0.5)
        system.start(sys.executable, "-c", NODE, "tuned")
        system.start_monitor({"topics": {"data": {"max_age": _MAX_AGE}}, "ignore": ["bench"]}, _MODEL)
        measured = system.measure(__file__)
    losses = [_master_loss() for _ in range(_LOSSES)]
    return [
        entry("topic_silence_after_max_age", percentile(measured["silence"], 0.95) - _MAX_AGE, "s", _SAMPLES),
        entry("parameter_drift", percentile(measured["drift"], 0.95), "s", _SAMPLES),
        entry("master_loss_line", max(said for said, _ in losses), "s", _LOSSES),
        entry("master_loss_end", max(ended for _, ended in losses), "s", _LOSSES),
    ]


def _master_loss() -> tuple[float, float]:
    """Kill a master; return the times to the monitor's line and to its end."""
    with stand() as system:
        monitor = system.start_monitor({}, stderr=subprocess.PIPE, text=True)
        begin = time.monotonic()
        system.master.send_signal(signal.SIGKILL)
        line = monitor.stderr.readline()
        said = time.monotonic() - begin
        if "is gone" not in line or monitor.wait(timeout=DEADLINE):
            raise RuntimeError(f"the monitor does not end as it should: {line}")
        return said, time.monotonic() - begin


def _measure() -> dict[str, list[float]]:
    import rospy  # here, where the process is a node
    from diagnostic_msgs.msg import DiagnosticArray
    from std_msgs.msg import Int32

    told_at: dict[str, float] = {}
    changed = threading.Condition()

    def receive(msg: Any) -> None:
        with changed:
            for status in msg.status:
                told_at.setdefault(status.message, time.monotonic())
            changed.notify_all()

    def wait(message: str) -> float:
        with changed:
            if not changed.wait_for(lambda: message in told_at, DEADLINE):
                raise RuntimeError(f"the monitor never says {message!r}")
            return told_at[message]

    def forget() -> None:
        with changed:
            told_at.clear()

    rospy.init_node("bench")
    rospy.Subscriber("/diagnostics", DiagnosticArray, receive, tcp_nodelay=True)
    publisher = rospy.Publisher("data", Int32, queue_size=1, tcp_nodelay=True)
    silences, drifts = [], []
    for i in range(_SAMPLES):
        forget()
        while "running OK" not in told_at:
            publisher.publish(Int32(i))
            last = time.monotonic()
            time.sleep(0.05)
        forget()
        publisher.publish(Int32(i))
        last = time.monotonic()
        silences.append(wait("Silent topic") - last)
    ended = threading.Event()
    keeper = threading.Thread(target=lambda: [publisher.publish(Int32(0)) for _ in iter(lambda: ended.wait(0.1), True)])
    keeper.start()
    for i in range(_SAMPLES):
        forget()
        wait("running OK")
        time.sleep(0.5 * i / _SAMPLES)  # at any moment of a tick
        forget()
        begin = time.monotonic()
        rospy.set_param("/tuned/speed", 0.9)
        drifts.append(wait("Wrong param configuration") - begin)
        rospy.set_param("/tuned/speed", 0.5)
    ended.set()
    keeper.join()
    return {"silence": silences, "drift": drifts}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_measure()) + "\n")
