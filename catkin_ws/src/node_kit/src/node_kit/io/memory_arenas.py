"""How much memory the C library keeps for the threads of a process."""

from __future__ import annotations

import contextlib
import ctypes

ARENAS = 2
"""In these a process finds its memory. By default glibc takes up to eight for each processor core, one for some threads
each, and every one stays as large as it ever had to be."""

_ARENA_MAX = -8  # M_ARENA_MAX of mallopt(3), malloc.h of glibc; the same as MALLOC_ARENA_MAX in the environment


def limit_arenas() -> None:
    """Have all threads that begin from now on share a few arenas. Other C libraries than glibc have none."""
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_ARENA_MAX, ARENAS)
