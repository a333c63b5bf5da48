"""A node on another host, whose link is cut."""

from pathlib import Path

from helpers.other_host import other_host, run_rostest

FILE = Path(__file__).parent / "hosts" / "hosts.test"


def test_node_on_another_host(tmp_path):
    with other_host() as host:
        run_rostest(FILE, host, tmp_path)
