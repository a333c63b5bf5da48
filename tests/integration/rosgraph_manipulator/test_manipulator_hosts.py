"""Manipulator and launchers on two hosts, one of which is a network namespace."""

from pathlib import Path

from helpers.other_host import other_host, run_rostest

FILE = Path(__file__).parent / "hosts" / "hosts.test"


def test_functions_over_two_hosts(tmp_path):
    with other_host() as host:
        run_rostest(FILE, host, tmp_path, ROS_IP=host.here)
