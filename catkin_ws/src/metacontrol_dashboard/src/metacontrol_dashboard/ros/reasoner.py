"""Follows the running reasoner by its journal: what it knows, and what it would do."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

import rospy
from mros1_reasoner.io.reasoner_bag import JournalReader
from mros1_reasoner.io.reasoners import make_reasoner
from mros1_reasoner.io.replaying import make_loop
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.entries import Command
from mros1_reasoner.loop.entry_text import kind_of, values_of
from mros1_reasoner.replay.recording import RecordingError
from mros1_reasoner.replay.shadow import Shadow, Supposed, without_heartbeats

from metacontrol_dashboard.io.bags import UNFIT
from metacontrol_dashboard.state.knowledge import SECTIONS, knowledge_entries, upper_limits

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from metacontrol_msgs.msg import ReasonerJournal
    from mros1_reasoner.loop.entries import Entry
    from mros1_reasoner.replay.recording import Run

    from metacontrol_dashboard.state.feed import Feed
    from metacontrol_dashboard.state.store import Store

_PERIOD = 0.5  # s, wall, between two looks at what the reasoner knows
_LATE = 200  # entries from which on a journal is one to catch up with


class ReasonerFollower:
    """A shadow of the running reasoner. The journal comes in a thread of rospy; looks come in the node's."""

    def __init__(self, store: Store, feed: Feed, lock: threading.Lock) -> None:
        """Follow nobody yet.

        Args:
            store: gets what the reasoner knows.
            feed: gets its limits.
            lock: to hold while store and feed change.
        """
        self._store, self._feed, self._lock = store, feed, lock
        self._working = threading.Lock()
        self._reader = JournalReader()
        self._run_name = ""
        self._shadow: Shadow | None = None
        self._problem = "no reasoner has told its journal yet"
        self._looked = 0.0

    def take(self, message: ReasonerJournal) -> None:
        """Take a message of the journal."""
        with self._working:
            try:
                run, fresh = self._reader.take(message)
            except RecordingError as error:
                self._problem, self._shadow = str(error), None
                return
            if not run.parameters:
                return  # its beginning comes
            if run.name != self._run_name or self._shadow is None:
                if run.name == self._run_name:
                    return  # it could not be followed
                self._run_name = run.name
                self._begin(run)
            self._follow(fresh)

    def look(self, stamp: float, limits: Mapping[str, float]) -> None:
        """Tell what the reasoner knows now; called with the lock held.

        Args:
            stamp: ROS time, s.
            limits: those that the parameters have, for a system without a reasoner's journal.
        """
        now = time.monotonic()
        if now - self._looked < _PERIOD or not self._working.acquire(blocking=False):
            return
        self._looked = now
        try:
            self._store.set("system", "reasoner", "" if self._shadow else self._problem)
            if self._shadow is None:
                self._feed.take_limits(limits)
                return
            view = self._shadow.view
            self._feed.take_limits(upper_limits(view))
            entries = knowledge_entries(view, stamp, self._shadow.remarks)
        finally:
            self._working.release()
        for section in SECTIONS:
            self._store.replace(section, entries[section])

    def suppose(self, stamp: float, failed: Sequence[str], limits: Mapping[str, float]) -> Supposed:
        """Return what the reasoner would do.

        Raises:
            MapeError, ReasonerError, RecordingError: it can't be told.
        """
        with self._working:
            if self._shadow is None:
                raise RecordingError(self._problem)
            return self._shadow.suppose(stamp, failed, limits)

    def _begin(self, run: Run) -> None:
        engine = make_reasoner("rules")
        try:
            core, knowledge_base, _ = make_loop(run, engine)
        except UNFIT as error:
            self._problem, self._shadow = " ".join(str(error).split()), None
            rospy.logwarn("what the reasoner knows is not shown: %s", self._problem)
            return
        self._shadow = Shadow(core, knowledge_base, engine)

    def _follow(self, entries: Sequence[Entry]) -> None:
        if self._shadow is None:
            return
        is_late = len(entries) > _LATE
        try:
            self._shadow.follow(without_heartbeats(entries) if is_late else entries)
        except ReasonerError as error:
            self._problem, self._shadow = str(error), None
            return
        commands = [entry for entry in entries if isinstance(entry.content, Command)]
        if commands:
            with self._lock:
                for entry in commands:
                    words = " ".join((kind_of(entry.content), *values_of(entry.content)))
                    self._feed.take_command(entry.now, words)
