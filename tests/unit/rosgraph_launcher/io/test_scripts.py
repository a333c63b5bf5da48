"""Looking for shell scripts, also in a moment without descriptors."""

import errno

import pytest
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.io import scripts


def refuse(*_):
    raise OSError(errno.EMFILE, "Too many open files")


@pytest.fixture
def script(tmp_path, monkeypatch):
    path = tmp_path / "work.sh"
    path.write_text("#!/bin/sh\nsleep 1000\n")
    monkeypatch.setattr(scripts, "command_line", lambda _node: ([str(path)], 0))
    scripts._read_script.cache_clear()
    yield str(path)
    scripts._read_script.cache_clear()


def test_script_is_known_again_when_there_are_descriptors(script, monkeypatch):
    with monkeypatch.context() as moment:
        moment.setattr("builtins.open", refuse)
        assert scripts._shell_script("p", "work.sh") == ""
    assert scripts._shell_script("p", "work.sh") == script


def test_no_script_is_at_work_while_the_processes_cannot_be_seen(script, monkeypatch):
    monkeypatch.setattr(scripts.psutil, "process_iter", refuse)
    assert not scripts.script_is_at_work(NodeDescription("/n", "/", "p", "work.sh"), "mark")
