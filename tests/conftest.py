"""Shared settings of all tests."""

import os
import sys
from pathlib import Path

from hypothesis import HealthCheck, settings

HERE = str(Path(__file__).parent)

# For `helpers`, here and in the nodes that tests start.
sys.path.insert(0, HERE)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (HERE, os.environ.get("PYTHONPATH"))))

# No test fails because the machine is slow.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

_ORDER = ("system", "integration", "unit")
"""Whole missions begin first, one after the other on the first worker: several at once would be too much for 2 cores.
The others take tests from the end of what is left, so that no worker is left with a mission."""
_WITHOUT_MISSIONS = ("test_installed.py", "test_models_of_d2.py", "test_pyramid.py", "test_report.py")
"""Tests of the system that the other workers may take, too: they start no mission on ROS."""


def pytest_collection_modifyitems(items):
    """Have long tests begin first."""
    items.sort(key=lambda item: (_place(item), item.path.name != "test_engines.py"))


def _place(item):
    folder = item.path.relative_to(HERE).parts[0]
    if item.path.name in _WITHOUT_MISSIONS:
        folder = "integration"
    return _ORDER.index(folder) if folder in _ORDER else len(_ORDER)
