"""Time from the SIGKILL of a node to its "Component status" FALSE on /diagnostics, over a monitor at its usual rate."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import xmlrpc.client
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

_KILLS = 20
_BYSTANDERS = 10
_DEADLINE = 15.0
_VICTIM = "victim"
_NODE = "import rospy, sys; rospy.init_node(sys.argv[1], disable_rosout=True); rospy.spin()"
_MODEL = "RosSystem { Name 'bench' RosComponents ( ComponentInterface { name 'victim' } ) }"


def run() -> list[dict[str, Any]]:
    """Return the entry `detect_sigkill`: 95th percentile in s.

    The measurement is a process of its own, since a process can be a ROS node only once.
    """
    with tempfile.TemporaryDirectory(prefix="bench_") as folder:
        environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{_free_port()}", "ROS_LOG_DIR": folder}
        model = Path(folder) / "bench.rossystem"
        model.write_text(_MODEL, encoding="utf-8")
        with _processes(environment, model):
            measured = subprocess.run(
                [sys.executable, __file__], env=environment, stdout=subprocess.PIPE, text=True, timeout=300, check=True
            )
    times = sorted(json.loads(measured.stdout.splitlines()[-1]))
    return [
        {
            "name": "detect_sigkill",
            "value": times[min(len(times) - 1, round(0.95 * len(times)))],
            "unit": "s",
            "peer": None,
            "peer_value": None,
            "ratio": None,
            "samples": len(times),
        }
    ]


@contextlib.contextmanager
def _processes(environment: dict[str, str], model: Path) -> Iterator[None]:
    """Run master, monitor and nodes that nobody kills."""
    uri = environment["ROS_MASTER_URI"]
    with contextlib.ExitStack() as stack:

        def start(*command: str) -> None:
            process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            stack.callback(_end, process)

        start("rosmaster", "--core", "-p", uri.rpartition(":")[2])
        proxy = xmlrpc.client.ServerProxy(uri)
        _wait(lambda: proxy.getPid("/bench"))
        proxy.setParam("/bench", "/rosgraph_monitor", {"desired_rossystem": str(model)})
        start("rosrun", "rosgraph_monitor", "monitor")
        for i in range(_BYSTANDERS):
            start(sys.executable, "-c", _NODE, f"bystander_{i}")
        yield


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
        victim = subprocess.Popen([sys.executable, "-c", _NODE, _VICTIM])
        try:
            if not told["TRUE"].wait(_DEADLINE):
                raise RuntimeError("the monitor does not see the victim")
            told["FALSE"].clear()
            begin = time.monotonic()
            victim.send_signal(signal.SIGKILL)
            if not told["FALSE"].wait(_DEADLINE):
                raise RuntimeError("the monitor does not see the victim's death")
            times.append(told_at - begin)
        finally:
            victim.kill()
            victim.wait()
    return times


def _wait(call: Any) -> None:
    end = time.monotonic() + _DEADLINE
    while True:
        try:
            call()
            return
        except OSError:
            if time.monotonic() > end:
                raise
            time.sleep(0.05)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


if __name__ == "__main__":
    sys.stdout.write(json.dumps(_measure()) + "\n")
