"""How the node reasoner ends: asked by a signal, because the master is lost, or because it can't start; always in time.

rospy says goodbye to the master, and would wait for the answer of one that hangs for ever; so would a look at a
parameter, and who waits for a lock that is held meanwhile, such as that of a log. So the end waits for a while only.
"""

from __future__ import annotations

import http.client
import os
import signal
import sys
import threading
import time
import xmlrpc.client
from typing import NoReturn

import rosgraph
import rospy
from ros_model.snapshot import TimedTransport

_GOODBYE = 1.5  # s, wall, for rospy to unregister
_PERIOD = 0.4  # s, wall, between two looks at the master
_LOST_AFTER = 1.2  # s, wall, without an answer: told within 2 s
_UNREACHABLE = (OSError, xmlrpc.client.Error, http.client.HTTPException, LookupError, TypeError, ValueError)

_unregistered = threading.Event()
_loss_is_told = threading.Lock()


def end(reason: str, status: int = 0) -> NoReturn:
    """End the process, and with it Pellet's; unregister before, where the master answers in time."""
    goodbye = threading.Thread(target=rospy.signal_shutdown, args=(reason,), daemon=True)
    goodbye.start()
    goodbye.join(_GOODBYE)
    _unregistered.wait(_GOODBYE if rospy.core.is_initialized() else 0.0)  # it may be another thread that unregisters
    sys.stderr.flush()
    os._exit(status)  # threads that hang in a call to the master would keep it


def end_on_signals() -> None:
    """Have SIGINT and SIGTERM end the process in whatever state it is; call it from the main thread."""

    def on_signal(number: int, _frame: object) -> None:
        for known in (signal.SIGINT, signal.SIGTERM):
            signal.signal(known, signal.SIG_IGN)
        reason = f"signal {signal.Signals(number).name}"
        threading.Thread(target=end, args=(reason,), name="end").start()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)


def start_node(name: str) -> None:
    """Begin to be a node; from now on the loss of the master ends the process, since it would not come back to it.

    Raises:
        rospy.ROSInitException: no master answers.
    """
    if not rosgraph.is_master_online():
        uri = rosgraph.get_master_uri()
        raise rospy.ROSInitException(f"no ROS master answers at {uri}: start roscore or set ROS_MASTER_URI")
    threading.Thread(target=_watch, args=(f"/{name}_watch",), name="master watch", daemon=True).start()
    try:
        rospy.init_node(name, disable_signals=True)
    except rospy.ROSInitException:
        if rosgraph.is_master_online():
            raise
        end_without_master()
    rospy.core.add_shutdown_hook(lambda _: _unregistered.set())  # hooks go in order: rospy's own come before


def _watch(caller: str) -> None:
    master = xmlrpc.client.ServerProxy(rosgraph.get_master_uri(), transport=TimedTransport(_LOST_AFTER))
    first, seen = None, time.monotonic()
    while time.monotonic() - seen <= _LOST_AFTER:
        try:
            pid = int(master.getPid(caller)[2])  # type: ignore[index, arg-type]
        except _UNREACHABLE:
            pid = None
        first = first or pid
        if pid is not None and pid != first:
            break  # another master, which knows nothing of this node
        if pid is not None:
            seen = time.monotonic()
        time.sleep(_PERIOD)
    if not rospy.is_shutdown():
        end_without_master()


def end_without_master() -> None:
    """Say, once, that the master is gone, and end the process."""
    if _loss_is_told.acquire(blocking=False):
        sys.stderr.write("reasoner: the ROS master is gone: the reasoner ends; start the system again\n")
    end("the master is gone")
