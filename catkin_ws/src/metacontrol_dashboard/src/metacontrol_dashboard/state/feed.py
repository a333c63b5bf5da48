"""Turns what is heard of a system, live or from a bag, into the state that viewers see. Pure.

Sections of the state: `component`, `quality`, `finding`, `usage`, `part`, `function`, `change`, `decision`, `robot`,
`map`; those of the graph and of the reasoner's knowledge are in modules of their own. Logs: `timeline`, `configuration`
(stamp, function, configuration, state), and `level/NAME` for the levels of each quality.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from metacontrol_bags import messages, ownership
from metacontrol_bags.decision import PROPOSED
from metacontrol_bags.record import ComponentReport, CostReport, QualityReport
from metacontrol_bags.timeline import Timeline
from metacontrol_bags.words import DiagnosticWords, MissionEvent
from rosgraph_monitor.diagnostics.overview import Overview

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from metacontrol_bags.decision import Decision
    from metacontrol_bags.timeline import Report
    from node_kit.parts import Sign

    from metacontrol_dashboard.state.store import Store

_HISTORY = 50
"""Changes of a component's status that are kept."""
_DECISIONS = 200
"""Decisions that are kept."""
_SILENT = 2.0
"""Wall s without a sign of life after which a part of the meta-controller is silent."""
_SAME_PLACE = 0.02
"""m: the robot has moved when it has moved so far."""


