"""What somebody has put into a bag or a message controls no terminal."""

import io
from dataclasses import MISSING, fields

from metacontrol_bags.decision import Decision
from metacontrol_bags.decision_tables import render
from metacontrol_bags.printable import all_printable
from rich.console import Console

BAD = "a\x1b[2J\x07b"


def test_all_texts_of_what_was_told_are_made_printable():
    assert all_printable({BAD: [1.5, (BAD, None, True)]}) == {"a\\x1b[2J\\x07b": (1.5, ("a\\x1b[2J\\x07b", None, True))}


def test_explained_decision_controls_no_terminal():
    of_type = {"str": BAD, "float": 1.0, "bool": False}
    needed = (f for f in fields(Decision) if f.default is MISSING and f.default_factory is MISSING)
    decision = Decision(**{field.name: of_type.get(str(field.type), ()) for field in needed})
    shown = io.StringIO()
    Console(file=shown).print(render(decision))
    assert "\\x1b[2J" in shown.getvalue() and "\x1b" not in shown.getvalue()
