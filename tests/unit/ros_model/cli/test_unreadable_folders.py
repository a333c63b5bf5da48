"""Folders that may not be listed are told, not passed over; files that may not be written are not said to be."""

import contextlib
import os
import shutil
import tempfile
from pathlib import Path

import pytest
from ros_model.cli.rosmodel import main

NOBODY = 65534
FAULTY = "RosSystem { Name bad TopicConnections { TopicConnection t { From ( 'a.b' ) To ( 'c.d' ) } } }\n"


@pytest.fixture
def folder(monkeypatch):
    """A working folder with a model, and a folder `closed` that can't be listed; others than its owner may enter."""
    path = Path(tempfile.mkdtemp())
    path.chmod(0o755)
    (path / "bad.rossystem").write_text(FAULTY)
    (path / "closed").mkdir(mode=0)
    monkeypatch.chdir(path)
    yield path
    shutil.rmtree(path)


@contextlib.contextmanager
def without_privileges():
    """Run without the rights of root, which may list any folder."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.mark.parametrize("arguments", [["check", "."], ["format", "--check", "."]])
def test_folder_that_can_not_be_listed_is_told(folder, capsys, arguments):
    with without_privileges(), pytest.raises(SystemExit) as done:
        main(arguments)
    told = "".join(capsys.readouterr())
    assert done.value.code == 2
    assert "closed: Permission denied" in told
    assert "bad.rossystem" in told


def test_hidden_folder_is_passed_over(folder, capsys):
    (folder / "closed").rename(folder / ".closed")
    with without_privileges(), pytest.raises(SystemExit) as done:
        main(["format", "--check", "."])
    assert (done.value.code, capsys.readouterr().out) == (1, "would change bad.rossystem\n")


def test_file_that_can_not_be_written_is_not_told_as_changed(folder, capsys):
    (folder / "bad.rossystem").chmod(0o444)
    with without_privileges(), pytest.raises(SystemExit) as done:
        main(["format", "bad.rossystem"])
    told = capsys.readouterr()
    assert (done.value.code, told.out) == (2, "")
    assert told.err == "rosmodel: bad.rossystem: Permission denied: check its permissions\n"
