"""Shared settings of all tests."""

import os
import sys
from pathlib import Path

HERE = str(Path(__file__).parent)

# For `helpers`, here and in the nodes that tests start.
sys.path.insert(0, HERE)
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (HERE, os.environ.get("PYTHONPATH"))))
