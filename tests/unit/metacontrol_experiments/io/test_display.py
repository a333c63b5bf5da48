"""What a mission shows."""

import io
import os
import subprocess
import sys

import pytest
from metacontrol_bags.timeline import Entry
from metacontrol_experiments.io import display
from rich.table import Table


class Disk(io.StringIO):
    """A file on a disk that may be full."""

    full = False

    def write(self, text):
        if self.full:
            raise OSError(28, "No space left on device")
        return super().write(text)


@pytest.fixture
def disk(monkeypatch):
    disk = Disk()
    monkeypatch.setattr(display, "CONSOLE", display.LastingConsole(file=disk, force_terminal=False))
    return disk


def test_mission_goes_on_when_what_it_shows_meets_a_full_disk(disk):
    with display.Display() as shown:
        disk.full = True
        shown.say("starting")
        shown.entry(Entry(1.0, "R1", "laser lost", bad=True))
        shown.progress(0.5, 2.0, "3 m")
        shown.show(Table())
        display.tell("1 of 2 is done")
        disk.full = False
        display.tell("2 of 2 are done")
        shown.say("ended")
    assert disk.getvalue() == "2 of 2 are done\nended\n"


def test_command_whose_output_meets_a_full_disk_has_its_own_exit_status():
    code = (
        "import sys\n"
        "from metacontrol_experiments.cli import main\n"
        "from metacontrol_experiments.io.display import tell\n"
        "main.metacontrol = lambda **_: (tell('one'), tell('two'), sys.exit(1))\nmain.main()"
    )
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, env=environment, check=False)
    assert (done.returncode, done.stderr) == (1, b"")


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
