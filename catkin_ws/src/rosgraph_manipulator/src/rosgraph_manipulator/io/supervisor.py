"""Who starts this process again when it ends."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

_BY_ROSLAUNCH = "__log:="  # an argument that roslaunch gives to each node, and nobody else
_START = 19  # of the fields after the command's name: when the process started, in ticks since boot (proc(5))


def find_supervisor(arguments: Sequence[str]) -> str:
    """Return what tells the roslaunch that has started this process from any other; empty: none has.

    Args:
        arguments: of this process.
    """
    if not any(argument.startswith(_BY_ROSLAUNCH) for argument in arguments):
        return ""
    parent = os.getppid()
    try:
        fields = Path(f"/proc/{parent}/stat").read_text(errors="replace").rpartition(")")[2].split()
    except OSError:  # it has ended
        return ""
    return f"{parent} {fields[_START]}"
