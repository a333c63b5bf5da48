"""What the reasoner would refuse of a project at its start, for `rosmodel check`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from node_kit.plugins import PluginError, find
from ros_model.findings import WARNING, Finding

if TYPE_CHECKING:
    from ros_model.project.project import Project


def utility_findings(project: Project) -> Iterator[Finding]:
    """Yield why the utility function of a project can't be made.

    One that is not found here may be found where the reasoner runs, so it is a warning.
    """
    utility = project.settings["utility"]
    if isinstance(utility, str):
        return  # the schema knows the qualities
    (name,) = utility
    known, where = find("mros1_reasoner", "utility"), project.source.at("utility", name)
    if name not in known:
        remedy = "correct it, or source the workspace that has it"
        text = f"no package here exports a utility function of that name; there are {', '.join(sorted(known))}"
        yield Finding(f"utility.{name}: {text}: {remedy}", where, "settings", WARNING)
        return
    try:
        known[name].load()
    except PluginError as error:
        yield Finding(f"utility.{name}: {error}", where, "settings", WARNING)
        return
    yield from _refused(utility, project.settings["quality_attributes"], name, where)


def _refused(utility: Any, attributes: Any, name: str, where: Any) -> Iterator[Finding]:
    from mros1_reasoner.knowledge.model import Direction, Quality  # imported when asked for: it takes its time
    from mros1_reasoner.planning.utility import UtilityError, make_utility

    qualities = {quality: Quality(Direction(entry["direction"])) for quality, entry in attributes.items()}
    try:
        make_utility(utility, qualities)
    except UtilityError as error:
        yield Finding(f"utility.{name}: {error}", where, "settings")
