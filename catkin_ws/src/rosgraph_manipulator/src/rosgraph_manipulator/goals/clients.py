"""Who waits for a goal: the client that has sent it, as long as it listens to the action."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass


@dataclass(frozen=True)
class Client:
    """The node that has sent a goal, and listens for its result.

    Attributes:
        node: its name.
        address: that of its API when it sent the goal: another process of this name has another one.
    """

    node: str
    address: str

    def why_gone(self, address: str, listeners: Collection[str], refuses: bool) -> str:
        """Return why nobody waits for the goal any more; empty where the client does, as far as is known.

        Args:
            address: of the node's API now; empty: it is not registered.
            listeners: the nodes that listen for the action's results.
            refuses: whether nobody takes connections at its address, so that it has died. A node that hangs does.
        """
        if not address or refuses:
            return f"its client {self.node} has ended"
        if address != self.address:
            return f"its client {self.node} was started anew"
        return "" if self.node in listeners else f"its client {self.node} does not listen to the action any more"


def client_of(sender: str, address: str, listeners: Collection[str]) -> Client | None:
    """Return who waits for a goal; None: its sender does not listen, as `rostopic pub` and a server of its own goals.

    Args:
        sender: the node that has sent it.
        address: of its API.
        listeners: the nodes that listen for the action's results.
    """
    return Client(sender, address) if address and sender in listeners else None
