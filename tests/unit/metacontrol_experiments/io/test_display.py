"""What a mission shows."""

import os
import subprocess
import sys

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


@pytest.fixture
def unread(monkeypatch):
    """A pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        monkeypatch.setattr(display, "CONSOLE", display.LastingConsole(file=pipe, force_terminal=False))
        yield pipe


def test_mission_goes_on_when_nobody_reads_what_it_shows(unread):
    with display.Display() as shown:
        shown.say("starting")
        shown.entry(Entry(1.0, "R1", "laser lost", bad=True))
        shown.show(Table())
    unread.write("more")
    unread.flush()


def test_command_goes_on_when_nobody_reads_its_lines(unread):
    display.tell("1 of 2 is done")
    display.tell("2 of 2 are done")


def test_program_whose_output_nobody_reads_ends_well():
    code = (
        "from metacontrol_experiments.io.display import Display\n"
        "with Display() as shown:\n    input()\n    shown.say('one')\n    shown.say('two')\nprint('three')"
    )
    command = [sys.executable, "-c", code]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        process.stdout.close()
        process.stdin.write("go on\n")
        process.stdin.close()
        assert (process.wait(), process.stderr.read()) == (0, "")
