"""Shared settings of all tests."""

import os
import sys
from itertools import groupby
from pathlib import Path

from hypothesis import HealthCheck, settings

HERE = str(Path(__file__).parent)

# For `helpers`, here and in the nodes that tests start.
sys.path.insert(0, HERE)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (HERE, os.environ.get("PYTHONPATH"))))

# Tests start thousands of processes that import numpy. Its threads, which nobody needs here, cost 20 ms each time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# No test fails because the machine is slow.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

_FOLDERS = ("system", "integration", "unit")
_WITHOUT_MISSIONS = ("test_installed.py", "test_models_of_d2.py", "test_pyramid.py", "test_report.py")
"""Tests of the system that need not be driven one after the other: they start no mission on ROS."""
_LONG = ("test_engines.py", "test_api_reference.py")
"""Begin before others of their folder."""


def pytest_collection_modifyitems(config, items):
    """Put tests into an order in which several workers are done at about the same time.

    A worker begins with an equal part of the list; who has none left takes from the end of another part. So each part
    begins with what is long. Whole missions begin the first one: several at once would be too much for 2 cores. Others
    begin with tests on ROS, which mostly wait; and one, where there are enough, with tests that only compute.
    """
    items.sort(key=lambda item: item.path.name not in _LONG)
    missions, on_ros, rest = ([item for item in items if _folder(item) == folder] for folder in _FOLDERS)
    workers = getattr(config, "workerinput", {}).get("workercount", 1)
    heads = [missions, *([] for _ in range(workers - 1))]
    with_ros = heads[1:-1] or heads[-1:]
    for number, (_, group) in enumerate(groupby(on_ros, key=_together)):
        with_ros[number % len(with_ros)] += group
    items[:] = [item for part in _parts(heads, rest) for item in part]


def _parts(heads, rest):
    """Yield equal parts of all tests, in which those of the heads come first."""
    left = sum(map(len, heads)) + len(rest)
    begin = 0
    for number, head in enumerate(heads):
        size = left // (len(heads) - number)
        end = begin + max(0, size - len(head))
        yield [*head, *rest[begin:end]]
        left -= size
        begin = end


def _together(item):
    """Return what is the same for tests that one worker should take: they may share a fixture."""
    return item.nodeid if item.path.name == "test_rostest.py" else item.path


def _folder(item):
    """Return system, integration or unit: what a test needs."""
    folder = item.path.relative_to(HERE).parts[0]
    if item.path.name in _WITHOUT_MISSIONS:
        return "integration"
    return folder if folder in _FOLDERS else "unit"
