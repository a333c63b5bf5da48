"""What processes use, as it is read."""

import errno
import os
import subprocess
import sys
from contextlib import contextmanager

import psutil
from rosgraph_launcher.io import usage
from rosgraph_launcher.io.usage import read_samples

ME = os.getpid()


@contextmanager
def grandchild():
    """Have a process that has a child, and yield the ids of both."""
    code = "import subprocess, sys; p = subprocess.Popen(['cat']); print(p.pid, flush=True); input(); p.terminate()"
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield child.pid, int(child.stdout.readline())
    finally:
        child.communicate("\n")


def ids(sample):
    return {pid for pid, _ in sample.uses}


def test_descendants_count_unless_the_node_stands_alone():
    with grandchild() as (child, cat):
        samples = read_samples([ME, child, cat], [child])
        assert {child, cat} < ids(samples[ME])
        assert ids(samples[child]) == {child}
        assert ids(samples[cat]) == {cat}


def test_process_that_has_ended_and_number_of_none_are_left_out():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert read_samples([child.pid, -1, 0, 2**31 - 1]) == {}


def test_process_is_left_out_while_no_descriptor_is_left(monkeypatch):
    def refuse(*_):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(psutil.Process, "create_time", refuse)
    assert read_samples([ME]) == {}


def test_nothing_is_told_while_the_table_of_processes_cannot_be_read(monkeypatch):
    def refuse():
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(usage.psutil, "pids", refuse)
    assert read_samples([ME]) == {}


def test_each_process_is_read_once_whatever_is_asked(monkeypatch):
    read, look = [], usage._read
    monkeypatch.setattr(usage, "_read", lambda process: read.append(process.pid) or look(process))
    with grandchild() as (child, cat):
        read_samples([ME, child, cat] * 1000)
    assert len(read) == len(set(read))


def test_child_of_an_id_that_was_used_before_is_none(monkeypatch):
    with grandchild() as (child, cat):
        monkeypatch.setattr(
            psutil.Process, "create_time", lambda self: 2.0 if self.pid == child else 1.0 if self.pid == cat else 0.0
        )
        assert ids(read_samples([child])[child]) == {child}
