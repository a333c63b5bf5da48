"""A bag of a reasoner's journal, as good as its readers want it."""

from __future__ import annotations

from pathlib import Path

import yaml
from helpers.mission_bags import BagBuilder
from metacontrol_msgs.msg import JournalEntry, ReasonerJournal

MODEL = Path(__file__).resolve().parents[2] / "examples/talker_listener/models/talker_listener.owl"
PARAMETERS = {"model_file": str(MODEL), "reasoner": "rules", "utility": "power", "nfr_freshness": 0.2}
ENTRIES = (
    ("active", ("f_talk", "fast", "STABLE")),
    ("level", ("freshness", "0.1", "", "1.0")),
    ("component", ("talker", "FALSE", "1.5", "dead")),
    ("step", ("1",)),
    ("pause", ()),
    ("set_nfr", ("", "power", "3.0")),
    ("resume", ()),
)


def journal(first: int = 0, *, begins: bool = True) -> ReasonerJournal:
    """Return a message of a journal."""
    return ReasonerJournal(
        name="reasoner-1",
        parameters=yaml.safe_dump(PARAMETERS) if begins else "",
        files=[str(MODEL)] if begins else [],
        contents=[MODEL.read_text()] if begins else [],
        first=first,
        entries=[JournalEntry(1.0 + n, kind, list(values)) for n, (kind, values) in enumerate(ENTRIES)],
    )


def write_journal(path: Path) -> None:
    """Write a bag with two messages of a journal, and what the monitor and the manipulator said."""
    bag = BagBuilder()
    bag.add(1.0, "/mros1_reasoner/journal", journal())
    bag.add(9.0, "/mros1_reasoner/journal", journal(len(ENTRIES), begins=False))
    bag.configuration(0.5, "fast", "STABLE")
    bag.diagnostic(2.0, "QA status", "freshness", 0.1)
    bag.decision(3.0, "DECIDED", "qa:freshness", change=("fast", "frugal"))
    bag.write(path)
