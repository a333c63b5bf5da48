"""Qualities that can't be observed: few lines, although the reason that observers give changes each time."""

from __future__ import annotations


class Unobserved:
    """Tells once when a quality can't be observed, again once a period while that lasts, and once when it ends."""

    def __init__(self, period: float = 60.0) -> None:
        """Take the time in s between two lines that one quality can't be observed."""
        self._period = period
        self._told: dict[str, float] = {}
        self._is_open: set[str] = set()

    def stale(self, now: float, quality: str, reason: str) -> str | None:
        """Return what to say of a quality that can't be observed at this time in s, None for nothing."""
        if quality in self._told and now - self._told[quality] < self._period:
            return None
        self._told[quality] = now
        self._is_open.add(quality)
        return f"QA {quality} can't be observed: {reason or 'no reason given'}"

    def observed(self, quality: str) -> str | None:
        """Return what to say of a quality that is observed, None for nothing."""
        if quality not in self._is_open:
            return None
        self._is_open.remove(quality)
        return f"QA {quality} is observed again"
