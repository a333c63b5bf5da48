"""Waiting for conditions: a test never sleeps for a time that should do."""

import time

DEADLINE_S = 150
"""Generous: the machine may be at other work, too."""


def wait_for(condition, what, deadline=DEADLINE_S):
    """Wait, at most until the deadline, until the condition holds; return what it gave.

    Args:
        condition: is called again and again.
        what: is told where it does not hold in time; a function is called then, so that it tells the last state.
        deadline: s.
    """
    until = time.monotonic() + deadline
    while not (found := condition()):
        if time.monotonic() > until:
            raise AssertionError(f"not within {deadline:g} s: {what() if callable(what) else what}")
        time.sleep(0.02)
    return found


def wait_for_equal(look, expected, what=""):
    """Wait until a look finds what is expected, and nothing else; the error has the last look."""
    last = []

    def is_equal():
        last[:] = [look()]
        return last[0] == expected

    wait_for(is_equal, lambda: f"{what}: {last[0]!r} becomes {expected!r}")
