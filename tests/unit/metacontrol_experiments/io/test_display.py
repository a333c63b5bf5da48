"""What a mission shows."""

import pytest
from metacontrol_bags.timeline import Entry
from metacontrol_experiments.io import display
from rich.console import Console
from rich.table import Table


class FullDisk:
    """A file whose disk is full."""

    def write(self, text):
        raise OSError(28, "No space left on device")

    def flush(self):
        pass


@pytest.fixture
def shown(monkeypatch):
    monkeypatch.setattr(display, "CONSOLE", Console(file=FullDisk(), force_terminal=False))
    with pytest.raises(OSError, match="No space"):
        display.tell("this is how it was")
    return display.Display()


def test_mission_goes_on_when_what_it_shows_meets_a_full_disk(shown):
    with shown:
        shown.say("starting")
        shown.entry(Entry(1.0, "R1", "laser lost", bad=True))
        shown.progress(0.5, 2.0, "3 m")
        shown.show(Table())
