"""The node reasoner with D2's model, alone with a master: time until it is ready, idle load, memory with its child."""

from __future__ import annotations

import statistics
import sys
import time
from pathlib import Path
from typing import Any

import psutil
from support.figures import entry
from support.stand import end, stand, wait_until

_PACKAGES = Path(__file__).parents[2] / "catkin_ws" / "src"
_NODE = _PACKAGES / "mros1_reasoner" / "nodes" / "reasoner"
_MODEL = _PACKAGES / "metacontrol_sim" / "models" / "d2.owl"
_ARGUMENTS = (f"_model_file:={_MODEL}", "_nfr_safety:=0.6", "_use_reconfigure_srv:=false")  # so that one runs
_LAST = "/reasoner/save_knowledge_base"  # what the node offers last, when it listens to all else
_STARTS = 5
_IDLE_S = 20.0


def run() -> list[dict[str, Any]]:
    """Return `reasoner_ready` in s, `reasoner_idle_cpu` in % of a core, `reasoner_memory` in MB; the same by rules."""
    return [*_measure("reasoner"), *_measure("reasoner_rules", "_reasoner:=rules")]


def _measure(name: str, *arguments: str) -> list[dict[str, Any]]:
    ready = []
    with stand() as system:
        for number in range(_STARTS):
            began = time.monotonic()
            process = system.start(sys.executable, str(_NODE), *_ARGUMENTS, *arguments)
            wait_until(lambda: system.ask_master("lookupService", _LAST) is not None)
            ready.append(time.monotonic() - began)
            if number == _STARTS - 1:
                idle, memory = _idle(psutil.Process(process.pid))
            end(process)
            wait_until(lambda: system.ask_master("lookupService", _LAST) is None)
    return [
        entry(f"{name}_ready", statistics.median(ready), "s", _STARTS),
        entry(f"{name}_idle_cpu", idle, "% of a core", 1),
        entry(f"{name}_memory", memory, "MB", 1),
    ]


def _idle(process: psutil.Process) -> tuple[float, float]:
    """Return the load in % of a core while nothing happens, and the resident memory in MB, both with children."""
    family = [process, *process.children(recursive=True)]
    before = [sum(member.cpu_times()[:2]) for member in family]
    time.sleep(_IDLE_S)
    after = [sum(member.cpu_times()[:2]) for member in family]
    memory = sum(member.memory_info().rss for member in family)
    return 100 * (sum(after) - sum(before)) / _IDLE_S, memory / 1e6
