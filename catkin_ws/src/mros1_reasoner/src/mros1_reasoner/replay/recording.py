"""A reasoner's data from a bag, as plain data; `io.reasoner_bag` reads them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from metacontrol_bags.decision import Decision
from node_kit.one_line import OneLineError

from mros1_reasoner.loop.entries import ActiveFact, Entry


class RecordingError(OneLineError):
    """A bag can't be used; one line that names it and says what to do."""


@dataclass
class Run:
    """One life of a reasoner, from its journal.

    Attributes:
        name: beginning of its decisions' ids.
        parameters: of the node.
        files: text of the ontologies that it loaded, by path.
        first: number of the first entry; more than 0 where the reasoner had forgotten older ones.
        entries: of its journal, from its start where the bag has the beginning.
    """

    name: str
    parameters: dict[str, Any] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    first: int = 0
    entries: list[Entry] = field(default_factory=list)


@dataclass(frozen=True)
class Statuses:
    """A DiagnosticArray: when it was recorded, its own stamp, and its statuses."""

    now: float
    stamp: float
    statuses: tuple[Any, ...]


@dataclass
class Recording:
    """The data of one reasoner in a bag; times are s of ROS time.

    Attributes:
        start: of the bag.
        runs: by the journal; empty where the bag has none.
        decisions: every message, with when it was recorded.
        diagnostics: the robot's own on /diagnostics, and `active`, what ran: read only where there is no journal.
    """

    start: float = 0.0
    runs: list[Run] = field(default_factory=list)
    decisions: list[tuple[float, Decision]] = field(default_factory=list)
    diagnostics: list[Statuses] = field(default_factory=list)
    active: list[tuple[float, ActiveFact]] = field(default_factory=list)
