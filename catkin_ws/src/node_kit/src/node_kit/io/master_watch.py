"""Asks the master whether it is there, in a thread of its own."""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable

from node_kit.io.background import again_and_again
from node_kit.io.xml_rpc import CallError, Client, GoneError, SilentError
from node_kit.master import PATIENCE, Answer, Refusal, Silence, Standing, View

_log = logging.getLogger(__name__)


class MasterWatch:
    """A watch that reports when the master falls silent and when it is lost. It ends with the loss."""

    def __init__(self, tell: Callable[[View], None], on_loss: Callable[[View], None]) -> None:
        """Prepare to watch.

        Args:
            tell: called once for each silence that begins, and once for the loss of a master that was not silent.
            on_loss: called once, at the end, after it was told.
        """
        self.patience = PATIENCE
        """Wall s for which silence is borne."""
        self.heartbeat: Callable[[], None] | None = None
        """Called after each answer; an error of it does not end the watch."""
        self.lost = False
        """Whether the master is lost."""
        self._tell, self._on_loss = tell, on_loss
        self._hurry = threading.Event()
        self._news = threading.Condition()
        self._view = View()
        self._answered_at = -math.inf  # when the last question that was answered had been put
        self.thread: threading.Thread | None = None

    def start(self, uri: str) -> None:
        """Begin.

        Args:
            uri: address of the master.

        Raises:
            CallError: it is no address.
        """
        self.thread = threading.Thread(target=self._run, args=(_Asker(uri),), name="master watch", daemon=True)
        self.thread.start()

    def confirm(self) -> bool:
        """Return whether the master is there: it has answered a question that was put from now on, or else is lost.

        Before the start it is taken to be there.
        """
        if self.thread is None:
            return True
        now = time.monotonic()
        self._hurry.set()
        with self._news:
            self._news.wait_for(lambda: self.lost or self._answered_at >= now)
            return not self.lost

    @property
    def has_answered(self) -> bool:
        """Whether the master was ever there."""
        return self._answered_at > -math.inf

    def _run(self, ask: _Asker) -> None:
        again_and_again(lambda: self._look(ask), lambda: not self._view.lost)
        self._note(lost=True)
        self._on_loss(self._view)

    def _look(self, ask: _Asker) -> None:
        self._hurry.clear()
        asked = time.monotonic()
        before = self._view
        came = ask(before.timeout(asked, self.patience))
        self._view = view = before.after(came, asked, time.monotonic(), self.patience)
        if view.standing is Standing.THERE:
            self._note(answered_at=asked)
            self._beat()
            self._hurry.wait(view.pause)
            return
        is_new_silence = view.silent_since is not None and before.silent_since is None
        if is_new_silence or (view.lost and view.standing is not Standing.MUTE):
            self._tell(view)
        if not view.lost:
            time.sleep(view.pause)

    def _beat(self) -> None:
        if self.heartbeat:
            try:
                self.heartbeat()
            except Exception:
                _log.exception("the heartbeat has failed")

    def _note(self, answered_at: float | None = None, lost: bool = False) -> None:
        with self._news:
            self._answered_at = self._answered_at if answered_at is None else answered_at
            self.lost = lost
            self._news.notify_all()


class _Asker:
    """Asks for the master's process id."""

    def __init__(self, uri: str) -> None:
        self._master = Client(uri, "/node_kit")

    def __call__(self, timeout: float) -> Answer | Refusal | Silence:
        """Ask, and wait for so many wall s."""
        try:
            return Answer(self._master.pid(timeout))
        except GoneError:
            return Refusal()
        except SilentError as error:
            return Silence(error.reason)
        except CallError as error:
            return Silence(f"garbage: {error.reason}")
