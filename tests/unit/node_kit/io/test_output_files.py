"""Files are there whole, or as they were before."""

import os
import threading

import pytest
from node_kit.io.output_files import write_file


def test_new_file_has_the_permissions_that_the_process_gives(tmp_path):
    former = os.umask(0o027)
    try:
        write_file(tmp_path / "new", "ä")
    finally:
        os.umask(former)
    assert (tmp_path / "new").read_bytes() == "ä".encode()
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o640


def test_former_file_keeps_its_permissions(tmp_path):
    path = tmp_path / "own"
    path.write_text("old")
    path.chmod(0o600)
    write_file(path, b"new")
    assert path.read_text() == "new" and path.stat().st_mode & 0o777 == 0o600


def test_link_stays_one(tmp_path):
    (tmp_path / "far").mkdir()
    target, link = tmp_path / "far" / "file", tmp_path / "link"
    link.symlink_to(target)
    write_file(link, "new")
    assert link.is_symlink() and target.read_text() == "new"


def test_full_disk_leaves_what_was_there_and_nothing_else(tmp_path, monkeypatch):
    path = tmp_path / "kept"
    path.write_text("old")

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_file(path, "new")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_pipe_is_written_as_it_is(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    read = []
    reader = threading.Thread(target=lambda: read.append((tmp_path / "pipe").read_text()))
    reader.start()
    write_file(tmp_path / "pipe", "text")
    reader.join()
    assert read == ["text"] and (tmp_path / "pipe").is_fifo()
