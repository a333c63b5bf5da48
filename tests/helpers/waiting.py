"""Waiting for conditions: a test never sleeps for a time that should do."""

import time

DEADLINE_S = 150
"""Generous: the machine may be at other work, too."""


def wait_for(condition, what, deadline=DEADLINE_S):
    """Wait, at most until the deadline, until the condition holds; return what it gave."""
    until = time.monotonic() + deadline
    while not (found := condition()):
        if time.monotonic() > until:
            raise AssertionError(f"not within {deadline:g} s: {what}")
        time.sleep(0.02)
    return found
