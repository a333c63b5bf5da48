"""Which parameters to set and to restore when one configuration takes the place of another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any


class OverwrittenParameters:
    """The values that the parameter server had before configurations set others."""

    def __init__(self) -> None:
        self._before: dict[str, Any] = {}
        self._absent: set[str] = set()

    def unknown(self, wanted: Mapping[str, Any]) -> list[str]:
        """Return the parameters whose former values `remember` must be told before they are set."""
        return [name for name in wanted if name not in self._before and name not in self._absent]

    def remember(self, asked: Iterable[str], found: Mapping[str, Any]) -> None:
        """Keep the former values of parameters; those in `asked` that are not in `found` were not set."""
        for name in asked:
            if name in found:
                self._before[name] = found[name]
            else:
                self._absent.add(name)

    def transition(self, wanted: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
        """Return the parameters to set and those to delete, so that no value of another configuration is left."""
        restored = {name: value for name, value in self._before.items() if name not in wanted}
        return {**restored, **wanted}, sorted(self._absent - set(wanted))
