"""The command ./mros, where nothing is set up."""

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
