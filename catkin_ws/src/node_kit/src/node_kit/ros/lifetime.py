"""A node's life: joined to the master, ended by a signal, a request, an error or with its master, always in time."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import NoReturn

import rosgraph
import rospy

from node_kit.io.master_watch import MasterWatch
from node_kit.io.xml_rpc import CallError
from node_kit.master import View

BAD_START = 2
"""Exit status of a start that failed. The loss of the master ends a node with 0: it has done all it could."""

LONGEST_END = 3.0
"""Wall s, after which a node that is to end is cut off: rospy asks the master without a deadline."""

LONGEST_END_WITHOUT_MASTER = 0.5
"""The same where nobody is left to say goodbye to."""

_show_thread_error = threading.excepthook  # Python 3.8 has no threading.__excepthook__
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Lifetime:
    """What a node does is within the `with` of its lifetime, in the main thread; the process ends there.

        with Lifetime("camera", ParameterError) as life:
            life.start()
            CameraNode()
            rospy.spin()

    An error there that comes of the master's loss gives the one line of that, no traceback.
    """

    def __init__(self, name: str, *refusals: type[Exception]) -> None:
        """Prepare.

        Args:
            name: the node's name, until it may have been given another one.
            refusals: errors that are no defect but input that can't be used: told in one line, exit status 2.
        """
        self.on_end: Callable[[str], None] = self.end
        """Called with a reason when a signal or the loss of the master is to end the node; has to call `end`."""
        self.consequence = "it ends, start it again with the master"
        """What the line about the loss of the master says of the node."""
        self.longest_end = LONGEST_END
        """Wall s after which the end is cut short."""
        self.longest_end_without_master = LONGEST_END_WITHOUT_MASTER
        """The same where the master is lost; more for a node that has something else to end."""
        self.watch = MasterWatch(self._tell, self._on_loss)
        self._name = name
        self._refusals = (*refusals, _StartError)
        self._claim = threading.Lock()  # held for ever by whoever ends the process
        self._status = 0
        self._shutting_down: int | None = None  # the thread in which rospy shuts down

    def __enter__(self) -> Lifetime:
        """Have signals end the process from now on, whatever it is at."""
        _on_signal(lambda number: self.on_end(f"signal {number}"))
        threading.excepthook = self._on_thread_error
        rospy.on_shutdown(self._on_shutdown)
        return self

    def start(self) -> None:
        """Become a node, and watch the master from now on."""
        try:
            self.watch.start(rosgraph.get_master_uri())
            if not self.watch.confirm():
                self.end("there is no master", BAD_START)
            rospy.init_node(self._name, disable_signals=True)
        except (CallError, OSError, rospy.ROSInitException) as error:
            raise _StartError(str(error)) from error
        self._name = rospy.get_name()
        rospy.core.add_shutdown_hook(self._after_goodbye)  # comes after rospy's own, in their order

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the process."""
        if isinstance(error, SystemExit):
            self.end("it exits", error.code if isinstance(error.code, int) else int(error.code is not None))
        if error is None or self.is_ending:
            self.end("it has done its work")
        if not self.watch.confirm():  # that is why, and was told
            self.end("the master is lost")
        if isinstance(error, self._refusals):
            self.say(" ".join(str(error).split()))
            self.end("it can't start", BAD_START)
        with contextlib.suppress(OSError, ValueError):  # nobody reads any more
            traceback.print_exception(kind, error, trace)
        self.end("it has failed", 1)

    @property
    def is_ending(self) -> bool:
        """Tell whether the node is to end."""
        return self._claim.locked() or self._shutting_down is not None

    def say(self, line: str) -> None:
        """Write a line on stderr: rospy's log asks the master for a parameter, and would wait for it."""
        with contextlib.suppress(OSError, ValueError):  # nobody reads any more
            sys.stderr.write(f"{self._name}: {line}\n")
            sys.stderr.flush()

    def end(self, reason: str, status: int = 0) -> NoReturn:
        """Say goodbye to the master and end the process, in time. Whoever calls it while it ends waits for the end."""
        if self._claim.acquire(blocking=False):
            self._status = status
            self.cut_off(self.longest_end_without_master if self.watch.lost else self.longest_end)
            rospy.signal_shutdown(reason)
            if self._shutting_down == threading.get_ident():
                self._leave()
        while True:  # until another thread has said goodbye
            time.sleep(LONGEST_END)

    def cut_off(self, patience: float) -> None:
        """End the process after so many wall s, whatever it waits for."""

        def wait() -> None:
            time.sleep(patience)
            os._exit(self._status)  # no more: locks of the log may be held by who waits

        threading.Thread(target=wait, name="cut off", daemon=True).start()

    def _on_shutdown(self) -> None:
        self._shutting_down = threading.get_ident()
        self.cut_off(self.longest_end)

    def _after_goodbye(self, reason: str) -> None:
        if reason != "atexit":  # then it ends already, with a status of its own
            self._leave()

    def _on_thread_error(self, failure: threading.ExceptHookArgs) -> None:
        """Leave out what comes of the end, or of the master's loss, in other threads, such as those of rospy."""
        if not self.is_ending and (failure.thread is self.watch.thread or self.watch.confirm()):
            _show_thread_error(failure)

    def _tell(self, view: View) -> None:
        if not self.is_ending:
            self.say(view.text(rosgraph.get_master_uri(), self.consequence, self.watch.patience))

    def _on_loss(self, view: View) -> None:
        if view.pid is None:
            self.end("there is no master", BAD_START)
        if not self.is_ending:
            self.on_end("the master is lost")

    def _leave(self) -> NoReturn:
        """End the process: threads of rospy and actionlib would keep it, and the closed server of its API spins."""
        try:
            logging.shutdown()
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(self._status)


class _StartError(Exception):
    """rospy could not begin."""


def _on_signal(act: Callable[[int], object]) -> None:
    """Have the first signal that asks for an end call a function with its number, in a thread of its own.

    A handler of Python's runs inside whatever the main thread is at, and waits there for locks that this may hold. Here
    the C part of the signal handling wakes a thread.
    """
    signals, wake = os.pipe()
    os.set_blocking(wake, False)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: None)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup
        signal.signal(signal.SIGHUP, lambda *_: None)

    def wait() -> None:
        while (number := os.read(signals, 1)[0]) not in _SIGNALS:
            pass
        act(number)

    threading.Thread(target=wait, name="signals", daemon=True).start()
