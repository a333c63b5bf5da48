"""Why the system of a mission has ended: by its console, or by what is seen of its master."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from node_kit.io.master_watch import MasterWatch
from node_kit.master import Standing, View
from node_kit.one_line import one_line

from metacontrol_experiments.mission.console import cause_in, is_ending

_OVERLAP = 100  # bytes of the console that are read twice


class EndOfSystem:
    """Watches the master beside the console, to which nodes can't write that it is gone while the disk is full."""

    def __init__(self, console: Path, uri: str) -> None:
        """Prepare.

        Args:
            console: the file with what roslaunch and its nodes write.
            uri: address of the master.
        """
        self._console, self._uri = console, uri
        self._seen = ""
        self._has_begun = False
        self._read_to = 0  # bytes of the console
        self._watch = MasterWatch(lambda _: None, self._on_loss)

    def watch(self) -> None:
        """Begin to watch the master, which is there; where there is no thread to be had, the console alone tells."""
        self._watch.heartbeat = self._on_answer
        with suppress(RuntimeError):
            self._watch.start(self._uri)

    def has_begun(self) -> bool:
        """Tell whether all ends: the master is gone, or roslaunch ends its processes, for which it may take 20 s."""
        if not self._has_begun and is_ending(self._said_since()):
            self._has_begun = True  # and never False again: the watch's thread sets it, too
        return self._has_begun

    def cause(self) -> str:
        """Return why all has ended, in one line."""
        return cause_in(self._said(), self._seen)

    def _on_loss(self, view: View) -> None:
        if view.pid is not None and not is_ending(self._said()):  # roslaunch takes its master with it
            self._seen = one_line(view.text(self._uri, "").removesuffix(": "))
            if view.standing is not Standing.MUTE:
                self._has_begun = True
        if view.standing is Standing.MUTE:  # it may answer again
            self._watch = MasterWatch(lambda _: None, self._on_loss)
            self.watch()

    def _on_answer(self) -> None:
        self._seen = ""

    def _said_since(self) -> str:
        """Return what the console has since the last call, and the end of what was before, which may be half a line."""
        try:
            with self._console.open("rb") as console:
                console.seek(max(0, self._read_to - _OVERLAP))
                text = console.read()
                self._read_to = console.tell()
        except OSError:  # no descriptor left
            return ""
        return text.decode(errors="replace")

    def _said(self) -> str:
        try:
            return self._console.read_text(encoding="utf-8", errors="replace")
        except OSError:  # no descriptor left
            return ""
