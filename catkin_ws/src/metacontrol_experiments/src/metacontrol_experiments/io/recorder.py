"""The recorder of a mission: whether it still runs, and whether the bag that it leaves is whole."""

from __future__ import annotations

import signal
from contextlib import suppress
from typing import TYPE_CHECKING

from metacontrol_experiments.io.processes import RunError
from metacontrol_experiments.mission.console import last_complaint_in

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from metacontrol_experiments.io.processes import ProcessTree

_GRACE_S = 15.0
"""Wall seconds that it has to close the bag."""


class Recorder:
    """rosbag's recorder, as a process of a run."""

    def __init__(self, tree: ProcessTree, bag: Path, log: Path, say: Callable[[str], None]) -> None:
        """Prepare.

        Args:
            tree: the processes of the run.
            bag: what it leaves; while it records, the name has `.active` added.
            log: what it says goes there.
            say: shows a line.
        """
        self._tree, self._bag, self._log, self._say = tree, bag, log, say
        self._active = bag.with_name(bag.name + ".active")
        self._process: subprocess.Popen[bytes] | None = None
        self._ended = ""

    def start(self, command: Sequence[str]) -> None:
        """Start it by a command that records into the bag; what an earlier one did not close goes.

        Raises:
            OSError: there is no such command, or a file cannot be written.
        """
        if self._active.exists():
            self._say(f"{self._active}, which the recorder of an earlier run did not close, is deleted")
            self._active.unlink()
        self._process = self._tree.start(command, self._log)

    @property
    def ended(self) -> str:
        """Why it ended before it was asked to; empty before, and while it runs."""
        if not self._ended and self._process is not None and (status := self._process.poll()) is not None:
            self._ended = self._why(status)
        return self._ended

    def watch(self) -> None:
        """Say that it has ended, once; a mission goes on without it."""
        if not self._ended and self.ended:
            self._say(f"the recorder has ended: {self._ended}; the mission goes on, but its bag will not be whole")

    def stop(self) -> None:
        """Have it close the bag.

        Raises:
            RunError: the bag is not whole; the message says which file there is, and why.
        """
        if self._process is None:
            raise RuntimeError("the recorder was not started")
        if why := self.ended:
            raise RunError(f"the recorder ended before the mission did ({why}): {self._left()}")
        if not self._tree.stop(self._process, _GRACE_S):
            raise RunError(f"the recorder did not close the bag within {_GRACE_S:g} s: {self._left()}")
        if status := self._process.wait():
            raise RunError(f"the recorder did not end well ({self._why(status)}): {self._left()}")
        if not self._bag.exists():
            raise RunError(f"the recorder left no {self._bag}; see {self._log}")

    def _why(self, status: int) -> str:
        """Return why it has ended: the signal, or the last error that it told, or its exit status."""
        if status < 0:
            return f"signal {signal.Signals(-status).name}"
        with suppress(OSError):
            if said := last_complaint_in(self._log.read_text(encoding="utf-8", errors="replace")):
                return said
        return f"exit status {status}, see {self._log}"

    def _left(self) -> str:
        """Return what there is of the bag."""
        if self._active.exists():
            return f"{self._active} was not closed, `rosbag reindex {self._active}` makes what is in it readable"
        if self._bag.exists():
            return f"{self._bag} lacks a part of the mission, so there is no summary"
        return f"there is no {self._bag}"
