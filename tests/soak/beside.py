"""Programs of the soak that run beside a mission: they write lines, and may be told some."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path


def start(words: Sequence[str], environment: Mapping[str, str], log: Path) -> subprocess.Popen[str]:
    """Start a module, such as `soak.observer`, with its arguments; what it complains of goes to a file."""
    return subprocess.Popen(
        [sys.executable, "-m", *words],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log.open("wb"),
        text=True,
        start_new_session=True,
    )


def teller(program: subprocess.Popen[str]) -> Callable[[str], None]:
    """Return what tells a program a line, such as the observer a configuration to request."""

    def tell(text: str) -> None:
        if program.stdin is not None:
            program.stdin.write(text + "\n")
            program.stdin.flush()

    return tell
