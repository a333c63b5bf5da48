"""Manipulator and launchers on two hosts, one of which is a network namespace."""

from pathlib import Path

import pytest
from helpers.other_host import other_host, run_rostest

FOLDER = Path(__file__).parent


@pytest.mark.parametrize("name", ["hosts", "changes"])
def test_functions_over_two_hosts(name, tmp_path):
    with other_host() as host:
        run_rostest(FOLDER / f"{name}.test", host, tmp_path, ROS_IP=host.here)
