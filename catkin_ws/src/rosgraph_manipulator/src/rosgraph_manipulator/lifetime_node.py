"""How our nodes end: in time, whatever they are doing, even inside a call to a master that hangs."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable

import rosgraph
import rospy

LONGEST_END = 3.0
"""Seconds, wall, after which a node that is to end is cut off: rospy asks the master without a deadline."""


def init_node(name: str) -> None:
    """Join the master, as `rospy.init_node` does; signals end the node at any moment, also before it has joined.

    Raises:
        rospy.ROSInitException: there is no master, or the node was told to end before it was there.
    """
    on_signal(rospy.signal_shutdown)
    rospy.on_shutdown(cut_off(LONGEST_END).set)
    try:
        rospy.init_node(name, disable_signals=True)
    except OSError as error:
        raise rospy.ROSInitException(f"no master at {rosgraph.get_master_uri()}: start roscore ({error})") from error
    rospy.core.add_shutdown_hook(_exit)  # comes after rospy's own, in their order


def on_signal(end: Callable[[str], None]) -> None:
    """Have SIGINT, SIGTERM and SIGHUP call a function with the reason, in a thread of its own.

    A handler of Python's runs inside whatever the main thread is at, and waits there for locks that this may hold. Here
    the C part of the signal handling wakes a thread.
    """
    signals, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake)
    for kind in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(kind, lambda *_: None)
    threading.Thread(target=lambda: end(f"signal {os.read(signals, 1)[0]}"), daemon=True).start()


def cut_off(patience: float) -> threading.Event:
    """Return an event to be set when the node begins to end: its process ends after `patience` (s, wall)."""
    begun = threading.Event()

    def wait() -> None:
        begun.wait()
        time.sleep(patience)
        _leave()

    threading.Thread(target=wait, daemon=True).start()
    return begun


def tell_loss(consequence: str) -> None:
    """Say in one line that the master is lost."""
    sys.stderr.write(f"{rospy.get_name().rpartition('/')[2]}: the master is lost: {consequence}\n")


def end_without_master() -> None:
    """Say that the master is lost, and end the node."""
    tell_loss("the node ends")
    rospy.signal_shutdown("the master is lost")


def _exit(reason: str) -> None:
    """End the process: threads of rospy and actionlib would keep it, and the closed server of its API spins."""
    if reason != "atexit":  # then it ends already, with a status of its own
        _leave()


def _leave() -> None:
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
