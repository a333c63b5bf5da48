"""Who starts this process again when it ends, and what names a process."""

from __future__ import annotations

import functools
import os
from collections.abc import Sequence
from pathlib import Path

_BY_ROSLAUNCH = "__log:="  # an argument that roslaunch gives to each node, and nobody else
_START = 19  # of the fields in /proc/PID/stat after the command's name


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


@functools.lru_cache(maxsize=1)
def owner_id(pid: int) -> str:
    """Return what names a process among all that were started since the host was: its id and its start.

    The start is in ticks since boot, as in proc(5). That of psutil changes when the wall clock is set.

    Raises:
        OSError: it has ended.
    """
    fields = Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()
    return f"{pid}@{fields[_START]}"
