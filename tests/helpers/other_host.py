"""Another host: a network namespace that is reached through a link."""

import os
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

IP = "/usr/sbin/ip"


@dataclass(frozen=True)
class OtherHost:
    """A network namespace, its address, and the address of this host on the link between them."""

    name: str
    address: str
    here: str


def ip(*arguments):
    return subprocess.run([IP, *arguments], capture_output=True, text=True, check=False)


@contextmanager
def other_host():
    """Make a network namespace and a link into it; skip the test where that is not permitted."""
    if not Path(IP).exists():
        pytest.skip("no network namespace: iproute2 is not installed")
    # One of many, since others may run tests on the same machine.
    name, link, network = f"mros_{os.getpid()}", f"mros{os.getpid() % 100000}", f"10.213.{os.getpid() % 250}"
    made = ip("netns", "add", name)
    if made.returncode:
        pytest.skip(f"no network namespace: {made.stderr.strip()}")
    try:
        for arguments in (
            ("link", "add", link, "type", "veth", "peer", "name", "eth0", "netns", name),
            ("addr", "add", f"{network}.1/24", "dev", link),
            ("link", "set", link, "up"),
            ("-n", name, "addr", "add", f"{network}.2/24", "dev", "eth0"),
            ("-n", name, "link", "set", "eth0", "up"),
            ("-n", name, "link", "set", "lo", "up"),
        ):
            done = ip(*arguments)
            if done.returncode:
                pytest.skip(f"no link into the network namespace: {done.stderr.strip()}")
        yield OtherHost(name, f"{network}.2", f"{network}.1")
    finally:
        ip("link", "del", link)
        ip("netns", "del", name)


def run_rostest(file, host, folder, **environment):
    """Run a .test file with the other host in its environment; fail with its output where it fails."""
    environment = {
        **os.environ,
        "ROS_HOME": str(folder),
        "ROS_LOG_DIR": str(folder / "log"),
        "OTHER_HOST": host.name,
        "OTHER_ADDRESS": host.address,
        "THIS_ADDRESS": host.here,
        **environment,
    }
    environment.pop("ROS_MASTER_URI", None)
    done = subprocess.run(
        ["/usr/bin/rostest", str(file)], env=environment, capture_output=True, text=True, timeout=430, check=False
    )
    results = "\n".join(path.read_text() for path in (folder / "test_results").rglob("*.xml"))
    assert done.returncode == 0, f"{done.stdout[-6000:]}\n{results[-6000:]}"
