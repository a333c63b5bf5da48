"""Delta debugging: the fewest faults by which a history still fails, and the test that keeps it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from simulated.history import History, run


def shrink(told: History, fails: Callable[[History], bool] = lambda told: bool(run(told).broken)) -> History:
    """Return a history with a part of the faults that fails as well; without any one of them it does not.

    Args:
        told: a history that fails.
        fails: tells whether a history does.
    """
    size = max(1, len(told.faults) // 2)
    while size:
        position, found = 0, False
        while position < len(told.faults):
            fewer = replace(told, faults=told.faults[:position] + told.faults[position + size :])
            if fails(fewer):
                told, found = fewer, True
            else:
                position += size
        if not (found and size == 1):
            size //= 2
    return told


def as_test(told: History, broken: str) -> str:
    """Return the regression test of a history, ready for tests/unit/simulated/test_regressions.py."""
    first = broken.splitlines()[0] if broken else ""
    faults = "".join(f"        {fault},\n" for fault in told.faults)
    settings = f", Policy.{told.policy.name}" + (", starts_with_initial=True" if told.starts_with_initial else "")
    name = f"{told.system}_{told.seed}"
    return (
        f"def test_history_{name}():\n"
        f"    # {first}\n"
        f"    faults = (\n{faults}    )\n"
        f'    holds(History({told.seed}, "{told.system}", faults{settings}))\n'
    )
