"""The files of a report: the table that it is about, logs of its runs, published figures, and what it leaves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
import rospkg
from metacontrol_bags.record import OccupancyMap
from node_kit.io.input_files import InputFileError, is_file, read_text, read_yaml
from node_kit.io.output_files import write_file
from node_kit.yaml_text import YamlError, parse_yaml
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.grid import OCCUPIED
from pybullet_simulator.world.world import WorldError, rasterise

from metacontrol_experiments.campaign.matrix import CampaignError
from metacontrol_experiments.io import campaign_folder
from metacontrol_experiments.io.campaign_folder import RUNS, TABLE
from metacontrol_experiments.io.input_files import PackageError, simulation_package
from metacontrol_experiments.mission.settings import LOG_NAME
from metacontrol_experiments.report.missions import ReportError, missions_of
from metacontrol_experiments.report.page import page
from metacontrol_experiments.report.published import PublishedError, parse_published
from metacontrol_experiments.report.remarks import asked_by
from metacontrol_experiments.report.report import FOLDER, TITLE, Table

if TYPE_CHECKING:
    from metacontrol_experiments.campaign.matrix import Run
    from metacontrol_experiments.report.published import Published
    from metacontrol_experiments.report.report import Report

_DPI = 200
_SALT = "metacontrol"
"""Of the names in SVG files, which are the same each time by it."""


def find_table(path: Path) -> Path:
    """Return the table of a campaign, given its path or that of its folder.

    Raises:
        ReportError: there is none.
    """
    found = path / TABLE if path.is_dir() else path
    if not is_file(found):
        raise ReportError(f"{found}: no such table; name the folder of a campaign, or its {TABLE}")
    return found


def read_table(path: Path) -> Table:
    """Return the missions of a table, and the campaign that is in its metadata.

    Raises:
        ReportError: it is no table of a campaign, or it is empty.
    """
    try:
        table = campaign_folder.read_table(path)
    except CampaignError as error:
        raise ReportError(str(error)) from error
    about = {key.decode(errors="replace"): value.decode(errors="replace") for key, value in _metadata(table)}
    campaign = about.get("campaign", "")
    try:
        asked = asked_by(parse_yaml(campaign))
    except YamlError:
        asked = None
    return Table(missions_of(table.to_pylist(), str(path)), path.name, campaign, asked)


def read_published(path: Path | None = None) -> Published:
    """Return the published figures and targets, by default of the file of this package.

    Raises:
        PublishedError: it cannot be read, or makes no sense.
    """
    path = path or Path(rospkg.RosPack().get_path("metacontrol_experiments")) / "config" / "published.yaml"
    try:
        return parse_published(read_yaml(path), str(path))
    except InputFileError as error:
        raise PublishedError(str(error)) from error


def read_log(table: Path, run: Run) -> str | None:
    """Return the log that a run left beside its table; None where there is none."""
    path = table.parent / RUNS / run.name / LOG_NAME
    try:
        return read_text(path) if is_file(path) else None
    except InputFileError:
        return None


def read_floor() -> OccupancyMap | None:
    """Return what stands on the floor of the factory, which campaigns drive on; None where it cannot be read."""
    try:
        grid = rasterise(read_world(simulation_package() / "worlds" / "factory.yaml"))
    except (PackageError, WorldError):
        return None
    return OccupancyMap(grid.resolution, grid.origin_x, grid.origin_y, np.asarray(grid.cells == OCCUPIED))


def write_report(report: Report, folder: Path) -> list[Path]:
    """Write the Markdown file, the HTML page, and each figure as PNG and SVG; return their paths."""
    pictures = folder / FOLDER
    pictures.mkdir(parents=True, exist_ok=True)
    written, content = [], {}
    for picture in report.pictures:
        if picture.figure is None:
            continue
        for kind in ("svg", "png"):
            path = pictures / f"{picture.name}.{kind}"
            with mpl.rc_context({"svg.hashsalt": _SALT}):
                picture.figure.savefig(path, dpi=_DPI, metadata={"Date": None} if kind == "svg" else None)
            written.append(path)
        content[f"{FOLDER}/{picture.name}.png"] = path.read_bytes()
    for name, text in (("report.md", report.markdown), ("report.html", page(report.markdown, TITLE, content))):
        write_file(folder / name, text)
        written.append(folder / name)
    return written


def _metadata(table: Any) -> list[tuple[bytes, bytes]]:
    return list((table.schema.metadata or {}).items())
