"""The single-run pair as the paper has it: the baseline above, ours below, both levels over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from metacontrol_bags.metrics import DEFAULT_THRESHOLDS

from metacontrol_experiments.report.drawing import CHANGE, OBSERVED, SHADE, new_figure
from metacontrol_experiments.report.missions import BASELINE, OURS, QUALITIES
from metacontrol_experiments.report.text import count

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from metacontrol_experiments.report.missions import Mission
    from metacontrol_experiments.report.pair import Series

_NAMES = {BASELINE: "baseline", OURS: "meta-controller"}


def draw_pair(pair: Sequence[tuple[Mission, Series]]) -> Figure:
    """Draw missions below each other, over the same time.

    Args:
        pair: missions with their series.
    """
    figure = new_figure(2.7 * len(pair) + 0.6)
    axes = figure.subplots(len(pair), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (mission, series) in zip(axes, pair, strict=True):
        _draw(axis, mission, series)
    axes[-1].set_xlabel("time since the start of the mission, s")
    axes[-1].set_xlim(0.0, max(series.end for _, series in pair))
    shown: dict[str, Artist] = {}
    for axis in axes:
        handles, labels = axis.get_legend_handles_labels()
        shown |= dict(zip(labels, handles, strict=True))
    figure.legend(list(shown.values()), list(shown), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _draw(axis: Axes, mission: Mission, series: Series) -> None:
    limits = {**DEFAULT_THRESHOLDS, **mission.summary.get("thresholds", {})}
    if series.disturbed_from is not None:
        axis.axvspan(series.disturbed_from, series.end, color=SHADE, alpha=0.2, linewidth=0.0, label="contingency")
    for begin, until, name in series.changes:
        axis.axvspan(begin, until, color=CHANGE, alpha=0.8, linewidth=1.0, zorder=0, label="reconfiguration")
        axis.annotate(name, (until, 1.0), xytext=(3, -2), textcoords="offset points", fontsize=8, va="top", rotation=90)
    for quality in QUALITIES:
        held = [*series.levels[quality], series.levels[quality][-1]]
        colour, width = OBSERVED[quality], 1.6 if quality == "energy" else 1.2
        told = f"{quality} risk" if quality == "safety" else quality
        axis.step([*series.stamps, series.end], held, where="post", color=colour, linewidth=width, label=told)
        axis.axhline(limits[quality], color=colour, linestyle="--", linewidth=1.0, label=f"{quality} threshold")
    axis.axvline(series.end, color="black", linewidth=1.0)
    axis.set_ylim(-0.03, 1.05)
    axis.set_ylabel("level")
    axis.set_title(_title(mission), fontsize=10)
    axis.grid(alpha=0.3)


def _title(mission: Mission) -> str:
    shares = [
        f"{quality} {100.0 * share:.1f} %" for quality in QUALITIES if (share := mission.above(quality)) is not None
    ]
    changes = len(mission.summary.get("reconfigurations", ()))
    name, figures = _NAMES.get(mission.manager, mission.manager), mission.figures
    return (
        f"{name}: {figures['outcome']} after {figures['duration_s']:.1f} s, "
        f"above the thresholds {', '.join(shares)} of the time, {count(changes, 'reconfiguration')}"
    )
