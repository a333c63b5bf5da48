"""Looks up who answers under the name of a node; `launching.ownership` judges it."""

from __future__ import annotations

import contextlib
import os
import time
from urllib.parse import urlsplit

import psutil
import rosgraph

from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.processes import MARK, OWNER
from rosgraph_launcher.io.this_host import resolved
from rosgraph_launcher.launching.ownership import Answer, ProcessFacts

NO_LASTS = 10.0  # s, wall, before the name service is asked again; an answer may take seconds
_MOST_HOSTS = 256
_hosts: dict[str, tuple[bool, float]] = {}  # whether each is this one, and until when a no holds


def look_up(node: str) -> Answer:
    """Ask the master and the node itself who answers under a name, and look at that process and its parents."""
    found = NodeApi.answer(node)
    if found is None:
        return Answer()
    address, pid = found
    parts = urlsplit(address)
    unknown = Answer(answers=True, address=address)
    try:
        if not is_this_host(parts.hostname or ""):
            return unknown
        process = psutil.Process(pid)
        lineage = _lineage(process)
        return Answer(True, bool(lineage[-1].mark) or _may_serve(process, parts.port), lineage, address)
    except (psutil.Error, OSError, ValueError):
        # It has ended, it has another number here than in its container, that number is none, or no descriptor is left.
        return unknown


def launcher_mark(name: str) -> str:
    """Return the mark of the launcher that has a name."""
    return f"{rosgraph.get_master_uri()}{name}"


def command_words(process: psutil.Process) -> list[str]:
    """Return the words of a process's command line; none where it can't be read.

    What is not UTF-8 is escaped, because no message can hold it.
    """
    with contextlib.suppress(psutil.Error, OSError):
        words = map(os.fsencode, process.cmdline())
        return [word.decode("utf-8", "backslashreplace") for word in words]
    return []


def is_this_host(host: str) -> bool:
    """Tell whether a name or an address is one of this host.

    A yes is kept for good, a no for NO_LASTS: the name service may have failed.
    """
    is_here, until = _hosts.get(host, (False, 0.0))
    if not is_here and time.monotonic() >= until:
        addresses = resolved(host)
        is_here = any(one.startswith("127.") or one == "::1" for one in addresses) or bool(
            addresses & set(rosgraph.network.get_local_addresses())
        )
        if len(_hosts) >= _MOST_HOSTS:
            _hosts.clear()
        _hosts[host] = is_here, time.monotonic() + NO_LASTS
    return is_here


def _lineage(process: psutil.Process) -> tuple[ProcessFacts, ...]:
    """Return a process, its parent, and so on, up to the first that bears a launcher's mark."""
    found = [_facts(process)]
    parent = process.parent()
    while parent is not None and not found[-1].mark:
        found.append(_facts(parent))
        parent = parent.parent()
    return tuple(found)


def _facts(process: psutil.Process) -> ProcessFacts:
    environment = {}
    with contextlib.suppress(psutil.Error):  # no OSError: a process of ours must not seem to be without the mark
        environment = process.environ()
    command = " ".join(command_words(process))
    return ProcessFacts(process.pid, command, environment.get(MARK, ""), environment.get(OWNER, ""))


def _may_serve(process: psutil.Process, port: int | None) -> bool:
    """Tell whether a process may be the one that serves a port: False where another one of a container must be."""
    list_connections = getattr(process, "net_connections", None) or process.connections  # psutil before 6.0 has these
    try:
        connections = list_connections("tcp")
    except psutil.Error:  # of another user
        return True
    return any(one.laddr and one.laddr.port == port for one in connections)
