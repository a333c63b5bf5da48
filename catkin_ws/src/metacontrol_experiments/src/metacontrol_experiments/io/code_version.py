"""Find out which commit of the code runs, without git."""

from __future__ import annotations

import os
import re
from pathlib import Path

_HASH = re.compile(r"[0-9a-f]{40}|[0-9a-f]{64}")


def current_commit(start: Path | None = None) -> str:
    """Return the commit: the environment variable MROS_COMMIT, else the repository around `start`, else "unknown"."""
    given = os.environ.get("MROS_COMMIT", "").strip()
    if given:
        return given
    here = (start or Path(__file__)).resolve()
    for folder in here.parents:
        if (folder / ".git").exists():
            try:
                return _head(folder / ".git") or "unknown"
            except OSError:
                return "unknown"
    return "unknown"


def _head(git: Path) -> str | None:
    """Return the commit that HEAD names; `git` is the folder, or in a work tree the file that names the folder."""
    if git.is_file():
        git = (git.parent / git.read_text(encoding="utf-8").removeprefix("gitdir:").strip()).resolve()
    head = (git / "HEAD").read_text(encoding="utf-8").strip()
    if not head.startswith("ref:"):
        return head if _HASH.fullmatch(head) else None
    reference = head.removeprefix("ref:").strip()
    common = git / "commondir"
    shared = (git / common.read_text(encoding="utf-8").strip()).resolve() if common.exists() else git
    for folder in (git, shared):
        loose = folder / reference
        if loose.is_file():
            return loose.read_text(encoding="utf-8").strip()
    packed = shared / "packed-refs"
    lines = packed.read_text(encoding="utf-8").splitlines() if packed.exists() else []
    return next((line.split()[0] for line in lines if line.endswith(" " + reference)), None)
