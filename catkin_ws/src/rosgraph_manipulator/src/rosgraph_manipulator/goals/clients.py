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

    def why_gone(self, address: str, listeners: Collection[str], refuses: bool, leaving: Collection[str] = ()) -> str:
        """Return why nobody waits for the goal any more; empty where the client does, as far as is known.

        Args:
            address: of the node's API now; empty: it is not registered.
            listeners: the nodes that listen for the action's results.
            refuses: whether nobody takes connections at its address, so that it has died. A node that hangs does.
            leaving: the nodes that are about to end together with the server.
        """
        if not address or refuses:
            return f"its client {self.node} has ended"
        if address != self.address:
            return f"its client {self.node} was started anew"
        if self.node in leaving:
            return f"its client {self.node} ends, too"
        return "" if self.node in listeners else f"its client {self.node} does not listen to the action any more"


def client_of(sender: str, address: str, listeners: Collection[str], servers: Collection[str]) -> Client | None:
    """Return who waits for a goal; None: nobody who can be missed.

    That is a sender that does not listen, as `rostopic pub`, and a server's own node. Such a node passes on what came
    to it in another way, as a pose on `move_base_simple/goal`, and ends at each change of the server.

    Args:
        sender: the node that has sent it.
        address: of its API.
        listeners: the nodes that listen for the action's results.
        servers: the nodes that serve the action.
    """
    return Client(sender, address) if address and sender in listeners and sender not in servers else None
