"""The life of a node: it starts, and ends in time by a signal, a request, an error or the loss of its master."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Collection
from types import TracebackType
from typing import NoReturn

import rosgraph
import rospy

from node_kit.io.forgiving_logs import forgive
from node_kit.io.master_watch import MasterWatch
from node_kit.io.memory_arenas import limit_arenas
from node_kit.io.printable_logs import print_safely
from node_kit.io.xml_rpc import CallError
from node_kit.master import View
from node_kit.one_line import one_line
from node_kit.ros.connections import connect_to_all
from node_kit.ros.handshakes import greet_apart
from node_kit.ros.last_start import LastStart
from node_kit.ros.quick_start import quick_start
from node_kit.ros.rosout_parameter import read_rosout_parameter

BAD_START = 2
"""Exit status of a start that failed. The loss of the master ends a node with 0: it has done all it could."""

STAYS = "NODE_KIT_STAYS"
"""Environment variable, to be set beside `respawn="true"`: a node whose input can't be used says so, and ends after
`TRIES_AGAIN`. Its start would fail again every second otherwise; the input may be mended, or be wrong for a moment.
What has been deleted of its parameters since it began last is set again before it begins; where others have changed, it
sets them again, and ends at once."""

TRIES_AGAIN = 30.0
"""Wall s after which such a node ends, so that it is started again."""

_CHANGES = 1.0
"""Wall s after which it ends, where its parameters have just changed."""

LONGEST_END = 3.0
"""Wall s for a node to end; then its process is cut off, because rospy calls the master without a deadline."""

LONGEST_END_WITHOUT_MASTER = 0.5
"""The same when there is no master at which to unregister."""

_show_thread_error = threading.excepthook  # Python 3.8 has no threading.__excepthook__
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Lifetime:
    """The life of a node, for a `with` block in the main thread. The process ends with the block.

        with Lifetime("camera", ParameterError) as life:
            life.start()
            CameraNode()
            rospy.spin()

    If the loss of the master causes an error in the block, the node writes one line about the loss, and no traceback.
    """

    def __init__(self, name: str, *refusals: type[Exception]) -> None:
        """Prepare.

        Args:
            name: the node's name; rospy may give it another one at the start.
            refusals: errors that mean unusable input: the node writes one line and ends with status 2.
        """
        self.on_end: Callable[[str], None] = self.end
        """Called with a reason when a signal or the loss of the master ends the node; it must call `end`."""
        self.consequence = "it ends, start it again with the master"
        """What the line about the loss of the master says about the node."""
        self.longest_end = LONGEST_END
        """Wall s after which the process ends in any case."""
        self.longest_end_without_master = LONGEST_END_WITHOUT_MASTER
        """The same after the loss of the master. A node that has to end other processes sets more."""
        self.watch = MasterWatch(self._tell, self._on_loss)
        self._name = name
        self._stays = bool(os.environ.pop(STAYS, ""))  # not for those that this node starts
        self._refusals = refusals
        self._claim = threading.Lock()  # held for ever by whoever ends the process
        self._cut_off_at = math.inf  # monotonic s
        self._cut_off_sooner = threading.Condition()
        self._status = 0
        self._last_start: LastStart | None = None
        self._shutting_down: int | None = None  # the thread in which rospy shuts down
        limit_arenas()
        # Begun now, because there may be no thread to be had when the node is to end.
        threading.Thread(target=self._cut_off_in_time, name="cut off", daemon=True).start()

    def __enter__(self) -> Lifetime:
        """Have signals end the process from now on, whatever it does."""
        _on_signal(lambda number: self.on_end(f"signal {number}"))
        threading.excepthook = self._on_thread_error
        rospy.on_shutdown(self._on_shutdown)
        return self

    def start(self, anonymous: bool = False, writes: Collection[str] = (), reads: Collection[str] = ()) -> None:
        """Become a node, and watch the master from now on.

        Args:
            anonymous: whether the node's name gets an addition that makes it unique.
            writes: the node's private parameters that it sets itself.
            reads: parameters that it reads beside its private ones.
        """
        print_safely()
        try:
            self.watch.start(rosgraph.get_master_uri())
            if not self.watch.confirm():
                self.end("there is no master", 0 if self.watch.has_answered else BAD_START)
            connect_to_all()
            with quick_start():
                rospy.init_node(self._name, anonymous=anonymous, disable_signals=True)
            self._name = rospy.get_name()
            read_rosout_parameter()
            forgive()
            greet_apart()
            if self._stays:
                with contextlib.suppress(CallError, RecursionError):  # the node can do without
                    self._last_start = LastStart(writes, reads)
                    self._tell_names("what was deleted since its last start is set again", self._last_start.complete())
        except (CallError, OSError, rospy.ROSInitException) as error:
            raise _StartError(str(error)) from error
        rospy.core.add_shutdown_hook(self._after_goodbye)  # comes after rospy's own, in their order

    def begun(self) -> None:
        """Keep the parameters with which the node has begun, for the process that roslaunch starts in its place."""
        if self._last_start is not None:
            with contextlib.suppress(RuntimeError):  # there is no thread to be had
                self._last_start.keep()

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
        if isinstance(error, (*self._refusals, _StartError)):
            self.say(" ".join(str(error).split()))
            # A master that was in trouble may be well again.
            if self._stays and not isinstance(error, _StartError) and not self._mends():
                self.say(f"mend that; it tries again in {TRIES_AGAIN:g} s")
                time.sleep(TRIES_AGAIN)
            self.end("it can't start", BAD_START)
        with contextlib.suppress(OSError, ValueError):  # nobody reads any more
            traceback.print_exception(kind, error, trace)
        self.end("it has failed", 1)

    def _mends(self) -> bool:
        """Set parameters so that the node may begin; return whether it is started again at once."""
        try:
            names, again = self._last_start.mend() if self._last_start is not None else ([], False)
        except (CallError, RecursionError) as error:  # nobody answers, or somebody has garbled what was kept
            self.say(one_line(str(error)))
            return False
        if names or not again:
            what = "begins again with what it had at its last start" if again else "has what it found before"
            self._tell_names(f"it {what}", names)
        else:
            self.say("its parameters have just changed: it begins again")
            time.sleep(_CHANGES)
        return again

    def _tell_names(self, what: str, names: Collection[str]) -> None:
        if names:
            self.say(one_line(f"{what}: {', '.join(names)}"))

    @property
    def is_ending(self) -> bool:
        """Tell whether the node is about to end."""
        return self._claim.locked() or self._shutting_down is not None

    def say(self, line: str) -> None:
        """Write a line to stderr. rospy's log would ask the master for a parameter, and might wait for it."""
        with contextlib.suppress(OSError, ValueError):  # nobody reads any more
            sys.stderr.write(f"{self._name}: {line}\n")
            sys.stderr.flush()

    def end(self, reason: str, status: int = 0) -> NoReturn:
        """Unregister at the master and end the process, in time. A second caller waits for the end."""
        if self._claim.acquire(blocking=False):
            self._status = status
            self.cut_off(self.longest_end_without_master if self.watch.lost else self.longest_end)
            rospy.signal_shutdown(reason)
            if self._shutting_down == threading.get_ident():
                self._leave()
        while True:  # until another thread has said goodbye
            time.sleep(LONGEST_END)

    def cut_off(self, patience: float) -> None:
        """End the process after `patience` wall s at the latest, whatever it waits for."""
        with self._cut_off_sooner:
            self._cut_off_at = min(self._cut_off_at, time.monotonic() + patience)
            self._cut_off_sooner.notify()

    def _cut_off_in_time(self) -> None:
        with self._cut_off_sooner:
            while (left := self._cut_off_at - time.monotonic()) > 0.0:
                self._cut_off_sooner.wait(None if left == math.inf else left)
        os._exit(self._status)  # no more: locks of the log may be held by who waits

    def _on_shutdown(self) -> None:
        self._shutting_down = threading.get_ident()
        self.cut_off(self.longest_end)

    def _after_goodbye(self, reason: str) -> None:
        if reason != "atexit":  # then it ends already, with a status of its own
            self._leave()

    def _on_thread_error(self, failure: threading.ExceptHookArgs) -> None:
        """Hide errors of other threads that follow from the end or from the master's loss."""
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
        """End the process at once: threads of rospy and actionlib would keep it alive, and its API server spins."""
        try:
            logging.shutdown()
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(self._status)


class _StartError(Exception):
    """rospy could not begin."""


def _on_signal(act: Callable[[int], object]) -> None:
    """Call a function with the number of the first signal that asks for an end, in a thread of its own.

    A Python handler interrupts the main thread, which may hold the very locks that the handler needs. So here the C
    part of the signal handling wakes another thread.
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
