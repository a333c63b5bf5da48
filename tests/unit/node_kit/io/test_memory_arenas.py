"""How many arenas the threads of a process have, by what malloc_info(3) of glibc tells."""

import subprocess
import sys

import pytest
from node_kit.io import memory_arenas

THREADS = """
import ctypes, threading

{begin}
c = ctypes.CDLL(None)
c.fdopen.restype = ctypes.c_void_p
all_are_there = threading.Barrier(12)

def work():
    c.malloc(ctypes.c_size_t(1000))
    all_are_there.wait()

threads = [threading.Thread(target=work) for _ in range(12)]
for one in threads:
    one.start()
for one in threads:
    one.join()
output = ctypes.c_void_p(c.fdopen(1, b"w"))
c.malloc_info(0, output)
c.fflush(output)
"""


def arenas(begin):
    """Return how many arenas a process has in which twelve threads have taken memory at once."""
    words = [sys.executable, "-c", THREADS.format(begin=begin)]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.count("<heap nr=")


@pytest.mark.parametrize(
    "begin",
    [
        "from node_kit.io.memory_arenas import limit_arenas; limit_arenas()",
        "from node_kit.ros.lifetime import Lifetime; Lifetime('camera')",
    ],
)
def test_threads_share_two_arenas(begin):
    assert arenas("") > memory_arenas.ARENAS
    assert arenas(begin) == memory_arenas.ARENAS


def test_other_libraries_have_none(monkeypatch):
    monkeypatch.setattr(memory_arenas.ctypes, "CDLL", lambda name: object())
    memory_arenas.limit_arenas()
