"""What tests of processes share."""

import subprocess
import sys

import pytest

ATTACH = """
import ctypes, os, sys
PTRACE_ATTACH, SIGSTOP = 16, 19
failed = ctypes.CDLL(None, use_errno=True).ptrace(PTRACE_ATTACH, int(sys.argv[1]), 0, 0)
print("refused" if failed else "attached", flush=True)
sys.stdin.read()
"""


class Debugger:
    """Attaches to a process, which can't be reaped from then on until the debugger ends."""

    def __init__(self):
        self._process = None

    def __call__(self, pid):
        words = [sys.executable, "-c", ATTACH, str(pid)]
        self._process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self._process.stdout.readline().strip() != "attached":
            pytest.skip("this user may not attach to processes (kernel.yama.ptrace_scope)")

    def end(self):
        if self._process:
            self._process.communicate("")
            self._process = None


@pytest.fixture
def debugger():
    found = Debugger()
    yield found
    found.end()
