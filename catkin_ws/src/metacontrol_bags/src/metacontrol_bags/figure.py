"""Draw a mission: the map with the path coloured by configuration, both quality series, and what else was observed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib as mpl

from metacontrol_bags.words import FunctionGrounding, MissionEvent

mpl.use("Agg")

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from metacontrol_bags.metrics import summarise

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from metacontrol_bags.record import MissionRecord

_DPI = 160
_SIZE_INCH = (10.0, 12.5)
"""1600 x 2000 pixels."""

_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#17becf", "#bcbd22")
_FAILURE = "#d62728"
_MARGIN_M = 0.6
_MOST_OTHERS = 3
"""More series would leave no room for the map."""


def draw(record: MissionRecord, path: Path) -> None:
    """Draw a mission into a file: SVG if it is called so, else PNG of 1600 x 2000 pixels.

    Raises:
        MetricsError: an event of the record has impossible content.
        OSError: the file cannot be written.
    """
    summary = summarise(record)
    figure = Figure(figsize=_SIZE_INCH, dpi=_DPI, layout="constrained")
    others = others_observed(record)[:_MOST_OTHERS]
    axes = figure.subplots(3 + len(others), 1, height_ratios=(3.6, 1.0, 1.0, *(0.5 for _ in others)))
    figure.suptitle(_title(summary), fontsize=13)
    _draw_map(axes[0], record, summary)
    for axis, name in zip(axes[1:3], ("safety", "energy"), strict=True):
        _draw_quality(axis, record, summary, name)
    for axis, name in zip(axes[3:], others, strict=True):
        _draw_other(axis, record, summary, name)
    for axis in axes[1:-1]:
        axis.tick_params(labelbottom=False)
    axes[-1].set_xlabel("simulated time since the start of the mission (s)")
    figure.savefig(path, dpi=_DPI, format="svg" if path.suffix == ".svg" else "png")


def others_observed(record: MissionRecord) -> list[str]:
    """Return what was observed beside both qualities, such as the light: what a design may need of its surroundings."""
    return [name for name in dict.fromkeys(r.name for r in record.observed) if name not in ("safety", "energy")]


def configuration_spans(record: MissionRecord) -> list[tuple[float, float, str]]:
    """Return the start and end (stamps in s) of each configuration; a configuration starts when it is STABLE."""
    start, end = record.start_stamp, record.end_stamp
    stable = [
        report for report in record.configurations if report.state == FunctionGrounding.STABLE and report.stamp < end
    ]
    changes: list[tuple[float, str]] = []
    for report in stable:
        if not changes or changes[-1][1] != report.configuration:
            changes.append((max(report.stamp, start), report.configuration))
    if not changes:
        began = record.event(MissionEvent.MISSION_START)
        changes = [(start, began.values.get("initial_configuration", "unknown") if began else "unknown")]
    changes[0] = (start, changes[0][1])
    ends = [stamp for stamp, _ in changes[1:]] + [end]
    return [(begin, until, name) for (begin, name), until in zip(changes, ends, strict=True) if until > begin]


def _title(summary: dict[str, Any]) -> str:
    manager = "with metacontrol" if summary["metacontrol"] else "baseline without metacontrol"
    result = "goal reached" if summary["goal_reached"] else f"goal not reached ({summary['outcome']})"
    return (
        f"Mission {summary['mission']}, route {summary['route']}, seed {summary['seed']}, {manager}\n"
        f"{result} after {summary['duration_s']:.1f} s, {summary['path_length_m']:.1f} m, "
        f"{len(summary['reconfigurations'])} reconfiguration(s)"
    )


def _draw_map(axis: Axes, record: MissionRecord, summary: dict[str, Any]) -> None:
    start = record.start_stamp
    _draw_obstacles(axis, record)
    colours = _colours(record)
    inside = (record.poses[:, 0] >= start) & (record.poses[:, 0] <= record.end_stamp)
    poses = record.poses[inside]
    for begin, until, name in configuration_spans(record):
        first, last = np.searchsorted(poses[:, 0], (begin, until))
        span = poses[first : last + 1, 1:]
        axis.plot(span[:, 0], span[:, 1], color=colours[name], linewidth=3.5, solid_capstyle="round", zorder=3)
    if record.obstacles:
        axis.plot(*zip(*record.obstacles, strict=True), "s", color=_FAILURE, markersize=6, zorder=2)
    handles = [Line2D([], [], color=colour, linewidth=3.5, label=name) for name, colour in colours.items()]
    if record.obstacles:
        handles.append(Line2D([], [], color=_FAILURE, marker="s", linestyle="", label="clutter"))
    if len(poses):
        handles.append(_mark(axis, (poses[0, 1], poses[0, 2]), "o", "black", "start"))
    goal = _goal(record)
    if goal:
        handles.append(_mark(axis, goal, "*", "#2ca02c", "goal", size=20))
    for entry in summary["perturbations"]:
        place = _place(poses, start + entry["stamp_s"])
        if place and "places" not in entry:  # clutter is drawn where it lies
            handles.append(_mark(axis, place, "X", _FAILURE, f"{entry['name']}\nstruck", size=15))
    for number, entry in enumerate(summary["reconfigurations"], start=1):
        place = _place(poses, start + entry["stamp_s"])
        if place:
            label = f"{number}: {entry['from']}\n\N{RIGHTWARDS ARROW} {entry['to']}"
            handles.append(_mark(axis, place, "D", "#ffd92f", label, size=7))
            axis.annotate(
                str(number), place, xytext=(14, -16), textcoords="offset points", fontsize=12, fontweight="bold"
            )
    axis.set_aspect("equal")
    axis.set_xlabel("x (m)")
    axis.set_ylabel("y (m)")
    legend = axis.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=9, frameon=False)
    for handle in legend.get_lines():
        handle.set_markersize(8)


def _draw_obstacles(axis: Axes, record: MissionRecord) -> None:
    grid = record.map
    if grid is None:
        axis.autoscale()
        return
    rows, columns = grid.occupied.shape
    right, top = grid.origin_x + columns * grid.resolution, grid.origin_y + rows * grid.resolution
    shades = np.where(grid.occupied, 0.35, 1.0)
    extent = (grid.origin_x, right, grid.origin_y, top)
    axis.imshow(shades, cmap="gray", vmin=0, vmax=1, origin="lower", extent=extent, interpolation="nearest")
    if grid.occupied.any():
        ys, xs = np.nonzero(grid.occupied)
        axis.set_xlim(*_limits(grid.origin_x + xs * grid.resolution))
        axis.set_ylim(*_limits(grid.origin_y + ys * grid.resolution))


def _limits(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()) - _MARGIN_M, float(values.max()) + _MARGIN_M


def _mark(axis: Axes, place: tuple[float, float], marker: str, colour: str, label: str, *, size: float = 11) -> Line2D:
    (line,) = axis.plot(
        *place,
        marker=marker,
        color=colour,
        markeredgecolor="black",
        markersize=size,
        linestyle="",
        label=label,
        zorder=5,
    )
    return line


def _draw_quality(axis: Axes, record: MissionRecord, summary: dict[str, Any], name: str) -> None:
    start, end = record.start_stamp, record.end_stamp
    limit = summary["thresholds"][name]
    observed = _observed(record, name)
    truth = [(stamp - start, level) for stamp, level in record.true_quality.get(name, ())]
    series = ((observed, "#888888", 0.9, "observed"), (truth, "#1f4e79", 1.4, "ground truth"))
    for samples, colour, width, label in series:
        _draw_series(axis, samples, end - start, color=colour, linewidth=width, label=label)
    axis.axhline(limit, color=_FAILURE, linestyle="--", linewidth=1.2, label=f"threshold {limit:g}")
    _draw_changes(axis, summary, end - start)
    for number, entry in enumerate(summary["reconfigurations"], start=1):
        done = entry["stamp_s"] + (entry["execute_s"] or 0.0)
        axis.annotate(
            f"{number}: {entry['to']}", (done, 1.0), xytext=(4, -2), textcoords="offset points", fontsize=9, va="top"
        )
    axis.set_ylim(0.0, 1.08)
    unit = "safety risk" if name == "safety" else name
    share = summary["time_above_threshold"][name]
    told = "" if share is None else f"\nabove: {share:.1%}"
    axis.set_ylabel(f"{unit}{told}")
    axis.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=9, frameon=False)


def _draw_other(axis: Axes, record: MissionRecord, summary: dict[str, Any], name: str) -> None:
    """Draw what was observed without a threshold, in its own unit."""
    end = record.end_stamp - record.start_stamp
    _draw_series(axis, _observed(record, name), end, color="#888888", linewidth=1.4, label="observed")
    axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
    _draw_changes(axis, summary, end)
    axis.set_ylabel(name)


def _observed(record: MissionRecord, name: str) -> list[tuple[float, float]]:
    """Return what the observers told: s since the start, and the level, which is NaN while it was stale."""
    told = (report for report in record.observed if report.name == name)
    return [(r.stamp - record.start_stamp, np.nan if r.level is None else r.level) for r in told]


def _draw_series(axis: Axes, samples: list[tuple[float, float]], end: float, **style: Any) -> None:
    """Draw samples that hold until the next one; the last one holds until the end, s since the start."""
    if samples:
        held = [*samples, (end, samples[-1][1])] if samples[-1][0] < end else samples
        axis.step(*zip(*held, strict=True), where="post", **style)


def _draw_changes(axis: Axes, summary: dict[str, Any], end: float) -> None:
    """Draw when something went wrong, and when another configuration was deployed, up to the end, s since the start."""
    strikes = [entry["stamp_s"] for entry in summary["perturbations"]]
    if strikes:
        axis.axvspan(min(strikes), end, color=_FAILURE, alpha=0.10, linewidth=0, label="contingency")
    for number, entry in enumerate(summary["reconfigurations"], start=1):
        done = entry["stamp_s"] + (entry["execute_s"] or 0.0)
        legend = "reconfiguration" if number == 1 else None
        axis.axvspan(entry["stamp_s"], done, color="#ffb000", alpha=0.6, linewidth=1.5, zorder=0, label=legend)
    axis.set_xlim(0.0, max(end, 1.0))
    axis.grid(alpha=0.3)


def _colours(record: MissionRecord) -> dict[str, str]:
    """Return a colour for each configuration, in the order of appearance."""
    names = dict.fromkeys(name for _, _, name in configuration_spans(record))
    return {name: _COLOURS[number % len(_COLOURS)] for number, name in enumerate(names)}


def _goal(record: MissionRecord) -> tuple[float, float] | None:
    """Return x and y of the goal in MISSION_START, "x y yaw"; None where it has none."""
    began = record.event(MissionEvent.MISSION_START)
    try:
        x, y, *_ = map(float, (began.values.get("goal", "") if began else "").split())
    except ValueError:
        return None
    return x, y


def _place(poses: np.ndarray, stamp: float) -> tuple[float, float] | None:
    """Return where the robot was at a moment; None where that is not known."""
    if not len(poses):
        return None
    index = min(int(np.searchsorted(poses[:, 0], stamp)), len(poses) - 1)
    return float(poses[index, 1]), float(poses[index, 2])
