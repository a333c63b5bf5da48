"""Time of a snapshot of 300 live nodes, beside one that asks for every node, service and parameter by itself."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, Any

from ros_model.io.master import MasterClient
from support.figures import entry, seconds
from support.stand import NAIVE, naive_snapshot, stand

if TYPE_CHECKING:
    from collections.abc import Callable

_NODES = 300
_SAMPLES = 30
_PEER_SAMPLES = 5


def run() -> list[dict[str, Any]]:
    """Return the entry `snapshot_300`: medians in s."""
    with stand() as system:
        system.start_nodes(_NODES)
        client = MasterClient(system.uri)
        if len(client.snapshot().nodes) < _NODES:
            raise RuntimeError("the master does not list the nodes that were registered")
        ours = _median(client.snapshot, _SAMPLES)
        peer = _median(lambda: naive_snapshot(system.uri), _PEER_SAMPLES)
        client.close()
    return [entry("snapshot_300", ours, "s", _SAMPLES, NAIVE, peer)]


def _median(function: Callable[[], object], samples: int) -> float:
    return statistics.median(seconds(function) for _ in range(samples))
