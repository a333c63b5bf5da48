"""How a command of the command line joins the graph, so that no master that hangs makes it wait for ever."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import weakref
from collections.abc import Callable, Iterator
from types import FrameType

import rosgraph
import rospy.core

from node_kit.io.xml_rpc import Client
from node_kit.ros.lifetime import BAD_START, Lifetime

ANSWER_TIMEOUT = 5.0
"""Wall s in which the master must answer at the start."""


def join(name: str) -> None:
    """Become an anonymous node. If the master is lost later, the process ends with one line and status 2.

    SIGTERM and SIGHUP end it as Ctrl-C does: it leaves the graph.

    Raises:
        GoneError: there is no master.
        CallError: the master does not answer, or its address is none.
    """
    with Client(rosgraph.get_master_uri(), f"/{name}", ANSWER_TIMEOUT) as master:
        master.call("getPid")
    life = Lifetime(name)  # not entered: that would take over signals
    life.on_end = lambda reason: life.end(reason, BAD_START)
    with leaving_by_signals():
        life.start(anonymous=True)
    rospy.core.add_preshutdown_hook(lambda _reason: rospy.core._shutdown_threads.clear())
    # rospy would wait at the end for its thread of registrations, which looks only every 0.5 s whether it shall end


_AGAIN = 0.1
"""Wall s after which a signal is sent again whose exception something caught."""


class _Leave(SystemExit):
    """The end of the process, as a signal asks for it."""


@contextlib.contextmanager
def leaving_by_signals() -> Iterator[None]:
    """Have SIGTERM and SIGHUP end the process in order, so that its node does not stay behind in the graph.

    In the body, the process becomes a node; a signal that comes meanwhile counts at its end: a node that is half in the
    graph can't leave it. Parts of rospy, such as `wait_for_service`, catch every exception and go on: the signal is
    sent again, as soon as its exception is gone. A call of the master may be cut off halfway, by Ctrl-C too: the node
    leaves by a new connection.
    """
    rospy.core.add_preshutdown_hook(lambda _reason: rospy.core._xmlrpc_cache.clear())
    watched = set()

    def leave(number: int, _frame: FrameType | None) -> None:
        def gone(watch: weakref.ref[_Leave]) -> None:
            watched.discard(watch)
            if sys._getframe().f_back is not None:  # no frame is left where it ends the process
                again = threading.Timer(_AGAIN, os.kill, (os.getpid(), number))
                again.daemon = True
                again.start()

        end = _Leave(128 + number)
        watched.add(weakref.ref(end, gone))
        try:
            raise end
        finally:
            del end  # this frame is in its traceback

    early: list[int] = []
    if threading.current_thread() is threading.main_thread():
        _on_end_signals(lambda number, _frame: early.append(number))
    yield
    if threading.current_thread() is threading.main_thread():
        _on_end_signals(leave)
    if early:
        leave(early[0], None)


def _on_end_signals(do: Callable[[int, FrameType | None], None]) -> None:
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, do)
