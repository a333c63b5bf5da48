"""A master of its own for the benchmarks of single nodes, with a monitor or many live nodes beside it."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from pathlib import Path
from typing import TYPE_CHECKING, Any

from helpers.ports import free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

DEADLINE = 40.0
NODES = Path(__file__).with_name("nodes.py")
NAIVE = "one call per node, service and parameter"
NODE = "import rospy, sys; rospy.init_node(sys.argv[1], disable_rosout=True); rospy.spin()"


class Stand:
    """A master with a monitor, and whatever is started beside it; all of it ends with the stand."""

    def __init__(self, folder: Path, stack: contextlib.ExitStack) -> None:
        port = free_port()
        self.folder = folder
        self.uri = f"http://localhost:{port}"
        self.environment = os.environ | {
            "ROS_MASTER_URI": self.uri,
            "ROS_LOG_DIR": str(folder),
            "ROS_HOME": str(folder),
        }
        self.environment.pop("ROS_NAMESPACE", None)
        self._stack = stack
        self.proxy: Any = xmlrpc.client.ServerProxy(self.uri)
        self.master = self.start("rosmaster", "--core", "-p", str(port))
        wait_until(lambda: self.ask_master("getPid") is not None)

    def start(self, *command: str, **options: Any) -> subprocess.Popen[Any]:
        """Start a process."""
        options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **options}
        process = subprocess.Popen(command, env=self.environment, **options)
        self._stack.callback(end, process)
        return process

    def ask_master(self, call: str, *arguments: str) -> Any:
        """Return what the master answers, None where it refuses or is not there."""
        try:
            code, _, value = getattr(self.proxy, call)("/bench", *arguments)
        except OSError:
            return None
        return value if code == 1 else None

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

    def _registered(self, topic: str) -> bool:
        state = self.ask_master("getSystemState")
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


def end(process: subprocess.Popen[Any]) -> None:
    """End a process, by force where it does not within seconds."""
    if process.poll() is None:
        process.terminate()
    try:
        process.wait(timeout=10.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
