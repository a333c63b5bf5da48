"""200 random requests in a row: no process left behind, no goal lost, descriptors and memory flat."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from metacontrol_experiments.io.processes import ProcessTree, reserved_port
from support.figures import entry

_REQUESTS = 200
_TESTS = Path(__file__).resolve().parents[1]
_TEST = "manipulator_changes_test.ChangesTest.test_many_random_requests_leave_nothing_behind_and_lose_no_goal"


def run() -> list[dict[str, Any]]:
    """Return the mean time of a request, s; it fails where the test does."""
    with reserved_port() as port, tempfile.TemporaryDirectory() as folder:
        own = {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_LOG_DIR": folder, "ROS_HOME": folder}
        tree = ProcessTree(own)
        try:
            tree.start(["roscore", "-p", str(port)], Path(folder) / "master.log")
            path = os.pathsep.join((str(_TESTS), os.environ["PYTHONPATH"]))
            began = time.monotonic()
            subprocess.run(
                [sys.executable, "-m", "unittest", _TEST],
                cwd=_TESTS / "integration" / "rosgraph_manipulator" / "changes",
                env={**os.environ, **own, "MROS_RANDOM_REQUESTS": str(_REQUESTS), "PYTHONPATH": path},
                check=True,
            )
            mean = (time.monotonic() - began) / _REQUESTS
        finally:
            tree.close()
    return [entry("reconfigure_random", mean, "s", _REQUESTS)]
