"""Time from the SIGKILL of a node, among 60 live ones, to its "Component status" FALSE on /diagnostics."""

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

_KILLS = 50
_BYSTANDERS = 60
_VICTIM = "victim"
_MODEL = "RosSystem { Name 'bench' RosComponents ( ComponentInterface { name 'victim' } ) }"


def run() -> list[dict[str, Any]]:
    """Return the entries `detect_sigkill` (95th percentile) and `detect_sigkill_median`, in s."""
    with stand() as system:
        system.start_nodes(_BYSTANDERS)
        system.start_monitor({"ignore": ["node_*"]}, _MODEL)
        times = system.measure(__file__)
    return [
        entry("detect_sigkill", percentile(times, 0.95), "s", len(times)),
        entry("detect_sigkill_median", percentile(times, 0.5), "s", len(times)),
    ]


def _measure() -> list[float]:
    """Kill the victim again and again; return the times to its diagnostic in s."""
    import rospy  # here, where the process is a node
    from diagnostic_msgs.msg import DiagnosticArray

    told = {state: threading.Event() for state in ("TRUE", "FALSE")}
    told_at = 0.0

    def receive(msg: Any) -> None:
        nonlocal told_at
        now = time.monotonic()
        for status in msg.status:
            if status.name == _VICTIM and status.message == "Component status":
                event = told.get(status.values[0].value)
                if event and not event.is_set():
                    told_at = now
                    event.set()

    rospy.init_node("bench")
    rospy.Subscriber("/diagnostics", DiagnosticArray, receive, tcp_nodelay=True)
    times = []
    for _ in range(_KILLS):
        for event in told.values():
            event.clear()
        victim = subprocess.Popen([sys.executable, "-c", NODE, _VICTIM])
        try:
            if not told["TRUE"].wait(DEADLINE):
                raise RuntimeError("the monitor does not see the victim")
            told["FALSE"].clear()
            begin = time.monotonic()
            victim.send_signal(signal.SIGKILL)
            if not told["FALSE"].wait(DEADLINE):
                raise RuntimeError("the monitor does not see the victim's death")
            times.append(told_at - begin)
        finally:
            victim.kill()
            victim.wait()
    return times


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_measure()) + "\n")
