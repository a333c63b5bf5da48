"""Which launcher starts the nodes of a host, by the names and addresses by which the host is known."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class HostLauncher:
    """A launcher, and the host on which it runs.

    Attributes:
        name: full name of the launcher's node.
        addresses: names and addresses of its host; the first one is the name that the host goes by.
    """

    name: str
    addresses: tuple[str, ...] = ()

    @property
    def host(self) -> str:
        """The name that the host goes by."""
        return self.addresses[0] if self.addresses else f"of {self.name}"


def launcher_at(address: str, launchers: Iterable[HostLauncher], resolved: Collection[str] = ()) -> HostLauncher | None:
    """Return the launcher of a host; None: there is none.

    The name that a host goes by counts more than the other ones: several hosts may have the same name for themselves,
    such as `ubuntu`, and several launchers the same address.

    Args:
        address: the host, as `<machine address=...>` names it.
        launchers: all launchers.
        resolved: the addresses that the name service has for it.
    """
    ordered = sorted(launchers, key=lambda launcher: launcher.name)
    wanted = address.lower()
    for named in (
        [launcher for launcher in ordered if launcher.host.lower() == wanted],
        [launcher for launcher in ordered if wanted in map(str.lower, launcher.addresses)],
        [launcher for launcher in ordered if set(resolved) & set(launcher.addresses)],
    ):
        if named:
            return named[0]
    return None


def no_launcher(node: str, address: str, launchers: Iterable[HostLauncher]) -> str:
    """Return the line that says that no launcher runs on the host of a node, with the remedy."""
    hosts = ", ".join(sorted({launcher.host for launcher in launchers})) or "none"
    return (
        f"node {node} is for host {address}, where no rosgraph_launcher runs (hosts that have one: {hosts}): run "
        f"'roslaunch rosgraph_launcher launcher.launch host:={address} name:=rosgraph_launcher_NAME' there"
    )
