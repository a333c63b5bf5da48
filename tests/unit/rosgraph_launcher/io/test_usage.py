"""What processes use, as it is read."""

import errno
import os
import subprocess
import sys

from rosgraph_launcher.io import usage
from rosgraph_launcher.io.usage import read_sample


def test_children_count_unless_the_node_stands_alone():
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        assert len(read_sample(os.getpid()).uses) > 1
        assert len(read_sample(os.getpid(), with_children=False).uses) == 1
    finally:
        child.communicate(b"\n")


def test_process_that_has_ended_and_number_of_none_are_left_out():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert read_sample(child.pid) is None
    assert read_sample(-1) is None


def test_process_is_left_out_while_no_descriptor_is_left(monkeypatch):
    def refuse(*_):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(usage.psutil.Process, "create_time", refuse)
    assert read_sample(os.getpid()) is None
