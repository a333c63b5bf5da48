"""A node whose input can't be used: in a process of its own."""

import os
import subprocess
import sys

import pytest
from helpers.waiting import DEADLINE_S

NODE = """
import sys
from node_kit.ros import lifetime

lifetime.TRIES_AGAIN = float(sys.argv[1])
with lifetime.Lifetime("mixer", ValueError) as life:
    if sys.argv[2] == "input":
        raise ValueError("no valve 3 in plant.yaml: name one of 1, 2")
    raise lifetime._StartError("Failed to initialize time")
"""


def ended(tries_again: float, why: str, **environment: str) -> tuple[int, list[str]]:
    """Return the exit status of a node that can't start, and its lines."""
    done = subprocess.run(
        [sys.executable, "-c", NODE, str(tries_again), why],
        env={**os.environ, **environment},
        stderr=subprocess.PIPE,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )
    return done.returncode, done.stderr.splitlines()


def test_node_that_roslaunch_starts_again_says_what_to_mend_and_ends_later():
    status, lines = ended(0.5, "input", NODE_KIT_STAYS="true")
    assert (status, lines) == (
        2,
        ["mixer: no valve 3 in plant.yaml: name one of 1, 2", "mixer: mend that; it tries again in 0.5 s"],
    )


@pytest.mark.parametrize(("why", "environment"), [("input", {}), ("master", {"NODE_KIT_STAYS": "true"})])
def test_node_ends_at_once_if_nobody_starts_it_again_or_the_master_was_in_trouble(why, environment):
    status, lines = ended(1e6, why, **environment)
    assert (status, len(lines)) == (2, 1)
