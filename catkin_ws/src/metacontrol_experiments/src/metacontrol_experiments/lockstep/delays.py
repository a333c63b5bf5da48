"""How long detection, decision and reconfiguration take on ROS: samples measured there, and draws from them.

`metacontrol delays` collects the samples from summaries of missions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from node_kit.one_line import OneLineError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

KINDS = ("detect", "decide", "restart", "parameters")
"""From the kill of a node to its diagnostic; from there to the decision; from there to the end of a reconfiguration
that starts navigation anew, or that changes its parameters while it runs."""


class DelayError(OneLineError, ValueError):
    """Delays cannot be read or made; the message names file and remedy."""


class Delays:
    """Samples of each kind (s), to draw from."""

    def __init__(self, samples: Mapping[str, Iterable[float]]) -> None:
        """Keep them in order."""
        self._samples = {kind: np.sort(np.array(list(samples[kind]))) for kind in KINDS}

    def draw(self, kind: str, rng: np.random.Generator) -> float:
        """Return a time in s from the distribution of the samples, linear between neighbours."""
        return float(np.quantile(self._samples[kind], rng.random()))


def delays_of(summary: Mapping[str, Any], restarts: Callable[[str, str], bool]) -> Iterator[tuple[str, float]]:
    """Yield the delays that a mission's summary tells.

    Only failures of components tell of detection and decision: those of a level wait for the level to persist.

    Args:
        summary: of a mission on ROS at real-time factor 1.
        restarts: tells whether the way from one configuration to another restarts nodes.
    """
    for change in summary["reconfigurations"]:
        if change["trigger"].startswith("component:"):
            yield from ((kind, change[f"{kind}_s"]) for kind in ("detect", "decide") if change[f"{kind}_s"] is not None)
        if change["execute_s"] is not None:
            yield ("restart" if restarts(change["from"], change["to"]) else "parameters"), change["execute_s"]
