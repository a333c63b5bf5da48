"""The command `info`."""

from __future__ import annotations

from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import click

from metacontrol_bags.bag_file import BagFile
from metacontrol_bags.cli.output import BAGS, JSON, of_each, show_json, show_table, tell_problems

_WALL_CLOCK = 1e9
"""Stamps in s from this on are dates; those of simulated time are not."""


@click.command()
@BAGS
@JSON
def info(bags: tuple[Path, ...], as_json: bool) -> None:
    """Tell size, duration, topics and types of each BAG, of any robot."""
    found, status = of_each(bags, _told)
    if as_json:
        show_json(found)
    else:
        for told in found:
            _show(told)
    raise click.exceptions.Exit(status)


def _told(path: Path) -> dict[str, Any]:
    with BagFile(path) as bag:
        bag.scan()
    first, last = (None if stamp is None else stamp * 1e-9 for stamp in (bag.first, bag.last))
    duration = None if first is None or last is None else last - first
    topics: dict[tuple[str, str], Counter[str]] = {}
    for connection in bag.connections.values():
        topics.setdefault((connection.topic, connection.type), Counter())[connection.publisher] += bag.counts[
            connection.id
        ]
    problems = bag.problems + ([] if bag.counts.total() else ["it holds no messages"])
    tell_problems(path, problems)
    return {
        "bag": str(path),
        "size_bytes": bag.size,
        "closed": bag.is_closed,
        "first_s": first,
        "last_s": last,
        "duration_s": duration,
        "messages": bag.counts.total(),
        "topics": [
            {
                "topic": topic,
                "type": kind,
                "messages": counts.total(),
                "rate_hz": round(counts.total() / duration, 3) if duration else None,
                "publishers": sorted(filter(None, counts)),
            }
            for (topic, kind), counts in sorted(topics.items())
        ],
        "problems": problems,
    }


def _show(told: dict[str, Any]) -> None:
    rows = [
        ["", ""],
        ["size", f"{told['size_bytes'] / 1e6:.1f} MB"],
        ["closed", "yes" if told["closed"] else "no"],
        ["first message", _moment(told["first_s"])],
        ["last message", _moment(told["last_s"])],
        ["duration", "-" if told["duration_s"] is None else f"{told['duration_s']:.2f} s"],
        ["messages", str(told["messages"])],
    ]
    show_table(rows, told["bag"])
    topics = [
        [
            entry["topic"],
            entry["type"],
            str(entry["messages"]),
            "-" if entry["rate_hz"] is None else f"{entry['rate_hz']:.2f}",
        ]
        for entry in told["topics"]
    ]
    if topics:
        show_table([["topic", "type", "messages", "Hz"], *topics])


def _moment(stamp: float | None) -> str:
    if stamp is None:
        return "-"
    if stamp < _WALL_CLOCK:
        return f"{stamp:.2f} s"
    return datetime.fromtimestamp(stamp, UTC).isoformat(" ", "milliseconds")
