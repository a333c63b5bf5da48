"""Whether the system that a mission needs is up, as far as its topics tell."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from metacontrol_msgs.msg import FunctionGrounding

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from metacontrol_bags.record import ConfigurationReport

    Condition = tuple[Callable[[], bool], str]


@dataclass
class Readiness:
    """The reports of the system so far.

    Attributes:
        stable: the manipulator reports functions, and all of them as STABLE.
        failed: why the manipulator gave up, None where it has not.
        has_server: a status of the action's server.
        has_graph: the monitor's first look at the graph.
        observed: quality attributes of which a level came in.
    """

    stable: bool = False
    failed: str | None = None
    has_server: bool = False
    has_graph: bool = False
    observed: set[str] = field(default_factory=set)

    def take_configurations(self, reports: Iterable[ConfigurationReport]) -> None:
        """Take in what the manipulator reports of every function."""
        reports = tuple(reports)
        broken = [report for report in reports if report.state == FunctionGrounding.FAILED]
        self.stable = bool(reports) and all(report.state == FunctionGrounding.STABLE for report in reports)
        self.failed = f"the manipulator could not deploy {broken[0].configuration}" if broken else None

    def conditions(self, qualities: Iterable[str], server: str) -> Iterator[Condition]:
        """Yield the conditions that must become true, in their order, each with its description.

        Args:
            qualities: quality attributes of which a level must come in.
            server: the action's, in words.
        """
        yield lambda: self.stable, "a STABLE configuration on rosgraph_manipulator/active_configuration"
        yield lambda: self.has_server, server
        yield lambda: self.has_graph, "the monitor's first look at the graph, on /diagnostics"
        for quality in qualities:
            yield partial(self._is_observed, quality), f"a level of {quality} on /diagnostics, from its observer"

    def _is_observed(self, quality: str) -> bool:
        return quality in self.observed
