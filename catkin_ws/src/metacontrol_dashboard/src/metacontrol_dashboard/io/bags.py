"""Reads a recorded run from a bag, without ROS: what the page shows of it, and what other limits would have led to."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, replace
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from metacontrol_bags import messages, ownership
from metacontrol_bags.bag import robots
from metacontrol_bags.bag_file import BagError, BagFile, Connection
from metacontrol_bags.decoding import decode
from metacontrol_bags.words import MissionEvent
from mros1_reasoner.io.reasoner_bag import read_recording
from mros1_reasoner.io.reasoners import make_reasoner
from mros1_reasoner.io.replaying import make_loop, replay_run
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop import entries as journal_entries
from mros1_reasoner.loop.entry_text import kind_of, values_of
from mros1_reasoner.replay.comparison import pairs
from mros1_reasoner.replay.recording import RecordingError
from mros1_reasoner.replay.rerun import Replayed
from mros1_reasoner.replay.shadow import Shadow
from node_kit.parameters import ParameterError
from ros_model.errors import ModelError

from metacontrol_dashboard.state.feed import Feed
from metacontrol_dashboard.state.graph import Entries, entries_of_bag, judged
from metacontrol_dashboard.state.knowledge import knowledge_entries, upper_limits
from metacontrol_dashboard.state.places import CAMERA, take_place, topics_of_places
from metacontrol_dashboard.state.recording import Recorder, Recording
from metacontrol_dashboard.state.store import Store

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from mros1_reasoner.replay.recording import Recording as ReasonerRecording
    from mros1_reasoner.replay.recording import Run

UNFIT = (BagError, RecordingError, ParameterError, KnowledgeBaseError, ModelError, ReasonerError, OSError)
"""Errors of a bag, or of what it says of the reasoner, that can't be used; each is one line."""

_DECISION = "/mros1_reasoner/decision"
_ACTIVE = "/rosgraph_manipulator/active_configuration"
_EVENT = "/mission/event"
_KNOWLEDGE_PERIOD = 0.5  # s of the bag between two looks at what the reasoner knew
_IMAGE_PERIOD = 2.0  # s of the bag between two images of a camera that are shown
_MOST_IMAGES = 200  # of a bag
_RULES = "rules"  # the reasoner that needs no Java: it follows a journal, or decides again


def read_run(path: Path, namespace: str | None = None) -> Recording:
    """Return what the page shows of a bag, however damaged it is.

    Args:
        path: of the bag.
        namespace: of the robot; None: the only one that the bag has.

    Raises:
        BagError: the bag can't be read, holds several robots and no namespace is given, or tells of no run.
    """
    robot = _robot(path, namespace)
    heard, problems, topics = _read(path, robot)
    if not heard:
        lost = f" ({problems[0]})" if problems else ""
        raise BagError(f"{path}: tells of no run with a meta-controller{lost}: record /diagnostics and {_DECISION[1:]}")
    try:
        recording = read_recording(path, robot)
    except RecordingError as error:
        recording, problems = None, (*problems, str(error))
    store = Store(kept=1_000_000)
    player = _Player(store, robot)
    nodes, graph_topics = entries_of_bag(((c.publisher, c.topic, c.type) for c in topics), robot)
    player.show_graph(nodes, graph_topics)
    trouble = player.play(heard, recording.runs if recording else [])
    events = [m for _, kind, m, _ in heard if kind == _EVENT]
    begins = {e.kind: e.stamp for e in events}
    start, end = heard[0][0], heard[-1][0]
    over = [stamp for stamp, kind, m, _ in heard if kind == _EVENT and m.kind == MissionEvent.MISSION_END]
    return Recording(
        path.stem if path.stem != "mission" else path.resolve().parent.name,
        min(begins.get(MissionEvent.MISSION_START) or start, end),
        over[-1] if over else end,
        tuple(player.recorder.frames),
        (*problems, *trouble),
        can_replay=bool(recording and recording.runs and recording.runs[0].entries),
    )


