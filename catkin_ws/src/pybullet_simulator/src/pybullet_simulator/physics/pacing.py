"""Pacing: when the next step of a simulation is due on the wall clock."""

from __future__ import annotations


class Pacer:
    """Keeps a schedule of steps.

    Steps are due on a fixed grid, so that small delays do not add up to a drift. After a delay the steps follow each
    other faster, but never at less than `catch_up` of the period. So there is no burst. After a delay above `max_lag`,
    the schedule starts anew.
    """

    def __init__(self, period: float, max_lag: float = 0.2, catch_up: float = 0.5) -> None:
        """Set the schedule.

        Args:
            period: wall-clock time between steps in s; 0 runs without pauses.
            max_lag: longest delay in s that is caught up.
            catch_up: shortest distance of two steps while catching up, as a share of the period.
        """
        self.period = period
        self._max_lag = max_lag
        self._shortest = catch_up * period
        self._due: float | None = None
        self._last = 0.0

    def wait(self, now: float) -> float:
        """Return how long in s to wait before the next step.

        Args:
            now: monotonic wall-clock time in s.
        """
        if self.period <= 0.0:
            return 0.0
        if self._due is None or now - self._due > self._max_lag:
            self._due = now
        start = max(now, self._due, self._last + self._shortest)
        self._last = start
        self._due += self.period
        return start - now
