"""A mission as lines for people: one line for each change.

Monitor and observers report at every tick; the timeline leaves out what is as before.
"""

from __future__ import annotations

from dataclasses import dataclass

from metacontrol_bags.decision import DECIDED, EXECUTED, Decision
from metacontrol_bags.record import (
    ComponentReport,
    ConfigurationReport,
    Event,
    QualityReport,
)
from metacontrol_bags.violations import CALM_S
from metacontrol_bags.words import DiagnosticWords, FunctionGrounding, MissionEvent

_WELL_AGAIN = (DiagnosticWords.COMPONENT_RECOVERED, DiagnosticWords.COMPONENT_TRUE)

Report = ComponentReport | QualityReport | Decision | ConfigurationReport | Event


@dataclass(frozen=True)
class Entry:
    """A line of the timeline.

    Attributes:
        stamp: simulated seconds on the mission's clock.
        step: "R1" monitor, "R2" analyse, "R3" plan, "R4" execute, "!" perturbation or "-" the mission itself.
        text: what happened.
        bad: whether it is bad news.
    """

    stamp: float
    step: str
    text: str
    bad: bool = False


class Timeline:
    """Turns reports into lines, and remembers the last report on each subject."""

    def __init__(self, thresholds: dict[str, float]) -> None:
        """Know the threshold of each QA."""
        self._thresholds = thresholds
        self._components: dict[str, str] = {}
        self._violated: dict[str, float] = {}
        self._stale: set[str] = set()
        self._configurations: dict[str, ConfigurationReport] = {}

    def tell(self, report: Report) -> tuple[Entry, ...]:
        """Return the lines for a report; none if it says nothing new."""
        match report:
            case ComponentReport():
                return self._component(report)
            case QualityReport():
                return self._quality(report)
            case Decision():
                return _decision(report)
            case ConfigurationReport():
                return self._configuration(report)
            case Event():
                return _event(report)

    def _component(self, report: ComponentReport) -> tuple[Entry, ...]:
        former = self._components.get(report.component, DiagnosticWords.COMPONENT_TRUE)
        self._components[report.component] = report.status
        if report.status == former or (former, report.status) == _WELL_AGAIN:
            return ()
        bad = report.status == DiagnosticWords.COMPONENT_FALSE
        text = "has failed" if bad else "is back"
        return (Entry(report.stamp, "R1", f"component {report.component} {text}", bad),)

    def _quality(self, report: QualityReport) -> tuple[Entry, ...]:
        """Tell a level above its threshold, again only after it was below for a while."""
        if report.level is None:
            if report.name in self._stale:
                return ()
            self._stale.add(report.name)
            return (Entry(report.stamp, "R1", f"{report.name} cannot be observed: stale", True),)
        self._stale.discard(report.name)
        limit = self._thresholds.get(report.name)
        if limit is None or report.level <= limit:
            return ()
        last = self._violated.get(report.name)
        self._violated[report.name] = report.stamp
        if last is not None and report.stamp - last < CALM_S:
            return ()
        return (Entry(report.stamp, "R1", f"{report.name} {report.level:.2f} is above {limit:g}", True),)

    def _configuration(self, report: ConfigurationReport) -> tuple[Entry, ...]:
        former = self._configurations.get(report.function)
        self._configurations[report.function] = report
        if former is None or (former.configuration, former.state) == (report.configuration, report.state):
            return ()
        bad = report.state in (FunctionGrounding.FAILED, FunctionGrounding.RECOVERING)
        return (Entry(report.stamp, "R4", f"{report.function}: {report.configuration} {report.state}", bad),)


def _decision(report: Decision) -> tuple[Entry, ...]:
    change = f"{report.from_configuration or 'nothing'} -> {report.to_configuration or 'nothing'}"
    if report.state == DECIDED:
        how = ", degraded" if report.degraded else ""
        return (
            Entry(report.stamp, "R2", f"{report.objective} is violated by {report.trigger}", True),
            Entry(report.stamp, "R3", f"{change}{how}", not report.to_configuration),
        )
    done = "done" if report.state == EXECUTED else report.state.lower()
    return (Entry(report.stamp, "R4", f"{change} {done}", report.state != EXECUTED),)


def _event(report: Event) -> tuple[Entry, ...]:
    values = report.values
    if report.kind == MissionEvent.PERTURBATION:
        share = f" after {_share(values['share'])} of the way" if "share" in values else ""
        pid = f", pid {values['pid']}: {values.get('how', 'kill')}" if "pid" in values else ""
        return (Entry(report.stamp, "!", f"injected: {report.name}{share}{pid}", True),)
    if report.kind == MissionEvent.MISSION_START:
        route = f", route {values['route']}" if "route" in values else ""
        return (Entry(report.stamp, "-", f"goal sent{route}"),)
    outcome = values.get("outcome", "?")
    return (Entry(report.stamp, "-", f"mission over: {values.get('reason') or outcome}", outcome != "reached"),)


def _share(text: str) -> str:
    """Return a share of the way in per cent; as it is told where it is no number."""
    try:
        return f"{float(text):.0%}"
    except ValueError:
        return text