def replay(path: Path, limits: Mapping[str, float], namespace: str | None = None) -> list[dict[str, Any]]:
    """Return the decisions of a bag beside those that other limits would have led to, in the order of time.

    Args:
        path: of the bag.
        limits: of qualities, in place of the recorded ones.
        namespace: of the robot.

    Raises:
        BagError, RecordingError: the bag can't be read, or has nothing to replay.
        ParameterError, KnowledgeBaseError, ModelError, ReasonerError: its models can't be used, or an analysis fails.
    """
    recording = read_recording(path, _robot(path, namespace))
    if not recording.runs:
        raise RecordingError(f"{path}: has no journal of the reasoner: record mros1_reasoner/journal")
    changes = {f"nfr_{name}": limit for name, limit in limits.items()}
    found = [_replay_run(recording, run, changes, limits) for run in recording.runs]
    whole = Replayed(
        tuple(decision for outcome in found for decision in outcome.decisions),
        min((outcome.parted for outcome in found if outcome.parted is not None), default=None),
        tuple(remark for outcome in found for remark in outcome.remarks),
    )
    return [
        {
            "t": pair.now,
            "recorded": asdict(pair.recorded) if pair.recorded else None,
            "replayed": asdict(pair.replayed) if pair.replayed else None,
        }
        for pair in pairs(recording, whole)
    ]


def _replay_run(
    recording: ReasonerRecording, run: Run, changes: Mapping[str, Any], limits: Mapping[str, float]
) -> Replayed:
    reasoner = make_reasoner(_RULES)
    try:
        return replay_run(recording, run, reasoner, changes, limits=limits)
    finally:
        reasoner.close()


def _robot(path: Path, namespace: str | None) -> str:
    if namespace is not None:
        return f"/{namespace.strip('/')}"
    found = robots(path)
    if len(found) > 1:
        raise BagError(f"{path}: holds several robots: choose one with --namespace: {', '.join(found)}")
    return found[0] if found else "/"


_Heard = tuple[float, str, Any, str]
"""Time of recording in s, what it is, the message, and who has published it; of a decision or event, what it says."""


def _read(path: Path, robot: str) -> tuple[list[_Heard], tuple[str, ...], list[Connection]]:
    """Return the messages that the page needs, in the order of time, what is lost, and the bag's connections."""
    home = robot.rstrip("/")
    with BagFile(path) as bag:
        bag.scan()
        connections = [c for number, c in bag.connections.items() if bag.counts[number]]
        length = ((bag.last or 0) - (bag.first or 0)) * 1e-9
    own = [c for c in connections if c.topic.startswith(f"{home}/")]
    places = {topic: role for role, topic in topics_of_places((c.topic, c.type) for c in own).items()}
    kinds = {ownership.TOPIC: ownership.TOPIC, **places}
    kinds |= {f"{home}{name}": name for name in (_DECISION, _ACTIVE, _EVENT)}
    heard: list[_Heard] = []
    period, due = max(_IMAGE_PERIOD, length / _MOST_IMAGES), 0.0

    def is_shown(connection: Connection, stamp: int) -> bool:
        nonlocal due
        if kinds[connection.topic] != CAMERA:
            return True
        if is_due := stamp * 1e-9 >= due:
            due = stamp * 1e-9 + period
        return is_due

    def take(connection: Connection, stamp: int, message: Any) -> None:
        time, kind = stamp * 1e-9, kinds[connection.topic]
        if kind == _DECISION:
            message = messages.decision(message, time)
        elif kind == _EVENT:
            message = messages.event(message, 0.0)
        heard.append((time, kind, message, connection.publisher))

    with BagFile(path) as bag:
        lost = decode(bag, lambda connection: connection.topic in kinds, take, is_shown)
        problems = (*bag.problems, *lost)
    return sorted(heard, key=itemgetter(0)), problems, connections


