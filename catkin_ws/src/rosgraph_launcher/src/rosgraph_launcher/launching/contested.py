"""Names of nodes that somebody else has taken: a node must hold its name for a while before it counts as recovered.

Times are arguments, in seconds of one clock that never goes back.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

HOLD = 3.0
"""s in which nobody takes a contested name again, before it is one's own: roslaunch starts a node again 0.1 s after its
end, and a Python node then takes 0.3 to 1.5 s to register. With a `respawn_delay` it may come later, so this is doubled
each time that a name is taken once more within MEMORY."""

ANSWER_TIMEOUT = 30.0
"""s after its start in which a node must answer under a contested name: twice what the manipulator gives a node."""

MEMORY = 60.0  # s, twice the period in which deaths are counted


@dataclass(frozen=True)
class _Contest:
    """A name that was taken.

    Attributes:
        conflict: who has taken it, with the remedy.
        taken_at: when.
        hold: how long it must be held to be one's own, s.
        held_since: since when the launcher's own node answers under it; None: it does not.
        is_over: whether it has been held for so long.
        hangs: how often in a row it was started and never answered under it.
    """

    conflict: str
    taken_at: float
    hold: float
    held_since: float | None = None
    is_over: bool = False
    hangs: int = 0


class ContestedNames:
    """The names of nodes that somebody else has taken, until the launcher's nodes have held them for a while."""

    def __init__(self) -> None:
        self._contests: dict[str, _Contest] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The contested names."""
        return tuple(name for name, contest in self._contests.items() if not contest.is_over)

    def taken(self, name: str, conflict: str, now: float) -> None:
        """Note that somebody else has taken a name, and who."""
        before = self._contests.get(name)
        hold = 2.0 * before.hold if before and now - before.taken_at <= MEMORY else HOLD
        self._contests[name] = _Contest(conflict, now, hold, hangs=before.hangs if before else 0)

    def conflict(self, name: str) -> str:
        """Return who took a contested name last, with the remedy; empty: it is not contested."""
        contest = self._contests.get(name)
        return contest.conflict if contest and not contest.is_over else ""

    def seen(self, name: str, is_own: bool, now: float) -> None:
        """Note whether the launcher's own node answers under a contested name."""
        contest = self._contests[name]
        if not is_own:
            self._contests[name] = replace(contest, held_since=None)
        elif contest.held_since is None:
            self._contests[name] = replace(contest, held_since=now, hangs=0)
        elif now - contest.held_since >= contest.hold:
            self._contests[name] = replace(contest, is_over=True)

    def is_held(self, name: str) -> bool:
        """Tell whether the launcher's own node answered under a name when it was last looked at, or has it for good."""
        contest = self._contests.get(name)
        return contest is None or contest.is_over or contest.held_since is not None

    def hung(self, name: str) -> int:
        """Note that the launcher's own node has never answered under a contested name; return how often in a row."""
        contest = self._contests[name] = replace(self._contests[name], hangs=self._contests[name].hangs + 1)
        return contest.hangs

    def begin(self, name: str, conflict: str, now: float) -> None:
        """Note who had a name when a node was started under it; empty: nobody had."""
        self.forget(name)
        if conflict:
            self.taken(name, conflict, now)

    def keep(self, names: Collection[str]) -> None:
        """Forget all names but these."""
        self._contests = {name: contest for name, contest in self._contests.items() if name in names}

    def forget(self, name: str) -> None:
        """Forget a name: there is no node of it any more."""
        self._contests.pop(name, None)
