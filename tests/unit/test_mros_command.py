"""The command ./mros: its help, its shell, commands that are not there."""

import shutil
import subprocess
from pathlib import Path

import pytest

MROS = Path(__file__).parents[2] / "mros"


@pytest.mark.parametrize("arguments", [("demo", "--help"), ("demo", "manipulation", "-h"), ("--help",), ()])
def test_help_needs_no_set_up_and_starts_none(tmp_path, arguments):
    shutil.copy(MROS, tmp_path)
    done = subprocess.run([tmp_path / "mros", *arguments], capture_output=True, text=True, check=True, timeout=60)
    assert "./mros demo" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["mros"]


def test_shell_has_rosbash_and_completion():
    words = "roscd mros1_reasoner && basename $PWD; complete -p roslaunch rosmodel metacontrol; exit\n"
    done = subprocess.run([MROS, "shell"], input=words, capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout.split()[0] == "mros1_reasoner"
    assert [line.split()[-1] for line in done.stdout.splitlines()[1:]] == ["roslaunch", "rosmodel", "metacontrol"]


def test_unknown_command_is_told_in_one_line():
    done = subprocess.run([MROS, "run", "nosuchcommand"], capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (
        2,
        "mros: run: there is no command nosuchcommand in the project's environment\n",
    )
