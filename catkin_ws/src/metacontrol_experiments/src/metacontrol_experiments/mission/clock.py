"""The time by which a mission is judged: one wrong message on /clock ends none."""

from __future__ import annotations

STEP_S = 5.0
"""s of ROS time between two readings that no jump is needed for; a mission reads some twenty times a second."""
DOUBT_S = 1.0
"""s, wall, for which a jump must last before it is believed: the clock itself publishes far more often."""


class SteadyClock:
    """Follows ROS time, and a jump only once that has lasted: be it the clock's, or of a process that was held up."""

    def __init__(self) -> None:
        """Begin with the first time that is told."""
        self._believed: float | None = None
        self._doubted_since: float | None = None
        self._jumped = 0.0

    def believe(self, told: float, wall: float) -> float:
        """Return the time, s.

        Args:
            told: ROS time, s.
            wall: s of a clock that never goes back.
        """
        if self._believed is None or 0.0 <= told - self._believed <= STEP_S:
            self._believed, self._doubted_since = told, None
        elif self._doubted_since is None:
            self._doubted_since = wall
        elif wall - self._doubted_since > DOUBT_S:
            self._jumped += told - self._believed
            self._believed, self._doubted_since = told, None
        return self._believed

    def take_jump(self) -> float:
        """Return how far the time that is believed has jumped since the last call, s."""
        jumped, self._jumped = self._jumped, 0.0
        return jumped
