"""Pellet's process starts from an archive of its classes, and without one that fits."""

import shutil

import pytest
from mros1_reasoner.knowledge.model import Facts
from mros1_reasoner.pellet import class_archive, process
from mros1_reasoner.pellet.process import PelletReasoner
from mros1_reasoner.pellet.spawning import ARCHIVE
from reasoner_helpers import OBJECTIVE


@pytest.fixture
def jars(tmp_path, monkeypatch):
    """Return a folder with the jars, and nothing else."""
    for path in process.jar_folder().glob("*.jar"):
        shutil.copy(path, tmp_path)
    monkeypatch.setattr(process, "jar_folder", lambda: tmp_path)
    return tmp_path


def unrealisable(knowledge_base):
    reasoner = PelletReasoner()
    try:
        first = reasoner.pid
        reasoner.load(knowledge_base.ontology)
        found = knowledge_base.analyse(Facts((OBJECTIVE,), components={"laser": "FALSE"}), reasoner).unrealisable
        assert reasoner.pid == first
        return set(found), (files_of(first) & {ARCHIVE}) if first else set()
    finally:
        reasoner.close()


def files_of(pid):
    """Return the names of the files that a process has mapped."""
    with open(f"/proc/{pid}/maps") as maps:
        return {line.split()[-1].rpartition("/")[2] for line in maps}


def test_archive_is_made_and_used(jars, knowledge_base, capsys):
    without, mapped = unrealisable(knowledge_base)
    assert not mapped
    class_archive.main()
    assert capsys.readouterr().out == f"{jars / ARCHIVE}\n"
    assert [path.name for path in jars.glob("*.jsa*")] == [ARCHIVE]
    assert unrealisable(knowledge_base) == (without, {ARCHIVE})


def test_archive_that_does_not_fit_changes_nothing(jars, knowledge_base):
    (jars / ARCHIVE).write_bytes(b"no archive" * 1000)
    found, _ = unrealisable(knowledge_base)
    assert len(found) == 3


def test_archive_that_cannot_be_made_is_told(monkeypatch, tmp_path):
    monkeypatch.setattr(process, "jar_folder", lambda: tmp_path / "gone")
    with pytest.raises(SystemExit, match="no archive of Pellet's classes"):
        class_archive.main()
