"""How the node ends: at once, whatever rospy's threads are at, and also when the master is lost."""

from __future__ import annotations

import logging
import os
import socket
import sys
import threading
import time
from urllib.parse import urlparse

import rosgraph
import rospy

MASTER_PERIOD = 0.5
"""Wall s between two looks at whether the master is there."""

MASTER_PATIENCE = 1.2
"""Wall s without a master after which it is lost: it does not come back, and nodes never register again."""

CONNECT_TIMEOUT = 5.0
"""Wall s to reach the master, which may be overloaded."""

LONGEST_END = 3.0
"""Wall s after which the end is cut short: rospy asks the master without a deadline."""


def end_in_time() -> None:
    """Watches the master, and sees to it that the process ends when the node does. To be called after init_node."""
    begun = threading.Event()
    rospy.on_shutdown(begun.set)
    rospy.core.add_shutdown_hook(_leave_unless_leaving)  # comes after rospy's own, in their order
    for work in (_cut_off, _watch_master):
        threading.Thread(target=work, args=(begun,), daemon=True).start()


def _cut_off(begun: threading.Event) -> None:
    begun.wait()
    time.sleep(LONGEST_END)
    _leave()


def _watch_master(begun: threading.Event) -> None:
    master = urlparse(rosgraph.get_master_uri())
    seen = time.monotonic()
    while time.monotonic() - seen < MASTER_PATIENCE:
        if begun.wait(MASTER_PERIOD):
            return
        try:
            socket.create_connection((master.hostname or "", master.port or 0), CONNECT_TIMEOUT).close()
        except ConnectionRefusedError:
            continue
        except OSError:
            pass  # it may just be overloaded
        seen = time.monotonic()
    end_without_master()


def end_without_master() -> None:
    """Says that the master is lost, and ends the node."""
    sys.stderr.write(f"{rospy.get_name()}: the master is lost: the node ends\n")
    rospy.signal_shutdown("the master is lost")


def _leave_unless_leaving(reason: str) -> None:
    """Ends the process when the master knows of its end: who replaces it waits for that.

    Threads of actionlib and rospy, and a wait for the next tick of a simulated clock, would keep it for half a second.
    """
    if reason != "atexit":  # then it ends already, with a status of its own
        _leave()


def _leave() -> None:
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
