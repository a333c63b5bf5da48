"""The command that runs histories for hours."""

import itertools
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers.soaking import ROOT
from simulated import soak
from simulated.tally import Tally, quantile

SHORT = "0.0002"
OPENED = """
import os, sys
opened = set()
sys.addaudithook(lambda event, about: opened.add(about[0]) if event == "open" else None)
sys.dont_write_bytecode = True
from simulated import soak
from simulated.history import History, run
for name in soak.systems.NAMES:
    run(History(1, name, ()))
files = {getattr(module, "__file__", None) for module in sys.modules.values()} | opened
print(*(os.path.realpath(file) for file in files if isinstance(file, str)), sep="\\n")
"""


def run(tmp_path, *arguments):
    return soak.main(["--simulated", "--output", str(tmp_path), *arguments])


def state(tmp_path):
    (path,) = tmp_path.glob("*/state.json")
    return Tally.read(path)


def test_second_run_goes_on_where_the_first_one_was(tmp_path, capsys, monkeypatch):
    clock = itertools.count(step=0.5)  # each history takes 0.5 s, on a busy machine, too
    monkeypatch.setattr(soak, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    assert run(tmp_path, "--hours", SHORT, "--seed", "7") == 0
    first = state(tmp_path)
    assert run(tmp_path, "--hours", "0.0004", "--seed", "7") == 0
    second = state(tmp_path)
    assert (second.first_seed, first.first_seed) == (7, 7)
    assert second.histories > first.histories > 0 and second.steps > first.steps
    assert f"{second.histories:,} histories (seeds 7 to {second.next_seed - 1})" in capsys.readouterr().out


def test_interruption_keeps_what_was_done(tmp_path, monkeypatch):
    real, count = soak.run, iter(range(100))

    def interrupted(told):
        if next(count) == 3:
            raise KeyboardInterrupt
        return real(told)

    monkeypatch.setattr(soak, "run", interrupted)
    assert run(tmp_path, "--hours", "1") == 130
    assert state(tmp_path).histories == 3


def test_history_that_fails_is_shrunk_and_kept(tmp_path, monkeypatch):
    real = soak.run

    def fails(told):
        outcome = real(told)
        outcome.broken = ["all is lost"]
        return outcome

    monkeypatch.setattr(soak, "run", fails)
    monkeypatch.setattr(soak, "shrink", lambda told: told)
    assert run(tmp_path, "--hours", "0.000001") == 1
    (text,) = (path.read_text() for path in tmp_path.glob("*/failed-0.py"))
    assert "# all is lost" in text


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--hours", "-1"], "argument --hours: invalid number of hours value: '-1'"),
        (["--hours", "1", "--seed", "x"], "argument --seed: invalid seed value: 'x'"),
        ([], "the following arguments are required: --hours"),
    ],
)
def test_bad_option_is_refused_in_one_line(tmp_path, capsys, arguments, line):
    with pytest.raises(SystemExit) as ended:
        run(tmp_path, *arguments)
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"mros: soak: {line}\n"


def test_state_of_another_form_is_refused_in_one_line(tmp_path, capsys):
    run(tmp_path, "--hours", "0.000001")
    (path,) = tmp_path.glob("*/state.json")
    path.write_text("[]")
    capsys.readouterr()
    with pytest.raises(SystemExit):
        run(tmp_path, "--hours", "1")
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "delete it" in error


def test_figures_are_of_all_files_that_a_history_needs():
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'tests'}:{os.environ['PYTHONPATH']}"}
    done = subprocess.run([sys.executable, "-c", OPENED], env=environment, capture_output=True, check=True, text=True)
    code, others = [ROOT / place for place in soak.CODE], [ROOT / ".venv", ROOT / "catkin_ws/devel"]
    own = {file for file in map(Path, done.stdout.splitlines()) if file.is_file() and file.is_relative_to(ROOT)}
    assert {ROOT / "tests/helpers/soaking.py", ROOT / "tests/simulated/orchard/metacontrol.yaml"} <= own
    assert not {file for file in own if not any(file.is_relative_to(place) for place in (*code, *others))}


def test_quantiles_are_times_that_were_seen():
    times = {"0.5": 90, "10.0": 9, "60.0": 1}
    assert [quantile(times, share) for share in (0.5, 0.95, 1.0)] == [0.5, 10.0, 60.0]
