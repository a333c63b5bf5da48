"""Time of a snapshot of 300 registered nodes, beside one that asks for every node, topic and parameter by itself."""

from __future__ import annotations

import contextlib
import os
import socket
import statistics
import subprocess
import time
import xmlrpc.client
from typing import TYPE_CHECKING, Any

from ros_model.snapshot import MasterClient

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_NODES = 300
_PARAMETERS_PER_NODE = 2
_SAMPLES = 30
_PEER_SAMPLES = 5
_CALLER = "/bench"


def run() -> list[dict[str, Any]]:
    """Return the entry `snapshot_300`: medians in s."""
    with _master() as uri:
        proxy = xmlrpc.client.ServerProxy(uri)
        _register(proxy)
        client = MasterClient(uri)
        if len(client.snapshot().nodes) < _NODES:
            raise RuntimeError("the master does not list the nodes that were registered")
        ours = _median(client.snapshot, _SAMPLES)
        peer = _median(lambda: _naive_snapshot(proxy), _PEER_SAMPLES)
        client.close()
    return [
        {
            "name": "snapshot_300",
            "value": ours,
            "unit": "s",
            "peer": "one call per node, service and parameter",
            "peer_value": peer,
            "ratio": peer / ours,
            "samples": _SAMPLES,
        }
    ]


def _naive_snapshot(proxy: xmlrpc.client.ServerProxy) -> int:
    """Take the graph the way that tools which ask one thing at a time do; returns the number of answers."""
    state: Any = proxy.getSystemState(_CALLER)
    names = {node for part in state[2] for _, nodes in part for node in nodes}
    answers = [proxy.lookupNode(_CALLER, name) for name in names]
    answers += [proxy.lookupService(_CALLER, name) for name, _ in state[2][2]]
    answers.append(proxy.getTopicTypes(_CALLER))
    parameters: Any = proxy.getParamNames(_CALLER)
    answers += [proxy.getParam(_CALLER, name) for name in parameters[2]]
    return len(answers)


def _register(proxy: xmlrpc.client.ServerProxy) -> None:
    """Register nodes like a running system's: a publisher, a subscriber, two logger services, /rosout."""
    for i in range(_NODES):
        name, api = f"/node_{i}", f"http://localhost:{20000 + i}/"
        proxy.registerPublisher(name, "/rosout", "rosgraph_msgs/Log", api)
        proxy.registerPublisher(name, f"/topic_{i}", "std_msgs/Float64", api)
        # A chain: each listens to its predecessor. Nobody answers at these addresses, so the order avoids updates.
        proxy.registerSubscriber(name, f"/topic_{i - 1}", "std_msgs/Float64", api)
        for service in ("get_loggers", "set_logger_level"):
            proxy.registerService(name, f"{name}/{service}", f"rosrpc://localhost:{40000 + i}", api)
        proxy.setParam(name, name, {f"parameter_{k}": 0.5 * k for k in range(_PARAMETERS_PER_NODE)})


def _median(function: Callable[[], object], samples: int) -> float:
    times = []
    for _ in range(samples):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


@contextlib.contextmanager
def _master() -> Iterator[str]:
    """Run a master of our own on a free port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    uri = f"http://localhost:{port}"
    master = subprocess.Popen(
        ["rosmaster", "--core", "-p", str(port)],
        env={**os.environ, "ROS_MASTER_URI": uri},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        deadline = time.monotonic() + 15.0
        proxy = xmlrpc.client.ServerProxy(uri)
        while True:
            try:
                proxy.getPid(_CALLER)
                break
            except OSError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.05)
        yield uri
    finally:
        master.terminate()
        try:
            master.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            master.kill()
            master.wait()
