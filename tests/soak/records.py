"""What is kept of each mission, one JSON line each, and the report of all."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median

from soak.plan import GROUPS, Kind


class RecordsError(Exception):
    """A file of records can't be used; the message names it and says why."""


@dataclass(frozen=True)
class Struck:
    """A fault that has struck, or was left out.

    Attributes:
        kind: its kind, by name.
        what: the fault in one line, with what it met.
        recovery: wall s until all was well again; None: not before the mission's end.
        left_out: why it could not strike; empty: it has.
    """

    kind: str
    what: str
    recovery: float | None = None
    left_out: str = ""


@dataclass(frozen=True)
class Record:
    """A mission that is over.

    Attributes:
        number: of the mission.
        outcome: how it ended: the mission's outcome, or what the command said.
        wall_s: how long it took.
        stretch: median of how much slower than alone the observer's work was.
        struck: its faults.
        broken: what was broken.
        memory: role -> memory at the end, MB.
        excuse: why it might fail; empty: it had to succeed.
    """

    number: int
    outcome: str
    wall_s: float
    stretch: float
    struck: tuple[Struck, ...]
    broken: tuple[str, ...]
    memory: dict[str, float] = field(default_factory=dict)
    excuse: str = ""


def write(path: Path, record: Record) -> None:
    """Add a record to a file."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(record)) + "\n")


def parsed(line: str) -> Record:
    """Return the record of a line.

    Raises:
        ValueError: it is none.
    """
    try:
        content = json.loads(line)
        content["struck"] = tuple(Struck(**one) for one in content["struck"])
        content["broken"] = tuple(content["broken"])
        return Record(**content)
    except (KeyError, TypeError) as error:
        raise ValueError(str(error)) from error


def read(path: Path) -> list[Record]:
    """Return the records of a file; none where there is none. A last line that was cut off is left out.

    Raises:
        RecordsError: it has another form.
    """
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    found = []
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        if not line.endswith("\n"):
            break
        try:
            found.append(parsed(line))
        except ValueError as error:
            raise RecordsError(f"{path}:{number}: no record of a mission ({error}): delete the folder") from error
    return found


def faults(records: Iterable[Record]) -> int:
    """Return how many faults have struck."""
    return sum(not struck.left_out for record in records for struck in record.struck)


def report(records: Sequence[Record], tree: str, seed: int) -> str:
    """Return the figures as a page in Markdown."""
    broken = [record for record in records if record.broken]
    hours = sum(record.wall_s for record in records) / 3600.0
    ended = Counter(record.outcome.split(":")[0] for record in records)
    stretch = median(record.stretch for record in records) if records else 1.0
    lines = [
        f"{len(records)} missions of seed {seed} on code {tree}, {faults(records)} faults, {hours:.2f} h",
        f"missions in which something was broken: {len(broken)}",
        f"ends: {', '.join(f'{name} {count}' for name, count in sorted(ended.items()))}",
        f"missions that had to succeed: {sum(not record.excuse for record in records)}",
        f"stretch of the observer's work, median of the missions: {stretch:.2f}",
        "",
        *_table(records),
        "",
        *_memory(records),
        "",
        *(f"- mission {record.number}: {what}" for record in broken for what in record.broken),
    ]
    return "\n".join(lines) + "\n"


def _table(records: Sequence[Record]) -> Iterable[str]:
    struck: dict[str, list[Struck]] = defaultdict(list)
    after: Counter[str] = Counter()
    for record in records:
        for one in record.struck:
            struck[one.kind].append(one)
        for kind in {one.kind for one in record.struck if not one.left_out}:
            after[kind] += bool(record.broken)
    yield "| fault | struck | left out | recovered | recovery, median (s) | p95 (s) | missions with something broken |"
    yield "|---|---|---|---|---|---|---|"
    for group, kinds in GROUPS.items():
        yield f"| **{group}** | | | | | | |"
        for kind in kinds:
            yield _row(kind, struck[kind.name], after[kind.name])


def _row(kind: Kind, struck: Sequence[Struck], broken: int) -> str:
    hit = [one for one in struck if not one.left_out]
    times = sorted(one.recovery for one in hit if one.recovery is not None)
    shown = f"{quantile(times, 0.5):.1f} | {quantile(times, 0.95):.1f}" if times else "- | -"
    return f"| {kind.value} | {len(hit)} | {len(struck) - len(hit)} | {len(times)} | {shown} | {broken} |"


def _memory(records: Sequence[Record]) -> Iterable[str]:
    """Yield how much memory the parts had at the end of the first and the last missions."""
    quarter = max(1, len(records) // 4)
    roles = sorted({role for record in records for role in record.memory})
    yield "| process | memory, first quarter of the missions (MB) | last quarter (MB) |"
    yield "|---|---|---|"
    for role in roles:
        ends = [record.memory[role] for record in records if role in record.memory]
        if len(ends) >= 2:
            yield f"| {role} | {median(ends[:quarter]):.0f} | {median(ends[-quarter:]):.0f} |"


def quantile(ordered: Sequence[float], share: float) -> float:
    """Return the value that a share of the ordered values does not exceed."""
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
