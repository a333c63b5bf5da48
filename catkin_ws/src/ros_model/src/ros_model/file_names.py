"""Names that can be file names."""

from __future__ import annotations

import re

from ros_model.errors import ModelError

_FILE_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")


def safe_file_name(name: str, purpose: str) -> str:
    """Return the name if it is fit to name a file in a folder, as names of systems do.

    Raises:
        ModelError: it is empty, or holds anything but letters, digits, `_`, `-` and `.` (not first).
    """
    if not _FILE_NAME.fullmatch(name):
        raise ModelError(f"{purpose} {name!r} can't name a file: use letters, digits, '_', '-' and '.'")
    return name
