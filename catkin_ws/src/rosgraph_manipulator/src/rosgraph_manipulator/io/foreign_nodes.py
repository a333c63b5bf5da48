"""Ends nodes that somebody else has started, such as a roslaunch of the user's."""

from __future__ import annotations

import contextlib
import time
from urllib.parse import urlsplit

import psutil
from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.ownership import command_words, is_this_host

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.change.repairs import may_be_asked, may_be_killed

END_TIMEOUT = 3.0  # s, wall, for a node to end after it is told to, as for the launcher's own nodes
LOOK_PERIOD = 0.03  # s, wall


def end_node(node: str) -> None:
    """End a node as `rosnode kill` does, and kill its process if that stays and is on this host.

    A node that hangs on another host, or under a command line that may be another node's, is left alone: it loses its
    name to the one that is started now.

    Args:
        node: its full name.

    Raises:
        DeploymentError: it answers and does not end.
    """
    uri = NodeApi.address(node)
    process = _process_at(uri) if uri else None
    words = command_words(process) if process else []
    if uri is None or not may_be_asked(node, words):
        return
    answers = NodeApi.pid(uri) is not None
    if answers:
        NodeApi.request_shutdown(node, "it is started again, because its component is repaired")
        if _has_ended(process, uri):
            return
    if process and may_be_killed(node, words):
        with contextlib.suppress(psutil.Error):  # it has ended, or it is another user's
            process.kill()
        if _has_ended(process, uri):
            return
        answers = True
    if answers:
        where = f"process {process.pid} ({' '.join(words)})" if process else f"the process at {uri}"
        raise DeploymentError(f"node {node} does not end: end {where}")


def _process_at(uri: str) -> psutil.Process | None:
    """Return the process of this host that listens at the address of a node; None: there is none, as far as is seen."""
    address = urlsplit(uri)
    if not is_this_host(address.hostname or ""):
        return None
    with contextlib.suppress(psutil.Error):
        for found in psutil.net_connections("tcp"):
            listens = found.status == psutil.CONN_LISTEN and found.laddr and found.laddr.port == address.port
            if found.pid and listens:
                return psutil.Process(found.pid)
    return None


def _has_ended(process: psutil.Process | None, uri: str) -> bool:
    """Wait until a node has ended; return whether it has."""
    deadline = time.monotonic() + END_TIMEOUT
    while _runs(process) if process else NodeApi.pid(uri) is not None:
        if time.monotonic() > deadline:
            return False
        time.sleep(LOOK_PERIOD)
    return True


def _runs(process: psutil.Process) -> bool:
    with contextlib.suppress(psutil.NoSuchProcess):
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    return False
