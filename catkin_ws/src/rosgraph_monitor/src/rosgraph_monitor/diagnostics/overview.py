"""Tables for a terminal: the present state of functions, nodes, qualities and findings. Pure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from metacontrol_msgs.msg import DiagnosticWords as Words
from metacontrol_msgs.msg import FunctionGrounding
from node_kit.one_line import one_line
from node_kit.parts import Parts
from rich.console import Group
from rich.table import Table
from rich.text import Text

from rosgraph_monitor.diagnostics import status as s
from rosgraph_monitor.graph.names import relative

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_FORGET = 3.0
"""Wall s after which a finding that is not repeated is over."""
_SILENT = 2.0
"""Wall s without a sign of life after which a part of the meta-controller is silent."""
_STYLE = {s.Level.OK: "green", s.Level.WARN: "yellow", s.Level.ERROR: "bold red", s.Level.STALE: "magenta"}
_THRESHOLD = "nfr_"


@dataclass
class Row:
    """What is known of something.

    Attributes:
        at: when it was told last, wall s.
        level: of the status.
        text: in words.
        values: of the status, by their keys.
    """

    at: float
    level: int
    text: str
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Overview:
    """The present state, by name."""

    components: dict[str, Row] = field(default_factory=dict)
    qualities: dict[str, Row] = field(default_factory=dict)
    findings: dict[tuple[str, str, str], Row] = field(default_factory=dict)
    usage: dict[tuple[str, str], str] = field(default_factory=dict)
    functions: dict[str, tuple[str, str]] = field(default_factory=dict)
    """The configuration of each, and its state."""
    parts: Parts = field(default_factory=Parts)
    """The parts of the meta-controller, by their signs of life."""

    def take_configuration(self, message: Any) -> None:
        """Take in what the manipulator runs (metacontrol_msgs/ActiveConfiguration)."""
        self.functions = {f.function: (f.configuration, f.state) for f in message.functions}

    def take(self, statuses: Iterable[Any], now: float) -> None:
        """Take in statuses (diagnostic_msgs/DiagnosticStatus) that arrived at wall time `now` in s."""
        for status in statuses:
            level = _level(status)
            first = status.values[0] if status.values else None
            if status.message == Words.COMPONENT_STATUS and first:
                why = next((value.value for value in status.values[1:] if value.key == Words.REASON), "")
                self.components[first.key] = Row(now, level, f"{first.value}: {why}" if why else first.value)
            elif status.message in (Words.QA_STATUS, Words.QA_STALE) and first:
                self.qualities[first.key] = Row(now, level, first.value)
            elif status.message in (Words.CPU_USAGE, Words.MEMORY_USAGE) and first:
                self.usage[status.name, status.message] = first.value
            elif level != s.Level.OK:
                values = {value.key: value.value for value in status.values}
                text = ", ".join(f"{value.key}: {value.value}" for value in status.values)
                key = (status.name, status.message, first.value if first else "")
                self.findings[key] = Row(now, level, text, values)

    def forget(self, now: float) -> None:
        """Forget the findings that are not repeated any more at wall time `now` in s."""
        self.findings = {key: row for key, row in self.findings.items() if now - row.at <= _FORGET}

    def render(self, nodes: Iterable[str], parameters: Mapping[str, Any], now: float) -> Group:
        """Return the tables.

        Args:
            nodes: names of the nodes that the master lists.
            parameters: the master's tree of parameters, in which `nfr_QUALITY` are thresholds.
            now: wall time in s.
        """
        self.forget(now)
        tables = (self._nodes(nodes, now), self._qualities(thresholds(parameters), now), self._findings())
        return Group(self._meta_controller(now), *([self._functions()] if self.functions else []), *tables)

    def _meta_controller(self, now: float) -> Table:
        table = Table("part", "node", "state", title="Meta-controller", title_justify="left")
        for node, standing in self.parts.known.items():
            silent = now - standing.heard
            level, text = (s.Level.OK, "runs") if silent < _SILENT else (s.Level.ERROR, f"silent for {silent:.0f} s")
            table.add_row(_shown(standing.sign.part), _shown(node), _shown(text, _STYLE[level]))
        if not self._is_watched(now):
            table.add_row(
                _shown("monitor"), "", _shown("not heard: nobody watches what is below", _STYLE[s.Level.ERROR])
            )
        return table

    def _is_watched(self, now: float) -> bool:
        return any(p.sign.part == "monitor" and now - p.heard < _SILENT for p in self.parts.known.values())

    def _functions(self) -> Table:
        table = Table("function", "configuration", "state", title="Functions", title_justify="left")
        for name, (configuration, state) in sorted(self.functions.items()):
            style = _STYLE[s.Level.OK if state == FunctionGrounding.STABLE else s.Level.WARN]
            table.add_row(_shown(name), _shown(configuration), _shown(state, style))
        return table

    def _nodes(self, nodes: Iterable[str], now: float) -> Table:
        table = Table("node or component", "status", "CPU %", "MB", title="Nodes", title_justify="left")
        names = {name.lstrip("/") for name in nodes}
        gone = {name: message for name, message, _ in self.findings if message == Words.MISSING_NODE}
        for name in sorted(names | gone.keys() | self.components.keys()):
            row = self.components.get(name)
            unseen = (s.Level.OK, "registered") if self._is_watched(now) else (s.Level.STALE, "registered, not watched")
            level, text = unseen if row is None else (row.level, row.text)
            if name in gone:
                level, text = s.Level.ERROR, self._reason(name)
            table.add_row(
                _shown(name),
                _shown(text, _STYLE.get(s.Level(level), "")),
                _shown(self.usage.get((name, Words.CPU_USAGE), "")),
                _shown(self.usage.get((name, Words.MEMORY_USAGE), "")),
            )
        return table

    def _reason(self, node: str) -> str:
        return next(reason for name, message, reason in self.findings if (name, message) == (node, Words.MISSING_NODE))

    def _qualities(self, limits: Mapping[str, float], now: float) -> Table:
        table = Table("quality", "level", "required", "age s", title="Quality attributes", title_justify="left")
        for name, row in sorted(self.qualities.items()):
            limit = f"{limits[name]:g}" if name in limits else ""
            table.add_row(
                _shown(name), _shown(row.text, _STYLE.get(s.Level(row.level), "")), limit, f"{now - row.at:.1f}"
            )
        return table

    def _findings(self) -> Table:
        table = Table("what", "finding", "values", title="Findings", title_justify="left")
        for (name, message, _), row in sorted(self.findings.items()):
            table.add_row(_shown(name), _shown(message, _STYLE.get(s.Level(row.level), "")), _shown(row.text))
        return table


def of_robot(
    nodes: Iterable[str], parameters: Mapping[str, Any], namespace: str
) -> tuple[list[str], Mapping[str, Any]]:
    """Return the names of nodes and the tree of parameters of the robot in a namespace, relative to it."""
    tree: Any = parameters
    for part in filter(None, namespace.split("/")):
        tree = tree.get(part, {}) if isinstance(tree, dict) else {}
    names = (relative(name, namespace) for name in nodes)
    return [name for name in names if name], tree if isinstance(tree, dict) else {}


def thresholds(parameters: Mapping[str, Any]) -> dict[str, float]:
    """Return the required level of each quality, from the parameters `nfr_QUALITY` of any node."""
    found: dict[str, float] = {}
    for key, value in parameters.items():
        if isinstance(value, dict):
            found |= thresholds(value)
        elif key.startswith(_THRESHOLD) and isinstance(value, (int, float)):
            found[key.removeprefix(_THRESHOLD)] = float(value)
    return found


def _level(status: Any) -> int:
    """Return the level, which generated messages hold as a number or as a byte."""
    level = status.level
    number = level[0] if isinstance(level, bytes) and level else int(level or 0)
    return number if number in set(s.Level) else int(s.Level.ERROR)


def _shown(text: str, style: str = "") -> Text:
    """Return a cell with what others have said."""
    return Text(one_line(text), style)
