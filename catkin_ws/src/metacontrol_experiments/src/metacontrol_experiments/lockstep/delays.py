"""How long detection, decision and reconfiguration take on ROS: samples measured there, and draws from them.

The samples are in config/delays.csv, a line each: which delay, seconds. `metacontrol delays` makes it from summaries.
"""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rospkg

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

KINDS = ("detect", "decide", "restart", "parameters")
"""From the kill of a node to its diagnostic; from there to the decision; from there to the end of a reconfiguration
that starts navigation anew, or that changes its parameters while it runs."""


class DelayError(ValueError):
    """Delays cannot be read or made; the message names file and remedy."""


class Delays:
    """Samples of each kind (s), to draw from."""

    def __init__(self, samples: Mapping[str, Iterable[float]]) -> None:
        """Keep them in order."""
        self._samples = {kind: np.sort(np.array(list(samples[kind]))) for kind in KINDS}

    def draw(self, kind: str, rng: np.random.Generator) -> float:
        """Return a time in s from the distribution of the samples, linear between neighbours."""
        return float(np.quantile(self._samples[kind], rng.random()))


def read_delays(path: Path | None = None) -> Delays:
    """Read a file of delays, by default the one of this package.

    Raises:
        DelayError: it cannot be read, or a kind has no sample.
    """
    path = path or Path(rospkg.RosPack().get_path("metacontrol_experiments")) / "config" / "delays.csv"
    samples: defaultdict[str, list[float]] = defaultdict(list)
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                samples[row["delay"]].append(float(row["seconds"]))
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise DelayError(f"{path}: no table of delay and seconds ({error}); make one by: metacontrol delays") from error
    lacking = [kind for kind in KINDS if not samples[kind]]
    if lacking or not all(math.isfinite(value) and value >= 0.0 for values in samples.values() for value in values):
        raise DelayError(f"{path}: times below 0, or none of {', '.join(lacking)}; make it anew by: metacontrol delays")
    return Delays(samples)


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


def write_delays(path: Path, found: Iterable[tuple[str, float]]) -> None:
    """Write a file of delays, in the order of kind and time."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["delay", "seconds"])
        writer.writerows(
            (kind, f"{value:.4f}") for kind, value in sorted(found, key=lambda d: (KINDS.index(d[0]), d[1]))
        )