class _Player:
    """Plays a bag into a store, and cuts what changes into frames."""

    def __init__(self, store: Store, robot: str) -> None:
        self._store, self._robot = store, robot
        self._graph: tuple[Entries, Entries] = ({}, {})
        self._feed = Feed(store, robot)
        self.recorder = Recorder(store)
        self._shadow: Shadow | None = None
        self._left: list[journal_entries.Entry] = []
        self._looked = float("-inf")
        self._takers: dict[str, Callable[[float, Any, str], None]] = {
            ownership.TOPIC: self._take_diagnostics,
            _DECISION: lambda _t, m, _: self._feed.take_decision(m),
            _ACTIVE: lambda t, m, _: self._feed.take_configuration(m, t),
            _EVENT: lambda t, m, _: self._feed.take_event(m if m.stamp > 0.0 else replace(m, stamp=t)),
        }

    def show_graph(self, nodes: Entries, topics: Entries) -> None:
        """Show nodes and topics, as far as the bag tells of them."""
        self._graph = nodes, topics
        self._judge()

    def _judge(self) -> None:
        nodes, topics = judged(*self._graph, self._feed.overview.findings, self._robot)
        self._store.replace("node", nodes)
        self._store.replace("topic", topics)

    def _take_diagnostics(self, stamp: float, array: Any, publisher: str) -> None:
        before = set(self._feed.overview.findings)
        self._feed.take_diagnostics(array, stamp, stamp, publisher)
        if set(self._feed.overview.findings) != before:
            self._judge()

    def play(self, heard: list[_Heard], runs: list[Run]) -> list[str]:
        """Play all; return what went wrong, in words."""
        trouble: list[str] = []
        unfit: Counter[str] = Counter()
        lives = sorted((run for run in runs if run.entries), key=lambda run: run.entries[0].now)
        for stamp, kind, message, publisher in heard:
            while lives and lives[0].entries[0].now <= stamp:
                trouble += self._begin(lives.pop(0))
            trouble += self._follow(stamp)
            if kind == _DECISION:
                self._looked = float("-inf")  # what it changes is shown with it
            try:
                self._take(stamp, kind, message, publisher)
            except (AttributeError, LookupError, OverflowError, TypeError, ValueError):  # of a damaged definition
                unfit[kind] += 1
            self._feed.take_clock(round(stamp, 1))
            if kind in (_DECISION, _EVENT):
                self.recorder.cut(stamp)  # to the moment at which one jumps to it, and at which a run ends
            else:
                self.recorder.look(stamp)
        if heard:
            self.recorder.cut(heard[-1][0])
        return [*trouble, *(f"{count} messages on {kind} do not fit" for kind, count in unfit.items())]

    def _take(self, stamp: float, kind: str, message: Any, publisher: str) -> None:
        taker = self._takers.get(kind)
        if taker is not None:
            taker(stamp, message, publisher)
        else:
            take_place(self._feed, kind, message)

    def _begin(self, run: Run) -> list[str]:
        """Follow a reasoner from its start; return why it can't be followed."""
        reasoner = make_reasoner(_RULES)
        try:
            core, knowledge_base, _ = make_loop(run, reasoner)
        except UNFIT as error:
            return [f"what the reasoner knew is not shown: {' '.join(str(error).split())}"]
        self._shadow, self._left = Shadow(core, knowledge_base, reasoner), list(run.entries)
        return []

    def _follow(self, stamp: float) -> list[str]:
        if self._shadow is None or stamp - self._looked < _KNOWLEDGE_PERIOD:
            return []
        self._looked = stamp
        count = next((i for i, entry in enumerate(self._left) if entry.now > stamp), len(self._left))
        due, self._left = self._left[:count], self._left[count:]
        for entry in due:
            if isinstance(entry.content, journal_entries.Command):
                words = " ".join((kind_of(entry.content), *values_of(entry.content)))
                self._feed.take_command(entry.now, words)
        try:
            self._shadow.follow(due)
        except ReasonerError as error:
            self._shadow = None
            return [f"what the reasoner knew is not shown from {stamp:.1f} s on: {error}"]
        view = self._shadow.view
        self._feed.take_limits(upper_limits(view))
        for section, values in knowledge_entries(view, stamp, self._shadow.remarks).items():
            self._store.replace(section, values)
        return []
