"""What nodes use: who can look at the process of each, and what follows from what they tell."""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from metacontrol_msgs.msg import DiagnosticWords as Words
from rosgraph_launcher.hosts import HostLauncher, launcher_at
from rosgraph_launcher.usage import cpu_percent

from rosgraph_monitor.diagnostics.status import Level, Status

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from ros_model.graph.snapshot import GraphSnapshot
    from rosgraph_launcher.usage import Sample

THIS_HOST = ""
"""Who looks at a process of the monitor's own host: the monitor itself."""


def host_of(uri: str) -> str:
    """Return the host in the address of a node's API; empty where there is none."""
    try:
        return urlsplit(uri).hostname or ""
    except ValueError:
        return ""


def launchers_in(snapshot: GraphSnapshot, topic: str, alive: Collection[str]) -> list[HostLauncher]:
    """Return the launchers that live, each with the names and addresses of its host.

    Args:
        snapshot: the running graph.
        topic: full name of the topic that the launchers share.
        alive: the nodes that live.
    """
    found = []
    for name in snapshot.topics[topic].publishers if topic in snapshot.topics else ():
        try:
            addresses = snapshot.parameter(f"{name}/addresses")
        except KeyError:
            continue
        if name in alive and isinstance(addresses, list):
            found.append(HostLauncher(name, tuple(map(str, addresses))))
    return found


def tellers(
    hosts: Mapping[str, str],
    here: Collection[str],
    launchers: Iterable[HostLauncher],
    resolved: Mapping[str, Collection[str]],
) -> dict[str, str]:
    """Return who can look at the process of each node: THIS_HOST, or a launcher.

    A node of another host on which no launcher runs is left out, because its process id means another process here.
    A node is where the master says that it is: where it has moved to, not where another launcher ends it.

    Args:
        hosts: for each node, the host in the address of its API.
        here: those hosts that are this one.
        launchers: all launchers.
        resolved: for each host, the addresses that the name service has.
    """
    known = list(launchers)
    found = {}
    for node, host in hosts.items():
        if host in here:
            found[node] = THIS_HOST
        elif launcher := launcher_at(host, known, resolved.get(host, ())):
            found[node] = launcher.name
    return found


class UsageMeter:
    """Compares what nodes have used, from one call to the next."""

    def __init__(self) -> None:
        self._before: dict[tuple[str, str], Sample] = {}

    def tell(self, samples: Mapping[tuple[str, str], Sample]) -> list[Status]:
        """Return "CPU Usage" and "Memory Usage" of each node; CPU from the second sample on.

        Args:
            samples: by node and who has looked, because the clocks of two hosts can't be compared.
        """
        statuses = []
        for (node, teller), sample in samples.items():
            before = self._before.get((node, teller))
            cpu = cpu_percent(before, sample) if before else None
            if cpu is not None:
                statuses.append(Status(Level.OK, node, Words.CPU_USAGE, ((node, f"{cpu:.2f}"),)))
            statuses.append(Status(Level.OK, node, Words.MEMORY_USAGE, ((node, f"{sample.memory:.1f}"),)))
        self._before = dict(samples)
        return statuses
