"""The end of a process, by a file descriptor."""

import os
import select
import subprocess

import pytest
from rosgraph_launcher.io.pidfds import open_by_system_call, open_pidfd


@pytest.fixture(params=[open_pidfd, open_by_system_call])
def opener(request):
    return request.param


def is_readable(descriptor, timeout):
    return bool(select.select([descriptor], [], [], timeout)[0])


def test_descriptor_is_readable_when_the_process_has_ended(opener):
    process = subprocess.Popen(["/bin/cat"], stdin=subprocess.PIPE)
    descriptor = opener(process.pid)
    try:
        assert not is_readable(descriptor, 0)
        process.communicate()
        assert is_readable(descriptor, 30)
    finally:
        os.close(descriptor)


def test_process_that_is_gone_is_an_error(opener):
    process = subprocess.Popen(["/bin/true"])
    process.wait()
    with pytest.raises(ProcessLookupError):
        opener(process.pid)


def test_descriptor_is_not_passed_on(opener):
    descriptor = opener(os.getpid())
    try:
        assert not os.get_inheritable(descriptor)
    finally:
        os.close(descriptor)


def test_python_without_its_own_function_takes_the_system_call(monkeypatch):
    monkeypatch.delattr(os, "pidfd_open")
    os.close(open_pidfd(os.getpid()))
