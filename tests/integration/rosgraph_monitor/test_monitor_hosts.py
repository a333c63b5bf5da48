"""A node on another host: an address in a network namespace of this test's own, whose link is cut."""

import os
import subprocess
from pathlib import Path

import pytest

FILE = Path(__file__).parent / "hosts" / "hosts.test"
NETWORK = f"10.213.{os.getpid() % 250}"
"""One of many, since others may run this test on the same machine."""


def ip(*arguments):
    return subprocess.run(["/usr/sbin/ip", *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def other_host():
    """Make a namespace whose address NETWORK.2 is reached through a link; yield its name."""
    if not Path("/usr/sbin/ip").exists():
        pytest.skip("no network namespace: iproute2 is not installed")
    name, link = f"mros_{os.getpid()}", f"mros{os.getpid() % 100000}"
    made = ip("netns", "add", name)
    if made.returncode:
        pytest.skip(f"no network namespace: {made.stderr.strip()}")
    try:
        for arguments in (
            ("link", "add", link, "type", "veth", "peer", "name", "eth0", "netns", name),
            ("addr", "add", f"{NETWORK}.1/24", "dev", link),
            ("link", "set", link, "up"),
            ("-n", name, "addr", "add", f"{NETWORK}.2/24", "dev", "eth0"),
            ("-n", name, "link", "set", "eth0", "up"),
            ("-n", name, "link", "set", "lo", "up"),
        ):
            done = ip(*arguments)
            if done.returncode:
                pytest.skip(f"no link into the network namespace: {done.stderr.strip()}")
        yield name
    finally:
        ip("link", "del", link)
        ip("netns", "del", name)


def test_node_on_another_host(other_host, tmp_path):
    environment = os.environ | {
        "ROS_HOME": str(tmp_path),
        "ROS_LOG_DIR": str(tmp_path / "log"),
        "OTHER_HOST": other_host,
        "OTHER_ADDRESS": f"{NETWORK}.2",
        "THIS_ADDRESS": f"{NETWORK}.1",
    }
    environment.pop("ROS_MASTER_URI", None)
    done = subprocess.run(
        ["/usr/bin/rostest", str(FILE)], env=environment, capture_output=True, text=True, timeout=430, check=False
    )
    results = "\n".join(path.read_text() for path in (tmp_path / "test_results").rglob("*.xml"))
    assert done.returncode == 0, f"{done.stdout[-6000:]}\n{results[-6000:]}"
