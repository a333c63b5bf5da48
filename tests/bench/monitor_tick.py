"""Cost of the monitor beside 300 live nodes that it compares with a model: time of a tick, share of a core."""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

import psutil
from support.figures import entry, percentile
from support.stand import NAIVE, naive_snapshot, stand

_NODES = 300
_SECONDS = 20.0
_LOOKS = "rosgraph_monitor: look at the graph"


def run() -> list[dict[str, Any]]:
    """Return the entries `monitor_tick_300` (s) and `monitor_cpu_300` (% of a core), at 2 Hz."""
    with stand() as system:
        system.start_nodes(_NODES)
        monitor = system.start_monitor({"startup_grace": 2.0}, _model())
        measured = system.measure(__file__, str(monitor.pid))
    if measured["problems"]:
        raise RuntimeError(f"the graph is not as the model has it: {measured['problems']}")
    ticks = measured["ticks"]
    return [
        entry("monitor_tick_300", percentile(ticks, 0.5), "s", len(ticks), NAIVE, measured["naive_s"]),
        entry("monitor_cpu_300", measured["cpu"], "% of a core", len(ticks), NAIVE, measured["naive_cpu"]),
    ]


def _model() -> str:
    components = []
    connections = []
    for i in range(_NODES):
        reference = f"p.a.node_{i}"
        listens = f"RosSubscribers {{ RosSubscriber 'topic_{i - 1}' {{ RefSubscriber '{reference}.topic_{i - 1}' }} }}"
        parameters = ", ".join(
            f"RosParameter 'p{k}' {{ RefParameter '{reference}.parameter_{k}' value {0.5 * k} }}" for k in range(2)
        )
        components.append(
            f"ComponentInterface {{ name node_{i} "
            f"RosPublishers {{ RosPublisher 'topic_{i}' {{ RefPublisher '{reference}.topic_{i}' }} }} "
            f"{listens if i else ''} RosParameters {{ {parameters} }} }}"
        )
        if i:
            connections.append(
                f"TopicConnection 'topic_{i - 1}' {{ From ( 'node_{i - 1}.topic_{i - 1}' ) "
                f"To ( 'node_{i}.topic_{i - 1}' ) }}"
            )
    parts = ", ".join(components), ", ".join(connections)
    return f"RosSystem {{ Name 'bench' RosComponents ( {parts[0]} ) TopicConnections {{ {parts[1]} }} }}"


def _measure(pid: int) -> dict[str, Any]:
    import rospy  # here, where the process is a node
    from diagnostic_msgs.msg import DiagnosticArray

    ready = threading.Event()
    ticks: list[float] = []
    problems: set[str] = set()

    def receive(msg: Any) -> None:
        for status in msg.status:
            if status.message == "running OK":
                ready.set()
            if not ready.is_set():
                continue
            if status.name == _LOOKS and status.values:
                values = {value.key: value.value for value in status.values}
                ticks.append(float(values["seconds for a look"]) + float(values["seconds for an evaluation"]))
            elif status.level and status.name not in ("bench", "rosgraph_monitor"):
                problems.add(f"{status.name}: {status.message}")

    rospy.init_node("rostopic_bench")
    rospy.Subscriber("/diagnostics", DiagnosticArray, receive, buff_size=1 << 24)
    if not ready.wait(60.0):
        raise RuntimeError("the monitor never says that the graph is as desired")
    time.sleep(2.0)
    ticks.clear()
    monitor = psutil.Process(pid)
    before, begin = _cpu(monitor), time.monotonic()
    time.sleep(_SECONDS)
    cpu = 100.0 * (_cpu(monitor) - before) / (time.monotonic() - begin)
    naive_s, naive_cpu = _naive(rospy.get_master().getUri()[2])
    return {"ticks": ticks, "cpu": cpu, "problems": sorted(problems), "naive_s": naive_s, "naive_cpu": naive_cpu}


def _naive(uri: str) -> tuple[float, float]:
    """Measure a naive snapshot: wall s, and % of a core of this side at 2 Hz."""
    begin, cpu = time.monotonic(), time.thread_time()
    naive_snapshot(uri)
    return time.monotonic() - begin, 200.0 * (time.thread_time() - cpu)


def _cpu(process: psutil.Process) -> float:
    times = process.cpu_times()
    return times.user + times.system


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_measure(int(sys.argv[1]))) + "\n")
