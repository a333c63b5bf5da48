"""How components are repaired, as metacontrol.yaml says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ros_model.project.project import Project

REPAIR = "repair"
"""The key of an entry of `components`."""


def repairs_of(project: Project) -> dict[str, dict[str, Any]]:
    """Return how components are repaired, by their names in the running system.

    The package of each launch file is there, and its arguments are texts, as roslaunch takes them.
    """
    found = {}
    for component, entry in project.settings["components"].items():
        if REPAIR in entry:
            repair = {**entry[REPAIR]}
            if "launch" in repair:
                repair["launch"] = _launch(repair["launch"], project.package)
            found.update(dict.fromkeys(sorted(project.names_of(component)), repair))
    return found


def repair_lines(project: Project) -> Iterator[str]:
    """Yield lines that say how components are repaired."""
    for name, repair in project.repairs.items():
        launch = repair.get("launch")
        means = f"{launch['file']} of {launch['package']}" if launch else f"the service {repair['service']}"
        share = f", {repair['success']:.0%} succeed" if "success" in repair else ""
        count = f", at most {repair['attempts']} in a row" if "attempts" in repair else ""
        yield f"repair of {name}: {means}, {repair['duration']:g} s{share}{count}"


def _launch(launch: Mapping[str, Any], package: str) -> dict[str, Any]:
    found = {"package": launch.get("package", package), "file": launch["file"]}
    arguments = {name: _text(value) for name, value in launch.get("args", {}).items()}
    return {**found, "args": arguments} if arguments else found


def _text(value: str | float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
