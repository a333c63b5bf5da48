"""Where the packages are that ROS_PACKAGE_PATH leads to."""

from __future__ import annotations

import functools
import os
from pathlib import Path

import rospkg


def package_folder(name: str) -> Path | None:
    """Return the folder of a package; None where it is not installed."""
    return _folders(os.environ.get("ROS_PACKAGE_PATH", "")).get(name)


@functools.cache
def _folders(_paths: str) -> dict[str, Path]:
    """Return all packages; each value of ROS_PACKAGE_PATH is looked through once."""
    known = rospkg.RosPack()
    return {name: Path(known.get_path(name)) for name in known.list()}
