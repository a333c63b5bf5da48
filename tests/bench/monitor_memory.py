"""Memory of the monitor over 10,000 ticks, at a rate at which they take minutes and not hours."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from typing import Any

import psutil
from support.figures import entry
from support.stand import NODE, stand

_TICKS = 10000
_WARM_UP = 1000
_RATE = 100.0
_NODES = 10
_LOOKS = "rosgraph_monitor: look at the graph"
_MEGABYTE = 1024 * 1024


def run() -> list[dict[str, Any]]:
    """Return `monitor_memory_growth` (MB, over 10,000 ticks after the first 1,000) and `monitor_memory` (MB)."""
    names = [f"node_{i}" for i in range(_NODES)] + ["victim"]
    components = ", ".join(f"ComponentInterface {{ name {name} }}" for name in names)
    with stand() as system:
        system.start_nodes(_NODES)
        parameters = {"rate": _RATE, "startup_grace": 1.0, "ignore": ["bench"]}
        monitor = system.start_monitor(parameters, f"RosSystem {{ Name 'bench' RosComponents ( {components} ) }}")
        before, after, ticks = system.measure(__file__, str(monitor.pid))
    return [
        entry("monitor_memory_growth", after - before, "MB", ticks),
        entry("monitor_memory", after, "MB", ticks),
    ]


def _measure(pid: int) -> tuple[float, float, int]:
    """Let ticks pass, as the monitor counts them, with a node that comes and dies all the time."""
    import rospy  # here, where the process is a node
    from diagnostic_msgs.msg import DiagnosticArray

    looks = [0]

    def receive(msg: Any) -> None:
        for status in msg.status:
            if status.name == _LOOKS:
                looks[0] = next((int(v.value) for v in status.values if v.key == "looks"), looks[0])

    def let_pass(until: int) -> float:
        while looks[0] < until:
            victim = subprocess.Popen([sys.executable, "-c", NODE, "victim"])
            time.sleep(2.0)
            victim.kill()
            victim.wait()
        return monitor.memory_info().rss / _MEGABYTE

    rospy.init_node("bench")
    rospy.Subscriber("/diagnostics", DiagnosticArray, receive)
    monitor = psutil.Process(pid)
    before = let_pass(_WARM_UP)
    begin = looks[0]
    after = let_pass(begin + _TICKS)
    return before, after, looks[0] - begin


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_measure(int(sys.argv[1]))) + "\n")
