"""The processes of nodes on this host."""

from __future__ import annotations

from urllib.parse import urlsplit

import psutil
import rosgraph
from node_kit.io.xml_rpc import Client
from rosgraph_launcher.io.ownership import is_this_host


class NodeProcessError(RuntimeError):
    """A node's process can't be told; one line that says why, and what to do."""


def pid_of(node: str, caller: str, timeout: float) -> int:
    """Return the process of a node, as its own API tells, where that process listens at the node's address.

    A node on another host, or in a container, tells a number that some other process may have here.

    Args:
        node: its full name.
        caller: name of the node that asks.
        timeout: wall s for an answer of the master, and of the node.

    Raises:
        NodeProcessError: it does not run on this host, or in a container of it.
        CallError: the master does not know it, or it does not answer.
    """
    with Client(rosgraph.get_master_uri(), caller, timeout) as master:
        uri = str(master.call("lookupNode", node))
    try:
        host, port = urlsplit(uri).hostname or "", urlsplit(uri).port
    except ValueError as error:
        raise NodeProcessError(f"node {node}: its address {uri!r} makes no sense: start it again") from error
    if not is_this_host(host):
        raise NodeProcessError(
            f"node {node} runs on the host {host}: processes can be looked at on their own host only"
        )
    with Client(uri, caller, timeout, peer=f"node {node} at") as api:
        pid = api.pid()
    if not _listens(pid, port):
        raise NodeProcessError(
            f"node {node}: process {pid} of this host does not listen at {uri}, so it is not the node's: "
            "the node runs in a container, or as another user"
        )
    return pid


def _listens(pid: int, port: int | None) -> bool:
    try:
        connections = psutil.Process(pid).net_connections("tcp")
    except (
        psutil.Error,
        OSError,
        ValueError,
        OverflowError,
    ):  # there is none, it is another user's, or no number of one
        return False
    return any(one.status == psutil.CONN_LISTEN and one.laddr.port == port for one in connections)
