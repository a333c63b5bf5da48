"""The command that runs missions until enough faults have struck."""

import json
import os
import signal
import sys
from dataclasses import asdict

import pytest
from soak import command
from soak.records import Record, Struck, read


def record(number, *broken):
    struck = (Struck("KILL", "killed", 1.0), Struck("CPU", "taken", 0.0))
    return Record(number, "reached: goal reached", 60.0, 1.0, struck, broken)


@pytest.fixture
def drives(monkeypatch):
    """Missions that print a record at once; what is given is broken in all of them."""

    def make(*broken):
        def told(seed, number, folder):
            return [sys.executable, "-c", f"print({json.dumps(asdict(record(number, *broken)))!r})"]

        monkeypatch.setattr(command, "drive_command", told)

    return make


def run(tmp_path, *arguments):
    return command.main(["--output", str(tmp_path), *arguments])


def found_in(tmp_path):
    (folder,) = tmp_path.glob("real-*")
    return read(folder / "missions.jsonl")


def test_missions_are_run_until_enough_faults_have_struck(tmp_path, drives, capsys):
    drives()
    assert run(tmp_path, "--faults", "5", "--seed", "3", "--jobs", "2") == 0
    found = found_in(tmp_path)
    assert sorted(one.number for one in found) in ([0, 1, 2], [0, 1, 2, 3])
    assert f"{len(found)} missions of seed 3" in capsys.readouterr().out
    assert "missions of seed 3" in next(tmp_path.glob("real-*/report.md")).read_text()


def test_same_command_goes_on_where_it_was(tmp_path, drives):
    drives()
    assert run(tmp_path, "--faults", "2") == 0
    assert run(tmp_path, "--faults", "6") == 0
    assert [one.number for one in found_in(tmp_path)] == [0, 1, 2]


def test_something_broken_is_told(tmp_path, drives, capsys):
    drives("no two of one role: two move_base")
    assert run(tmp_path, "--faults", "1") == 1
    assert "mission 0: no two of one role: two move_base" in capsys.readouterr().err


def test_mission_without_a_record_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(command, "drive_command", lambda seed, number, folder: [sys.executable, "-c", "import nothing"])
    monkeypatch.setattr(command, "FAILURES", 2)
    assert run(tmp_path, "--faults", "1") == 1
    assert "the soak itself failed" in found_in(tmp_path)[0].broken[0]


def test_interruption_ends_the_mission_under_way(tmp_path, monkeypatch):
    waits = "import time\ntry:\n  time.sleep(600)\nexcept KeyboardInterrupt:\n  open('ended', 'w')"
    script = f"import os; os.chdir({str(tmp_path)!r}); open('begun', 'w'); exec({waits!r})"
    monkeypatch.setattr(command, "drive_command", lambda seed, number, folder: [sys.executable, "-c", script])

    def progress(self, wanted, seconds):
        if (tmp_path / "begun").exists():
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(command.Soak, "_progress", progress)
    assert run(tmp_path, "--faults", "1") == 130
    assert (tmp_path / "ended").exists() and found_in(tmp_path) == []


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--faults", "0"], "argument --faults: invalid number value: '0'"),
        (["--faults", "1", "--seed", "x"], "argument --seed: invalid seed value: 'x'"),
        ([], "the following arguments are required: --faults"),
    ],
)
def test_bad_option_is_refused_in_one_line(tmp_path, capsys, arguments, line):
    with pytest.raises(SystemExit) as ended:
        run(tmp_path, *arguments)
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"mros: soak: {line}\n"
