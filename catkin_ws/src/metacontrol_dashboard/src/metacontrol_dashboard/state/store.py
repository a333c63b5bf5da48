"""The state that viewers see: entries by section and key, and logs that grow. Each change has a number.

A viewer says up to which number it knows the state, and gets all that is newer, of each entry only the last value. So a
viewer that is slow skips what is between, and costs nobody anything. Numbers that are not finite are stored as None.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from itertools import takewhile
from typing import Any

from metacontrol_dashboard.state.numbers import finite

Change = dict[str, Any]
"""What a viewer gets: `version`, `set` (section -> key -> value), `drop` (section -> keys), `add` (log -> items)."""

_FORGET = 10_000
"""Removed entries that are remembered; a viewer that is further behind gets the whole state."""


class Store:
    """The state.

    Attributes:
        version: number of the last change.
    """

    def __init__(self, kept: int = 2000) -> None:
        """Start empty.

        Args:
            kept: how many items of each log are kept.
        """
        self.version = 0
        self._kept = kept
        self._entries: OrderedDict[tuple[str, str], tuple[int, Any]] = OrderedDict()  # the last changed ones last
        self._dropped: OrderedDict[tuple[str, str], int] = OrderedDict()
        self._whole_before = 0  # who knows less than this has to get all
        self._logs: dict[str, deque[tuple[int, Any]]] = {}

    def get(self, section: str, key: str) -> Any:
        """Return the value of an entry; None where there is none."""
        return self._entries.get((section, key), (0, None))[1]

    def keys(self, section: str) -> list[str]:
        """Return the keys of a section."""
        return [key for name, key in self._entries if name == section]

    def set(self, section: str, key: str, value: Any) -> bool:
        """Give an entry a value, fit for JSON; return whether that is a change."""
        place, value = (section, key), finite(value)
        known = self._entries.get(place)
        if known is not None and known[1] == value:
            return False
        self.version += 1
        self._entries[place] = self.version, value
        self._entries.move_to_end(place)
        self._dropped.pop(place, None)
        return True

    def drop(self, section: str, key: str) -> None:
        """Remove an entry, if it is there."""
        if self._entries.pop((section, key), None) is None:
            return
        self.version += 1
        self._dropped[section, key] = self.version
        if len(self._dropped) > _FORGET:
            _, self._whole_before = self._dropped.popitem(last=False)

    def replace(self, section: str, values: dict[str, Any]) -> None:
        """Have a section hold these entries and no others."""
        for key in self.keys(section):
            if key not in values:
                self.drop(section, key)
        for key, value in values.items():
            self.set(section, key, value)

    def append(self, log: str, item: Any) -> None:
        """Add an item to a log; the oldest one may be forgotten."""
        self.version += 1
        self._logs.setdefault(log, deque(maxlen=self._kept)).append((self.version, finite(item)))

    def changes(self, since: int = 0) -> Change:
        """Return what has changed after a number; everything, with `whole`, for a viewer that knows nothing."""
        is_whole = since <= 0 or since < self._whole_before or since > self.version
        since = 0 if is_whole else since
        found: Change = {"version": self.version, "set": {}, "drop": {}, "add": {}}
        if is_whole:
            found["whole"] = True
        newest = takewhile(lambda item: item[1][0] > since, reversed(self._entries.items()))
        for (section, key), (_, value) in reversed(list(newest)):
            found["set"].setdefault(section, {})[key] = value
        if not is_whole:
            for (section, key), _ in takewhile(lambda item: item[1] > since, reversed(self._dropped.items())):
                found["drop"].setdefault(section, []).append(key)
        for log, items in self._logs.items():
            fresh = [item for _, item in takewhile(lambda item: item[0] > since, reversed(items))]
            if fresh:
                found["add"][log] = fresh[::-1]
        return found
