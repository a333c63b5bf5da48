"""Writes bags as a recorder beside a reasoner leaves them, with rosbags alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml
from mros1_reasoner.loop import journal
from mros1_reasoner.loop.entries import ActiveFact, Entry, Result, Step
from mros1_reasoner.loop.entry_text import kind_of, values_of
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.ros.messages import fill_decision
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MESSAGES = Path(__file__).parents[3] / "catkin_ws" / "src" / "metacontrol_msgs" / "msg"
NEEDED = ("ExpectedQA", "Candidate", "Cause", "Decision", "JournalEntry", "ReasonerJournal", "MissionEvent")
DIAGNOSTICS = "diagnostic_msgs/msg/"


class Types:
    """Message classes by their plain names; headers are optional."""

    def __init__(self):
        self.store = get_typestore(Stores.ROS1_NOETIC)
        texts = {name: (MESSAGES / f"{name}.msg").read_text() for name in NEEDED}
        texts["FunctionGrounding"] = "string function\nstring configuration\nstring state"
        texts["ActiveConfiguration"] = "Header header\nFunctionGrounding[] functions"  # more fields do no harm
        for name, text in texts.items():
            self.store.register(get_types_from_msg(text, f"metacontrol_msgs/msg/{name}"))

    def __getattr__(self, name):
        return self.store.types[f"metacontrol_msgs/msg/{name}"]

    def time(self, stamp):
        whole = int(stamp)
        return self.store.types["builtin_interfaces/msg/Time"](sec=whole, nanosec=round((stamp - whole) * 1e9))

    def header(self, stamp):
        return self.store.types["std_msgs/msg/Header"](seq=0, stamp=self.time(stamp), frame_id="")

    def decision(self, decision, stamp):
        empty = {name: None for name in self.Decision.__dataclass_fields__ if name != "header"}
        return fill_decision(self.Decision(header=self.header(stamp), **empty), decision, self.time, self)


class Bag:
    """A bag being written."""

    def __init__(self, path):
        self.types = Types()
        self._writer = Writer(path)
        self._connections = {}

    def __enter__(self):
        self._writer.open()
        return self

    def __exit__(self, *_):
        self._writer.close()

    def write(self, topic, kind, message, stamp, publisher=None):
        key = topic, publisher
        if key not in self._connections:
            self._connections[key] = self._writer.add_connection(
                topic, kind, typestore=self.types.store, callerid=publisher
            )
        data = self.types.store.serialize_ros1(message, kind)
        self._writer.write(self._connections[key], round(stamp * 1e9), data)

    def decision(self, decision, stamp, topic="/mros1_reasoner/decision"):
        self.write(topic, "metacontrol_msgs/msg/Decision", self.types.decision(decision, stamp), stamp)

    def journal(
        self, stamp, entries, first, name, parameters=None, files=None, topic="/mros1_reasoner/journal", more=()
    ):
        message = self.types.ReasonerJournal(
            header=self.types.header(stamp),
            name=name,
            parameters=yaml.safe_dump(parameters) if parameters else "",
            files=list(files or ()),
            contents=list((files or {}).values()),
            first=first,
            entries=[
                self.types.JournalEntry(now=e.now, kind=kind_of(e.content), values=list(values_of(e.content)))
                for e in entries
            ]
            + list(more),
        )
        self.write(topic, "metacontrol_msgs/msg/ReasonerJournal", message, stamp)

    def statuses(self, stamp, *statuses, publisher=None, hardware_id=""):
        """Write statuses given as (message, name, level, ((key, value), ...))."""
        types = self.types.store.types
        found = [
            types[f"{DIAGNOSTICS}DiagnosticStatus"](
                level=level,
                name=name,
                message=message,
                hardware_id=hardware_id,
                values=[types[f"{DIAGNOSTICS}KeyValue"](key=key, value=value) for key, value in values],
            )
            for message, name, level, values in statuses
        ]
        array = types[f"{DIAGNOSTICS}DiagnosticArray"](header=self.types.header(stamp), status=found)
        self.write("/diagnostics", f"{DIAGNOSTICS}DiagnosticArray", array, stamp, publisher)

    def image(self, stamp, shade, topic):
        kind = "sensor_msgs/msg/Image"
        size = {"height": 6, "width": 8, "step": 8}
        data = np.full(48, shade, dtype=np.uint8)
        header = self.types.header(stamp)
        image = self.types.store.types[kind](header=header, encoding="mono8", is_bigendian=0, data=data, **size)
        self.write(topic, kind, image, stamp)

    def event(self, stamp, kind, space="", **values):
        pairs = self.types.store.types[f"{DIAGNOSTICS}KeyValue"]
        message = self.types.MissionEvent(
            header=self.types.header(stamp),
            kind=kind,
            name="",
            values=[pairs(key=key, value=value) for key, value in values.items()],
        )
        self.write(f"{space}/mission/event", "metacontrol_msgs/msg/MissionEvent", message, stamp)

    def active(self, stamp, function, configuration, state="STABLE", space=""):
        grounding = self.types.FunctionGrounding(function=function, configuration=configuration, state=state)
        message = self.types.ActiveConfiguration(header=self.types.header(stamp), functions=[grounding])
        topic = f"{space}/rosgraph_manipulator/active_configuration"
        self.write(topic, "metacontrol_msgs/msg/ActiveConfiguration", message, stamp)


class Life:
    """A reasoner's life without ROS: takes entries in as the node does, and keeps what the node publishes."""

    def __init__(self, core: Mape, takes=0.5):
        self.core = core
        self.takes = takes  # s, a reconfiguration
        self.entries: list[Entry] = []
        self.decisions: list[tuple[float, object]] = []

    def take(self, now, content):
        entry = Entry(now, content)
        decisions = journal.apply(self.core, entry)
        self.entries += [entry, *journal.brought(now, decisions)]
        self.decisions += [(now, decision) for decision in decisions]

    def live(self, until, given, start=0.0, period=0.1):
        """Take in what is given as (stamp, content), look in between, carry requests out."""
        given = sorted(given, key=lambda item: item[0])
        requested = None
        for tick in range(round((until - start) / period) + 1):
            now = start + tick * period
            while given and given[0][0] <= now:
                self.take(now, given.pop(0)[1])
            pending = self.core.pending
            if pending and requested is None:
                requested = now
            elif pending and now >= requested + self.takes:
                requested = None
                self.take(now, ActiveFact("f_move", pending.to_configuration, "STABLE"))
                self.take(now, Result(pending.id, ok=True))
            self.take(now, Step(heartbeat=False))
