"""Which differences are told: no late start, and no connection that is short-lived. Pure; time is an argument."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rosgraph_monitor.graph.findings import (
    NO_NODE,
    AdditionalNode,
    MissingConnection,
    MissingNode,
    PortFinding,
    WrongParameter,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ros_model.language.metamodel import RosSystem

    from rosgraph_monitor.graph.findings import Finding

SHORT_LIVED = 2
"""How often a difference in interfaces comes and goes in the life of its processes until it is told no more: once may
be a late start, and once a fault."""


@dataclass(frozen=True)
class Look:
    """What one comparison has looked at.

    Attributes:
        findings: what differs.
        processes: address of each node of the desired system that runs, by the name that findings have.
        judged: those of them that were compared.
        system: the desired system.
    """

    findings: tuple[Finding, ...]
    processes: Mapping[str, str]
    judged: frozenset[str]
    system: RosSystem | None


@dataclass
class _Port:
    """A difference in interfaces: since when it is there (None: it has gone), and how often it came."""

    since: float | None
    times: int = 1


class Settling:
    """Follows the differences from look to look."""

    def __init__(self, startup: float, ports: float) -> None:
        """Start with nothing known.

        Args:
            startup: s that a node, and the monitor itself, may take to start.
            ports: s for which a difference in interfaces must last.
        """
        self._startup, self._patience = startup, ports
        self._began: float | None = None
        self._up_since: dict[tuple[str, str], float] = {}
        self._ports: dict[tuple[PortFinding, tuple[str, ...]], _Port] = {}
        self._wrong: dict[tuple[str, str, str], float] = {}  # when a parameter is told to be wrong
        self._last = Look((), {}, frozenset(), None)

    def told(self, look: Look, now: float) -> list[Finding]:
        """Return the findings of a look that are told.

        Missing nodes are told. An additional node is not told while the monitor may not know the active configuration.
        A parameter that was right is told; one that was wrong from the beginning may yet be set. A difference in
        interfaces must last, must not be that of a node that starts, and is told no more when it has come and gone.

        Args:
            look: of this moment.
            now: wall s.
        """
        self._began = now if self._began is None else self._began
        self._up_since = {item: self._up_since.get(item, now) for item in look.processes.items()}
        wrong = self._wrong_parameters(look, now)
        ports = self._differing_ports(look, now)
        knows_all = now - self._began >= self._startup
        self._last = look

        def is_told(finding: Finding) -> bool:
            match finding:
                case MissingNode():
                    return True
                case AdditionalNode():
                    return knows_all
                case WrongParameter():
                    return _key(finding) in wrong
                case _:
                    return finding in ports

        return list(filter(is_told, look.findings))

    def _wrong_parameters(self, look: Look, now: float) -> set[tuple[str, str, str]]:
        wrong = {}
        for finding in look.findings:
            if isinstance(finding, WrongParameter):
                key = _key(finding)
                first = now if self._was_judged(finding.node, look) else now + self._startup
                wrong[key] = self._wrong.get(key, first)
        self._wrong = wrong
        return {key for key, when in wrong.items() if now >= when}

    def _was_judged(self, node: str, look: Look) -> bool:
        """Return whether the same process was compared with the same model at the last look."""
        last = self._last
        if last.system is not look.system:
            return False
        return node == NO_NODE or (node in last.judged and last.processes.get(node) == look.processes.get(node))

    def _differing_ports(self, look: Look, now: float) -> set[PortFinding]:
        young = {node for node, uri in look.processes.items() if now - self._up_since[node, uri] < self._startup}
        present = {
            (finding, _uris(finding, look.processes)): finding
            for finding in look.findings
            if isinstance(finding, PortFinding)
        }
        for key in present:
            port = self._ports.setdefault(key, _Port(now))
            if port.since is None:
                port.since, port.times = now, port.times + 1
        for key in self._ports.keys() - present.keys():
            finding, uris = key
            nodes = concerned(finding)
            if _uris(finding, look.processes) != uris or not young.isdisjoint(nodes):
                del self._ports[key]  # of a process that has ended, or has not started yet
            elif all(node in look.judged or node not in look.processes for node in nodes):
                self._ports[key].since = None
        return {
            finding
            for key, finding in present.items()
            if (port := self._ports[key]).since is not None
            and now - port.since >= self._patience
            and port.times <= SHORT_LIVED
            and young.isdisjoint(concerned(finding))
        }


def concerned(finding: PortFinding) -> tuple[str, ...]:
    """Return the nodes to which a finding applies."""
    return finding.nodes if isinstance(finding, MissingConnection) else (finding.node,)


def _uris(finding: PortFinding, processes: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(processes.get(node, "") for node in concerned(finding))


def _key(finding: WrongParameter) -> tuple[str, str, str]:
    return finding.node, finding.parameter, repr(finding.expected)
