"""Limits warnings, so that a flood of bad messages does not become a flood of lines."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class _Kind:
    """The texts of one kind of problem in the present period."""

    since: float
    said: set[str] = field(default_factory=set)
    silenced: int = 0


class LogThrottle:
    """Lets each text pass once in a period, and few texts of a kind; the next line says how many were dropped."""

    def __init__(self, period: float = 10.0, burst: int = 5) -> None:
        """Take the period in s and the number of different texts of one kind that may pass in it."""
        self._period = period
        self._burst = burst
        self._kinds: dict[str, _Kind] = {}

    def admit(self, now: float, kind: str, text: str) -> str | None:
        """Return what to say, None for nothing.

        Args:
            now: present time, s.
            kind: what sort of trouble it is; of these there must be few.
            text: the trouble.
        """
        known = self._kinds.get(kind)
        if known is None or now - known.since >= self._period:
            silenced = known.silenced if known else 0
            self._kinds[kind] = _Kind(now, {text})
            return f"{text} ({silenced} like it were not shown in the meantime)" if silenced else text
        if text in known.said or len(known.said) >= self._burst:
            known.silenced += 1
            return None
        known.said.add(text)
        return text
