"""File descriptors that tell the end of processes (pidfd_open(2), Linux 5.3); Python 3.8 has no os.pidfd_open."""

from __future__ import annotations

import ctypes
import os

_SYSTEM_CALL = 434  # of pidfd_open, on every architecture but alpha: include/uapi/asm-generic/unistd.h of Linux


def open_pidfd(pid: int) -> int:
    """Return a file descriptor that becomes readable when a process ends.

    Raises:
        OSError: the system refuses; ProcessLookupError: there is no such process.
    """
    of_python = getattr(os, "pidfd_open", None)  # from Python 3.9 on
    return int(of_python(pid)) if of_python else open_by_system_call(pid)


def open_by_system_call(pid: int) -> int:
    """Do the same without Python's own function."""
    descriptor = int(ctypes.CDLL(None, use_errno=True).syscall(_SYSTEM_CALL, pid, 0))
    if descriptor < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))
    return descriptor
