"""What the monitor's benchmarks share: a master and a monitor of their own, and many live nodes in one process."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

DEADLINE = 40.0
NODES = Path(__file__).with_name("nodes.py")
NAIVE = "one call per node, service and parameter"
NODE = "import rospy, sys; rospy.init_node(sys.argv[1], disable_rosout=True); rospy.spin()"


def entry(name: str, value: float, unit: str, samples: int, peer: str | None = None, peer_value: float | None = None):
    """Return an entry of the results."""
    ratio = peer_value / value if peer_value and value else None
    return {
        "name": name,
        "value": value,
        "unit": unit,
        "peer": peer,
        "peer_value": peer_value,
        "ratio": ratio,
        "samples": samples,
    }


def percentile(values: list[float], share: float) -> float:
    """Return the value below which that share of the values lies."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, round(share * (len(ordered) - 1)))]


class Stand:
    """A master with a monitor, and whatever is started beside it; all of it ends with the stand."""

    def __init__(self, folder: Path, stack: contextlib.ExitStack) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self.folder = folder
        self.uri = f"http://localhost:{port}"
        self.environment = os.environ | {"ROS_MASTER_URI": self.uri, "ROS_LOG_DIR": str(folder)}
        self.environment.pop("ROS_NAMESPACE", None)
        self._stack = stack
        self.proxy: Any = xmlrpc.client.ServerProxy(self.uri)
        self.master = self.start("rosmaster", "--core", "-p", str(port))
        wait_until(self._answers)

    def start(self, *command: str, **options: Any) -> subprocess.Popen[Any]:
        """Start a process."""
        options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **options}
        process = subprocess.Popen(command, env=self.environment, **options)
        self._stack.callback(_end, process)
        return process

    def start_nodes(self, count: int) -> None:
        """Start so many live nodes: registered, each with an API that answers."""
        self.start(sys.executable, str(NODES), self.uri, str(count))
        wait_until(lambda: self._registered(f"/topic_{count - 1}"))

    def start_monitor(self, parameters: dict[str, Any], model: str = "", **options: Any) -> subprocess.Popen[Any]:
        """Start a monitor, with the text of a model to compare with."""
        if model:
            path = self.folder / "bench.rossystem"
            path.write_text(model, encoding="utf-8")
            parameters = parameters | {"desired_rossystem": str(path)}
        self.proxy.setParam("/bench", "/rosgraph_monitor", parameters)
        monitor = self.start("rosrun", "rosgraph_monitor", "monitor", **options)
        wait_until(lambda: self._registered("/rosgraph_manipulator/active_configuration"))
        return monitor

    def measure(self, script: str, *arguments: str) -> Any:
        """Run a module of its own as a process, since a process can be a node only once; return what it prints."""
        done = subprocess.run(
            [sys.executable, script, *arguments],
            env=self.environment,
            stdout=subprocess.PIPE,
            text=True,
            timeout=580,
            check=True,
        )
        return json.loads(done.stdout.splitlines()[-1])

    def _answers(self) -> bool:
        try:
            return self.proxy.getPid("/bench")[0] == 1
        except OSError:
            return False

    def _registered(self, topic: str) -> bool:
        state = self.proxy.getSystemState("/bench")[2]
        return any(topic == name for part in state[:2] for name, _ in part)


def naive_snapshot(uri: str) -> int:
    """Take the graph the way that tools which ask one thing at a time do; return the number of answers."""
    caller, proxy = "/bench", xmlrpc.client.ServerProxy(uri)
    state: Any = proxy.getSystemState(caller)
    names = {node for part in state[2] for _, nodes in part for node in nodes}
    answers = [proxy.lookupNode(caller, name) for name in names]
    answers += [proxy.lookupService(caller, name) for name, _ in state[2][2]]
    answers.append(proxy.getTopicTypes(caller))
    parameters: Any = proxy.getParamNames(caller)
    answers += [proxy.getParam(caller, name) for name in parameters[2]]
    return len(answers)


@contextlib.contextmanager
def stand() -> Iterator[Stand]:
    """Make a stand."""
    with tempfile.TemporaryDirectory(prefix="bench_") as folder, contextlib.ExitStack() as stack:
        yield Stand(Path(folder), stack)


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait for a condition.

    Raises:
        RuntimeError: it is not met in time.
    """
    end = time.monotonic() + DEADLINE
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("the system under measurement did not get ready")
        time.sleep(0.02)


def _end(process: subprocess.Popen[Any]) -> None:
    if process.poll() is None:
        process.terminate()
    try:
        process.wait(timeout=5.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
