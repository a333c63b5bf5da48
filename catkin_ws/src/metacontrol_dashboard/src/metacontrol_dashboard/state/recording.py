"""A recorded run as the changes of its state over time, which a page plays by itself. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from metacontrol_dashboard.state.store import Change, Store

_PERIOD = 0.1
"""s between two frames at least."""


@dataclass(frozen=True)
class Recording:
    """A run.

    Attributes:
        name: for people.
        start: of the run, s of its clock.
        end: the same.
        frames: stamps, and what has changed until then.
        problems: what is lost of the bag, in words.
        can_replay: whether the bag has the reasoner's journal, so that other limits can be tried.
    """

    name: str
    start: float
    end: float
    frames: tuple[tuple[float, Change], ...] = ()
    problems: tuple[str, ...] = ()
    can_replay: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return it as the page takes it."""
        return {
            "name": self.name,
            "start": self.start,
            "end": round(self.end, 3),
            "frames": [[round(stamp, 3), _plain(change)] for stamp, change in self.frames],
            "problems": list(self.problems),
            "can_replay": self.can_replay,
        }


@dataclass
class Recorder:
    """Cuts the changes of a store into frames."""

    store: Store
    frames: list[tuple[float, Change]] = field(default_factory=list)
    _seen: int = 0
    _due: float = 0.0

    def look(self, stamp: float) -> None:
        """Note that the time is so far; what has changed becomes a frame when the last one is long enough ago."""
        if stamp >= self._due:
            self.cut(stamp)

    def cut(self, stamp: float) -> None:
        """Make a frame of what has changed since the last one."""
        if self.store.version > self._seen:
            self.frames.append((stamp, self.store.changes(self._seen)))
            self._seen = self.store.version
        self._due = stamp + _PERIOD


def _plain(change: Change) -> Change:
    return {key: value for key, value in change.items() if value and key not in ("version", "whole")}
