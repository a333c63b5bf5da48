"""Shared settings of all tests."""

import os
import sys
from pathlib import Path

import pytest

HERE = str(Path(__file__).parent)

# For `helpers`, here and in the nodes that tests start.
sys.path.insert(0, HERE)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (HERE, os.environ.get("PYTHONPATH"))))

_ORDER = ("system", "integration", "unit")
"""The folders with the longest tests come first, so that no worker is left with one at the end."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Have long tests begin first, and one worker run all tests of a module that share what they prepare."""
    items.sort(key=lambda item: (_place(item), item.path.name != "test_engines.py"))
    for item in items:
        fixtures = item._fixtureinfo.name2fixturedefs.values()
        if any(fixture.scope == "module" for found in fixtures for fixture in found):
            item.add_marker(pytest.mark.xdist_group(str(item.path)))


def _place(item):
    folder = item.path.relative_to(HERE).parts[0]
    return _ORDER.index(folder) if folder in _ORDER else len(_ORDER)
