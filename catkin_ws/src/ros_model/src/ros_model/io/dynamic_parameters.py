"""Ranges of parameters that packages declare for dynamic_reconfigure, read from cfg/*.cfg without running it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospkg

from ros_model.errors import ModelError
from ros_model.io.files import read_text
from ros_model.language.reconfigure import ReconfigureError, parse_reconfigure

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


def ranges_of(package: str) -> dict[str, str]:
    """Return the range or the choices of each parameter, in words; of a package that is not here, nothing."""
    from pathlib import Path  # here alone at run time

    try:
        folder = Path(rospkg.RosPack().get_path(package)) / "cfg"
    except rospkg.ResourceNotFound:
        return {}
    found: dict[str, str] = {}
    for path in sorted(folder.glob("*.cfg")):
        found |= {name: f"{told} ({package}/cfg/{path.name})" for name, told in _ranges(path)}
    return found


def _ranges(path: Path) -> Iterator[tuple[str, str]]:
    try:
        parameters = parse_reconfigure(read_text(path)).parameters
    except (ModelError, ReconfigureError):
        return
    for parameter in parameters:
        if parameter.choices:
            yield parameter.name, f"one of {', '.join(map(str, parameter.choices))}"
        elif parameter.range:
            yield parameter.name, "{} to {}".format(*parameter.range)
