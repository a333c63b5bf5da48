"""Draw a mission of D1: the cell before and after, who did what and why, the tags, the forces."""

from __future__ import annotations

import textwrap
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
from matplotlib.figure import Figure
from metacontrol_bags.words import FunctionGrounding
from pybullet_simulator.physics.cell_picture import CellState, draw_cell

from metacontrol_experiments.pyramid.scenarios import ARMS, TITLES
from metacontrol_experiments.pyramid.summary import causes

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from metacontrol_bags.record import ConfigurationReport

    from metacontrol_experiments.pyramid.record import PyramidRecord

_SIZE_INCH, _DPI = (12.0, 15.0), 130
_FUNCTIONS = {
    "f_pick_place": "F0 pick and place",
    "f_move_position": "F1 move position",
    "f_calibrate_position": "F2 calibrate position",
}
_COLOURS = {
    "fd2": "#1f77b4",
    "fd1_left": "#ff7f0e",
    "fd1_right": "#2ca02c",
    "fd1_1": "#9467bd",
    "fd2_1": "#e3b505",
    "fd2_2": "#555555",
}
_OTHER = "#bcbd22"
_CAUSE, _CHANGING = "#d62728", "#c9c9c9"
_ARM_COLOURS = {"left": "#ff7f0e", "right": "#2ca02c"}
_TITLE_WIDTH = 100
"""Characters of a line of the title."""
_FORCE_LIMIT = 25.0
"""N, at which an arm stops."""
_LEAST_FORCE = 0.1
"""N, below which a force is not drawn."""


def draw_pyramid(record: PyramidRecord, summary: dict[str, Any], path: Path) -> None:
    """Draw a mission into a PNG file.

    Raises:
        PhysicsError: PyBullet cannot start.
    """
    start, end = record.mission.start_stamp, record.mission.end_stamp
    figure = Figure(figsize=_SIZE_INCH, dpi=_DPI, layout="constrained")
    figure.suptitle(_title(summary), fontsize=14)
    axes = figure.subplot_mosaic(
        [["before", "after"], ["functions"] * 2, ["blocks"] * 2, ["tags"] * 2, ["forces"] * 2],
        height_ratios=[3.9, 1.5, 1.0, 1.0, 1.2],
    )
    for name, stamp in (("before", start), ("after", end)):
        axes[name].imshow(draw_cell(state_at(record, stamp)))
        axes[name].set_axis_off()
        axes[name].set_title(f"{name}: {stamp - start:.0f} s")
    _draw_functions(axes["functions"], record)
    _draw_blocks(axes["blocks"], record)
    _draw_tags(axes["tags"], record)
    _draw_forces(axes["forces"], record)
    for name in ("functions", "blocks", "tags", "forces"):
        axes[name].set_xlim(0.0, max(end - start, 1.0))
        axes[name].grid(alpha=0.3)
        for _, cause in causes(record):
            axes[name].axvline(cause - start, color=_CAUSE, linewidth=1.2, linestyle="--")
    axes["forces"].set_xlabel("s of ROS time since the goal was sent")
    figure.savefig(path)


def state_at(record: PyramidRecord, stamp: float) -> CellState:
    """Return where everything was at a moment, as far as the bag tells."""
    base = record.base[_index(record.base[:, 0], stamp), 1:4] if len(record.base) else (0.0, 0.0, 0.0)
    blocks = record.blocks[_index(record.block_stamps, stamp)]
    standing = [boxes for since, boxes in record.obstacles if since <= stamp]
    return CellState(
        (float(base[0]), float(base[1]), float(base[2])),
        {name: float(rows[_index(rows[:, 0], stamp), 1]) for name, rows in record.joints.items()},
        {
            f"block_{number}": ((pose[0], pose[1], pose[2]), (pose[3], pose[4], pose[5], pose[6]))
            for number, pose in enumerate(blocks.tolist(), start=1)
        },
        standing[-1] if standing else {},
    )


def _index(stamps: np.ndarray, stamp: float) -> int:
    """Return the index of the last stamp that is not later, the first one at least."""
    return max(0, int(np.searchsorted(stamps, stamp, side="right")) - 1)


def _title(summary: dict[str, Any]) -> str:
    manager = "with metacontrol" if summary["metacontrol"] else "baseline without metacontrol"
    result = "success" if summary["success"] else "no success"
    scenario = summary["scenario"]
    lines = (
        f"D1, scenario {scenario} ({TITLES.get(scenario, 'unknown')}), seed {summary['seed']}, {manager}",
        f"{result}: {summary['placed']} of 6 blocks in place after {summary['duration_s']:.0f} s; {summary['reason']}",
    )
    return "\n".join(textwrap.fill(line, _TITLE_WIDTH) for line in lines)


