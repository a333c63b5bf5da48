"""The figures of a report but for the single pair: distributions, map, reconfigurations, trade-off.

Each function returns None where the missions do not tell what it shows.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import PowerNorm
from matplotlib.ticker import MaxNLocator, PercentFormatter
from metacontrol_bags.violations import CELL_M

from metacontrol_experiments.report.adaptations import SPANS, spans
from metacontrol_experiments.report.drawing import new_figure, styles
from metacontrol_experiments.report.missions import BASELINE, OURS, QUALITIES, Mission, of_manager
from metacontrol_experiments.report.tables import TOTAL, undisturbed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from metacontrol_bags.record import OccupancyMap

    from metacontrol_experiments.report.published import Published
    from metacontrol_experiments.report.statistics import Estimate
    from metacontrol_experiments.report.tables import Analysis

_COLOURS = "cividis_r"
_MOST_DOTS = 200
"""Of a box: more are a blot."""


def distributions(analysis: Analysis) -> Figure | None:
    """Draw how many missions of each manager have at most a share of time above the limits, and a time to the goal."""
    calm = undisturbed(analysis.missions)
    panels: dict[str, Callable[[Mission], float | None]]
    panels = {f"above the {quality} threshold, % of time": partial(_percent, quality) for quality in QUALITIES}
    panels["time to the goal, s"] = lambda mission: mission.time_to_goal
    if not any(of(mission) is not None for of in panels.values() for mission in calm):
        return None
    figure, looks = new_figure(3.4), styles(analysis.managers)
    axes = figure.subplots(1, len(panels), sharey=True)
    for axis, (title, of) in zip(axes, panels.items(), strict=True):
        for manager, look in looks.items():
            values = [value for mission in of_manager(calm, manager) if (value := of(mission)) is not None]
            if values:
                axis.ecdf(values, color=look.colour, linestyle=look.line, linewidth=1.8, label=manager)
        axis.set_xlabel(title)
        axis.xaxis.set_major_locator(MaxNLocator(6))
        axis.yaxis.set_major_formatter(PercentFormatter(1.0))
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("missions with at most that")
    _legend_above(figure, axes[0])
    return figure


def violation_map(analysis: Analysis, floor: OccupancyMap | None) -> Figure | None:
    """Draw where the first two managers (the baseline and ours where they are there) are above the limits.

    Args:
        analysis: of the table.
        floor: what stands there; None where it is not known.
    """
    calm = undisturbed(analysis.missions)
    told = {
        manager: own
        for manager in analysis.managers
        if (
            own := [
                m for m in of_manager(calm, manager) if m.summary.get("violation_places", {}).get("cell_m") == CELL_M
            ]
        )
    }
    shown = dict(list(told.items())[:2])
    cells = {(quality, name): _places(own, quality) for quality in QUALITIES for name, own in shown.items()}
    if not any(cells.values()):
        return None
    figure = new_figure(4.2 * len(QUALITIES))
    axes = figure.subplots(len(QUALITIES), len(shown), squeeze=False, sharex=True, sharey=True)
    for line, quality in zip(axes, QUALITIES, strict=True):
        largest = max(seconds for name in shown for seconds in [0.0, *cells[quality, name].values()])
        scale = PowerNorm(0.5, 0.0, largest or 1.0)
        for axis, name in zip(line, shown, strict=True):
            _draw_floor(axis, floor)
            _draw_cells(axis, cells[quality, name], scale)
            axis.set_title(f"{quality}, {name}: {sum(cells[quality, name].values()):.2f} s per mission")
            axis.set_aspect("equal")
        figure.colorbar(
            ScalarMappable(scale, _COLOURS), ax=list(line), label="s above the threshold per mission", shrink=0.85
        )
        line[0].set_ylabel("y, m")
    for axis in axes[-1]:
        axis.set_xlabel("x, m")
    return figure


def reconfigurations(analysis: Analysis, published: Published) -> Figure | None:
    """Draw how long reconfigurations took, of each manager and trigger."""
    found = [
        (f"{manager}, {kind}", values)
        for manager in analysis.managers
        for kind, values in spans(analysis.missions, manager).items()
    ]
    if not any(values[span] for _, values in found for span in SPANS):
        return None
    titles = ("cause to first report, s", "report to decision, s", "decision to new configuration, s")
    figure = new_figure(1.6 + 0.42 * len(found))
    axes = figure.subplots(1, len(SPANS), sharey=True)
    for axis, span, title in zip(axes, SPANS, titles, strict=True):
        groups = [values[span] for _, values in found]
        axis.boxplot(
            groups,
            orientation="horizontal",
            whis=(5, 95),
            widths=0.6,
            showfliers=False,
            medianprops={"color": "#D55E00", "linewidth": 2.0},
        )
        rng = np.random.default_rng(0)
        for number, values in enumerate(groups, start=1):
            if len(values) <= _MOST_DOTS:
                heights = number + rng.uniform(-0.22, 0.22, len(values))
                axis.plot(values, heights, ".", color="#0072B2", alpha=0.5, markersize=5, zorder=1)
        axis.set_xlabel(title)
        axis.grid(axis="x", alpha=0.3)
    if published.reconfiguration_s is not None:
        axes[-1].axvline(
            published.reconfiguration_s,
            color="black",
            linestyle=":",
            label=f"published: {published.reconfiguration_s:g} s",
        )
        _legend_above(figure, axes[-1])
    for axis in axes:
        axis.set_xlim(left=0.0)
    axes[0].set_yticks(range(1, len(found) + 1), [name for name, _ in found])
    axes[0].invert_yaxis()
    return figure


def trade_off(analysis: Analysis, published: Published) -> Figure | None:
    """Draw violation against duration of all managers, with intervals."""
    times = analysis.row("time", TOTAL)
    rows = {quality: analysis.row(quality, TOTAL) for quality in QUALITIES}
    if times is None or not any(rows.values()):
        return None
    figure, looks = new_figure(3.8), styles(analysis.managers)
    axes = figure.subplots(1, len(QUALITIES))
    for axis, (quality, row) in zip(axes, rows.items(), strict=True):
        for manager in analysis.managers:
            time, share = times.figures.get(manager), row.figures.get(manager) if row else None
            if time is None or share is None:
                continue
            look = looks[manager]
            axis.errorbar(
                time.value,
                100.0 * share.value,
                xerr=_whiskers(time, 1.0),
                yerr=_whiskers(share, 100.0),
                fmt=look.mark,
                color=look.colour,
                markersize=9,
                capsize=3,
                label=manager,
            )
        for manager, name, line in ((BASELINE, "published baseline", ":"), (OURS, "published MROS", "-.")):
            paper = published.figure(quality, TOTAL, manager)
            if paper is not None:
                axis.axhline(100.0 * paper, color="#555555", linestyle=line, linewidth=1.2, label=name)
        axis.set_xlabel("mean time to the goal, s")
        axis.set_ylabel(f"above the {quality} threshold, % of time")
        axis.set_ylim(bottom=-0.04 * axis.get_ylim()[1])  # marks at 0 are whole
        axis.grid(alpha=0.3)
    _legend_above(figure, axes[0])
    return figure


def _percent(quality: str, mission: Mission) -> float | None:
    share = mission.above(quality)
    return None if share is None else 100.0 * share


def _places(missions: Sequence[Mission], quality: str) -> dict[tuple[int, int], float]:
    """Return the seconds above a limit per mission by cell."""
    found: dict[tuple[int, int], float] = {}
    for mission in missions:
        for i, j, seconds in mission.summary["violation_places"].get(quality) or ():
            found[i, j] = found.get((i, j), 0.0) + seconds / len(missions)
    return found


def _draw_floor(axis: Axes, floor: OccupancyMap | None) -> None:
    if floor is None:
        return
    rows, columns = floor.occupied.shape
    right, top = floor.origin_x + columns * floor.resolution, floor.origin_y + rows * floor.resolution
    extent = (floor.origin_x, right, floor.origin_y, top)
    shades = np.where(floor.occupied, 0.75, 1.0)
    axis.imshow(shades, cmap="gray", vmin=0.0, vmax=1.0, origin="lower", extent=extent, interpolation="nearest")


def _draw_cells(axis: Axes, cells: Mapping[tuple[int, int], float], scale: PowerNorm) -> None:
    if not cells:
        return
    places = np.array(list(cells))
    first, last = places.min(axis=0), places.max(axis=0)
    seconds = np.full(last - first + 1, np.nan)
    seconds[tuple((places - first).T)] = list(cells.values())
    x, y = (CELL_M * np.arange(low, high + 2) for low, high in zip(first, last, strict=True))
    axis.pcolormesh(x, y, seconds.T, cmap=_COLOURS, norm=scale, rasterized=True)


def _whiskers(figure: Estimate, scale: float) -> list[list[float]] | None:
    """Return how far the interval reaches below and above a figure."""
    if figure.low is None or figure.high is None:
        return None
    return [[scale * (figure.value - figure.low)], [scale * (figure.high - figure.value)]]


def _legend_above(figure: Figure, axis: Axes) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(6, len(labels) or 1), frameon=False)