class Feed:
    """What is heard goes in, changes of the state come out. Stamps are s of ROS time.

    Attributes:
        overview: what /diagnostics says at present.
    """

    def __init__(self, store: Store, namespace: str = "/") -> None:
        """Write into a store what is heard of the robot in a namespace."""
        self._store = store
        self._namespace = namespace
        self._limits: dict[str, float] = {}
        self._timeline = Timeline(self._limits)
        self.overview = Overview()
        self._decisions: list[str] = []
        self._parts: dict[str, tuple[str, float]] = {}

    def take_limits(self, limits: Mapping[str, float]) -> None:
        """Take the limits that levels may not exceed: passing one is a line of the timeline."""
        self._limits.clear()
        self._limits.update(limits)

    def take_diagnostics(self, array: Any, stamp: float, wall: float, publisher: str = "", topic: str = "") -> None:
        """Take a diagnostic_msgs/DiagnosticArray.

        Args:
            array: the message.
            stamp: when it came.
            wall: the same by a clock in s that goes on while simulated time stands still.
            publisher: name of the node that has published it; empty where it is not known.
            topic: resolved name of its topic.
        """
        array.status = ownership.own(array.status, self._namespace, publisher, topic or ownership.TOPIC)
        self.overview.take(array.status, wall)
        told = messages.header_stamp(array.header, stamp)
        for report in messages.diagnostics(array, stamp, self._namespace):
            match report:
                case QualityReport():
                    self._level(report)
                case CostReport():
                    self._cost(report)
                case ComponentReport():
                    self._component(report, told)
        self.look(wall)

    def look(self, wall: float) -> None:
        """Note which findings and parts are not told any more at a wall time in s."""
        self.overview.forget(wall)
        found = {
            f"{name}|{message}|{first}": {
                "name": name,
                "message": message,
                "level": row.level,
                "text": row.text,
                "values": dict(row.values),
            }
            for (name, message, first), row in self.overview.findings.items()
        }
        self._store.replace("finding", found)
        for node, (part, heard) in self._parts.items():
            self._store.set("part", node, {"part": part, "silent": wall - heard > _SILENT})

    def take_sign(self, sign: Sign, wall: float) -> None:
        """Take a sign of life of a part of the meta-controller."""
        if sign.ends:
            self._parts.pop(sign.node, None)
            self._store.drop("part", sign.node)
        else:
            self._parts[sign.node] = sign.part, wall
            self._store.set("part", sign.node, {"part": sign.part, "silent": False})

    def take_configuration(self, message: Any, stamp: float) -> None:
        """Take a metacontrol_msgs/ActiveConfiguration."""
        reports = messages.configurations(message, stamp)
        for report in reports:
            self._tell(report)
        functions = {r.function: {"configuration": r.configuration, "state": r.state} for r in reports}
        for name in {*functions, *self._store.keys("function")}:
            now = functions.get(name, {"configuration": "", "state": ""})
            if now != self._store.get("function", name):
                at = round(messages.header_stamp(message.header, stamp), 3)
                self._store.append("configuration", [at, name, now["configuration"], now["state"]])
        self._store.replace("function", functions)
        phases = [{"name": p.name, "duration": p.duration} for p in getattr(message, "phases", ())]
        change = {
            "stamp": messages.header_stamp(message.header, stamp),
            "tactic": str(getattr(message, "tactic", "")),
            "message": str(getattr(message, "message", "")),
            "phases": phases,
        }
        self._store.set("change", "last", change)

    def take_decision(self, decision: Decision) -> None:
        """Take a decision; it may be known in an earlier state."""
        if decision.id not in self._decisions:
            self._decisions.append(decision.id)
            while len(self._decisions) > _DECISIONS:
                self._store.drop("decision", self._decisions.pop(0))
        known = self._store.get("decision", decision.id)
        told = asdict(decision) | {"first": known["first"] if known else decision.stamp}
        if not self._store.set("decision", decision.id, told):
            return
        if decision.state == PROPOSED:
            change = f"{decision.from_configuration or 'nothing'} -> {decision.to_configuration}"
            self._line(decision.stamp, "R3", f"{change} waits for approval", decision=decision.id)
        else:
            self._tell(decision, decision.id)

    def take_event(self, event: Any) -> None:
        """Take an event of a mission."""
        if event.kind == MissionEvent.MISSION_END:
            outcome = event.values.get("outcome", "")
            told = "goal reached" if outcome == "reached" else event.values.get("reason") or outcome or "ended"
            self._store.set(
                "mission", "end", {"ok": outcome == "reached", "text": told, "stamp": round(event.stamp, 1)}
            )
        elif event.kind == MissionEvent.MISSION_START:
            self._store.drop("mission", "end")
        self._tell(event)

    def take_command(self, stamp: float, words: str) -> None:
        """Take what an operator has asked for, in words."""
        self._line(stamp, "O", f"operator: {words}")

    def take_pose(self, x: float, y: float, yaw: float) -> None:
        """Take where the robot is in the map, m and rad."""
        known = self._store.get("robot", "pose")
        if known and max(abs(known[0] - x), abs(known[1] - y), abs(known[2] - yaw)) < _SAME_PLACE:
            return
        self._store.set("robot", "pose", [round(x, 3), round(y, 3), round(yaw, 3)])

    def take_way(self, points: Sequence[tuple[float, float]]) -> None:
        """Take the way that the robot plans, points in m; they are thinned out."""
        step = max(1, len(points) // 100)
        thinned = [[round(x, 2), round(y, 2)] for x, y in (*points[:-1:step], *points[-1:])]
        self._store.set("robot", "way", thinned)

    def take_goal(self, x: float, y: float) -> None:
        """Take where the robot is to go, m in the map."""
        self._store.set("robot", "goal", [round(x, 2), round(y, 2)])

    def take_map(self, name: str, grid: Mapping[str, Any]) -> None:
        """Take a map, as `grids.packed` returns it; `name` is `map` or `costmap`."""
        self._store.set("map", name, dict(grid))

    def take_picture(self, address: str) -> None:
        """Take what a camera sees, as `pictures.picture` returns it."""
        self._store.set("robot", "camera", address)

    def take_clock(self, stamp: float) -> None:
        """Take the time."""
        self._store.set("clock", "now", round(stamp, 2))

    def _level(self, report: QualityReport) -> None:
        self._store.append(f"level/{report.name}", [round(report.stamp, 3), report.level])
        self._store.set("quality", report.name, {"level": report.level, "stamp": round(report.stamp, 3)})
        self._tell(report)

    def _cost(self, report: CostReport) -> None:
        known = self._store.get("usage", report.node) or {}
        self._store.set("usage", report.node, {**known, report.figure: round(report.value, 1)})

    def _component(self, report: ComponentReport, stamp: float) -> None:
        self._tell(report)
        known = self._store.get("component", report.component)
        row = self.overview.components.get(report.component)
        text = row.text if row else report.status
        reason = text.partition(": ")[2]
        if known and (known["status"], known["reason"]) == (report.status, reason):
            return
        history = [*(known["history"] if known else ()), [round(stamp, 3), report.status, reason]][-_HISTORY:]
        if known and known["status"] == report.status:  # only the reason has become known
            history = [*known["history"][:-1], [known["history"][-1][0], report.status, reason]]
        failures = (known["failures"] if known else 0) + (
            report.status == DiagnosticWords.COMPONENT_FALSE and not (known and known["status"] == report.status)
        )
        entry = {"status": report.status, "reason": reason, "since": history[-1][0]}
        self._store.set("component", report.component, entry | {"failures": failures, "history": history})

    def _tell(self, report: Report, decision: str = "") -> None:
        for line in self._timeline.tell(report):
            self._line(line.stamp, line.step, line.text, line.bad, decision)

    def _line(self, stamp: float, step: str, text: str, bad: bool = False, decision: str = "") -> None:
        line = {"t": round(stamp, 3), "step": step, "text": text, "bad": bad}
        self._store.append("timeline", line | ({"decision": decision} if decision else {}))
