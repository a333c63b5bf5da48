"""Limits in place of those that were given while a bag was recorded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mros1_reasoner.loop.entries import AddObjective, Entry, Pursue, SetNfr


def with_limits(entries: Sequence[Entry], limits: Mapping[str, float]) -> tuple[list[Entry], list[str]]:
    """Return the entries of a journal with other limits, and in words what is no longer as it was recorded.

    Args:
        entries: of the journal.
        limits: by name, for all objectives.
    """
    kept, told = [], []
    for item in entries:
        match item.content:
            case SetNfr(_, name, limit) if name in limits:
                told.append(f"{item.now:.3f} s: set_nfr {name} {limit:g}: the limit is {limits[name]:g} now")
                continue
            case AddObjective() | Pursue() as asked if limits.keys() & asked.limits.keys():
                others = {name: limits.get(name, limit) for name, limit in asked.limits.items()}
                for name in sorted(limits.keys() & asked.limits.keys()):
                    old = asked.limits[name]
                    told.append(f"{item.now:.3f} s: {name} {old:g} of {asked.name}: the limit is {limits[name]:g} now")
                item = replace(item, content=replace(asked, limits=others))  # noqa: PLW2901
        kept.append(item)
    return kept, told
