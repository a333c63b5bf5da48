"""Who starts this process again when it ends."""

from __future__ import annotations

import os
from collections.abc import Sequence

from rosgraph_launcher.io.processes import owner_id

_BY_ROSLAUNCH = "__log:="  # an argument that roslaunch gives to each node, and nobody else


def find_supervisor(arguments: Sequence[str]) -> str:
    """Return what tells the roslaunch that has started this process from any other; empty: none has.

    Args:
        arguments: of this process.
    """
    if not any(argument.startswith(_BY_ROSLAUNCH) for argument in arguments):
        return ""
    try:
        return owner_id(os.getppid())
    except OSError:  # it has ended
        return ""