def _draw_functions(axis: Axes, record: PyramidRecord) -> None:
    """Draw what was grounded by what, and what caused the changes."""
    start, end = record.mission.start_stamp, record.mission.end_stamp
    names = list(_FUNCTIONS)
    for row, function in enumerate(names):
        for begin, until, report in spans(record, function):
            is_stable = report.state == FunctionGrounding.STABLE
            colour = _COLOURS.get(report.configuration, _OTHER) if is_stable else _CHANGING
            axis.barh(row, until - begin, left=begin - start, height=0.7, color=colour)
            if is_stable and until - begin > 0.04 * (end - start):
                place = (begin + until) / 2.0 - start
                axis.text(place, row, report.configuration, ha="center", va="center", color="white")
    axis.set_yticks(range(len(names)), [_FUNCTIONS[name] for name in names])
    axis.set_ylim(len(names) - 0.5, -1.7)
    for number, (event, cause) in enumerate(causes(record)):
        axis.text(cause - start, -0.55 - 0.37 * (number % 3), f" {event.name}", color=_CAUSE, fontsize=9)


def spans(record: PyramidRecord, function: str) -> list[tuple[float, float, ConfigurationReport]]:
    """Return begin and end (s of ROS time, within the mission) of each grounding of a function."""
    start, end = record.mission.start_stamp, record.mission.end_stamp
    stamps = [max((report.stamp for report in reports), default=0.0) for reports in record.groundings]
    found = []
    for reports, (stamp, until) in zip(record.groundings, pairwise([*stamps, end]), strict=True):
        report = next((r for r in reports if r.function == function and r.configuration), None)
        begin = max(stamp, start)
        if report is not None and min(until, end) > begin:
            found.append((begin, min(until, end), report))
    return _joined(found)


def _joined(found: list[tuple[float, float, ConfigurationReport]]) -> list[tuple[float, float, ConfigurationReport]]:
    """Return spans in which nothing changes for the function as one."""
    joined: list[tuple[float, float, ConfigurationReport]] = []
    for begin, until, report in found:
        last = joined[-1] if joined else None
        same = last and (last[2].configuration, last[2].state) == (report.configuration, report.state)
        if last and same and last[1] == begin:
            joined[-1] = last[0], until, report
        else:
            joined.append((begin, until, report))
    return joined


def _draw_blocks(axis: Axes, record: PyramidRecord) -> None:
    from metacontrol_experiments.pyramid.summary import IN_PLACE, placed

    counts = [int((placed(blocks[:, :3]) <= IN_PLACE).sum()) for blocks in record.blocks]
    axis.step(record.block_stamps - record.mission.start_stamp, counts, where="post", color="#1f4e79")
    axis.set_ylim(-0.3, 6.3)
    axis.set_yticks(range(0, 7, 2))
    axis.set_ylabel("blocks in place")


def _draw_tags(axis: Axes, record: PyramidRecord) -> None:
    start, end = record.mission.start_stamp, record.mission.end_stamp
    if len(record.tag_share):
        axis.plot(record.tag_share[:, 0] - start, record.tag_share[:, 1], ".", color="#1f4e79", markersize=3)
    light = record.light
    if len(light):
        stamps = [max(stamp, start) - start for stamp in light[:, 0]]
        levels = light[:, 1].tolist()
        axis.step([*stamps, end - start], [*levels, levels[-1]], where="post", color="#e3b505", linewidth=2.0)
    axis.plot([], [], ".", color="#1f4e79", label="images with a tag")
    axis.plot([], [], color="#e3b505", linewidth=2.0, label="light")
    axis.set_ylim(-0.05, 1.1)
    axis.set_ylabel("share")
    axis.legend(loc="center right", fontsize=9)


def _draw_forces(axis: Axes, record: PyramidRecord) -> None:
    start = record.mission.start_stamp
    for arm in ARMS:
        rows = record.arms.get(arm, np.empty((0, 3)))
        axis.plot(rows[:, 0] - start, np.maximum(rows[:, 2], _LEAST_FORCE), color=_ARM_COLOURS[arm], label=f"{arm} arm")
    axis.axhline(_FORCE_LIMIT, color=_CAUSE, linewidth=1.0, label=f"limit {_FORCE_LIMIT:g} N")
    axis.set_yscale("log")
    axis.set_ylabel("contact force (N)")
    axis.legend(loc="upper right", fontsize=9)
