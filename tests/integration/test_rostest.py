"""Runs the .test files of the folders here with rostest, each on a master of its own.

Those in folders `hosts` need another host: `test_*_hosts.py` runs them.
"""

import os
import signal
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
DEADLINE_S = 430
FILES = sorted(file for file in HERE.rglob("*.test") if file.parent.name != "hosts")


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.stem)
def test_rostest(file, tmp_path):
    environment = {**os.environ, "ROS_HOME": str(tmp_path), "ROS_LOG_DIR": str(tmp_path / "log")}
    environment.pop("ROS_MASTER_URI", None)
    process = subprocess.Popen(
        ["/usr/bin/rostest", str(file)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        output, _ = process.communicate(timeout=DEADLINE_S)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        try:
            output, _ = process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
        pytest.fail(f"{file.name} did not end within {DEADLINE_S} s\n{output[-6000:]}")
    results = "\n".join(path.read_text() for path in (tmp_path / "test_results").rglob("*.xml"))
    assert process.returncode == 0, f"{output[-6000:]}\n{results[-6000:]}"
