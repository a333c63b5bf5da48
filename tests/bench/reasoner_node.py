"""The node reasoner with D2's model, alone with a master: time until it is ready, idle load, memory with its child."""

from __future__ import annotations

import contextlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
from metacontrol_experiments.processes import free_port, wait_until

_PACKAGES = Path(__file__).parents[2] / "catkin_ws" / "src"
_NODE = _PACKAGES / "mros1_reasoner" / "nodes" / "reasoner"
_MODEL = _PACKAGES / "metacontrol_sim" / "models" / "d2.owl"
_LAST = "/reasoner/save_knowledge_base"  # what the node offers last, when it listens to all else
_STARTS = 5
_IDLE_S = 20.0
_DEADLINE_S = 60.0


def run() -> list[dict[str, Any]]:
    """Return `reasoner_ready` in s, `reasoner_idle_cpu` in % of a core and `reasoner_memory` in MB."""
    ready = []
    with _master() as (uri, environment):
        for number in range(_STARTS):
            with _reasoner(uri, environment) as (process, took):
                ready.append(took)
                if number == _STARTS - 1:
                    idle, memory = _idle(process)
    return [
        _entry("reasoner_ready", statistics.median(ready), "s", _STARTS),
        _entry("reasoner_idle_cpu", idle, "% of a core", 1),
        _entry("reasoner_memory", memory, "MB", 1),
    ]


def _entry(name: str, value: float, unit: str, samples: int) -> dict[str, Any]:
    nothing = dict.fromkeys(("peer", "peer_value", "ratio"))
    return {"name": name, "value": value, "unit": unit, **nothing, "samples": samples}


@contextlib.contextmanager
def _master() -> Iterator[tuple[str, dict[str, str]]]:
    uri = f"http://localhost:{(port := free_port())}"
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "ROS_MASTER_URI": uri, "ROS_LOG_DIR": folder, "ROS_HOME": folder}
        with _process(["rosmaster", "--core", "-p", str(port)], environment):
            if not wait_until(lambda: _answer(uri, "getPid") is not None, _DEADLINE_S):
                raise RuntimeError("the master did not come up")
            yield uri, environment


@contextlib.contextmanager
def _reasoner(uri: str, environment: dict[str, str]) -> Iterator[tuple[psutil.Process, float]]:
    """Start a reasoner; yield it and how long it took to be ready, s."""
    began = time.monotonic()
    arguments = [f"_model_file:={_MODEL}", "_nfr_safety:=0.6", "_use_reconfigure_srv:=false"]  # so that one runs
    with _process([sys.executable, str(_NODE), *arguments], environment) as process:
        if not wait_until(lambda: _answer(uri, "lookupService", _LAST) is not None, _DEADLINE_S):
            raise RuntimeError("the reasoner did not come up")
        yield psutil.Process(process.pid), time.monotonic() - began
    wait_until(lambda: _answer(uri, "lookupService", _LAST) is None, _DEADLINE_S)


@contextlib.contextmanager
def _process(command: list[str], environment: dict[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(_DEADLINE_S)


def _answer(uri: str, call: str, *arguments: str) -> Any:
    """Return what the master answers, None where it refuses or is not there."""
    try:
        with xmlrpc.client.ServerProxy(uri) as master:
            code, _, value = getattr(master, call)("/bench", *arguments)
    except OSError:
        return None
    return value if code == 1 else None


def _idle(process: psutil.Process) -> tuple[float, float]:
    """Return the load in % of a core while nothing happens, and the resident memory in MB, both with children."""
    family = [process, *process.children(recursive=True)]
    before = [sum(member.cpu_times()[:2]) for member in family]
    time.sleep(_IDLE_S)
    after = [sum(member.cpu_times()[:2]) for member in family]
    memory = sum(member.memory_info().rss for member in family)
    return 100 * (sum(after) - sum(before)) / _IDLE_S, memory / 1e6
