"""Repairs of components: how each one ends, and which drivers have to be started again."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from rosgraph_launcher.launching.report import CHANGING, FAILED, LauncherReport

from rosgraph_manipulator.configuration.configurations import Configuration, Repair

_NAME = "__name:="
TRIGGER, EMPTY = "std_srvs/Trigger", "std_srvs/Empty"
RETRY_PERIOD = 1.0  # s, wall, between two tries to start a lost driver


@dataclass(frozen=True)
class RepairOutcome:
    """How a repair ended.

    Attributes:
        ok: whether what was to be done is done.
        message: what was done, or why it could not be, in one line.
    """

    ok: bool
    message: str


class RepairsUnderWay:
    """The components that are being repaired at this moment."""

    def __init__(self, repairs: Mapping[str, Repair]) -> None:
        """Begin with none.

        Args:
            repairs: the repairs that are known, by component.
        """
        self._repairs = repairs
        self._components: set[str] = set()

    def begin(self, component: str) -> str:
        """Begin the repair of a component, or return why it is refused, in one line."""
        if component not in self._repairs:
            known = ", ".join(sorted(self._repairs)) or "none"
            return f"no repair is known for component '{component}'; known are: {known}"
        if component in self._components:
            return f"{component} is being repaired already: ask again when that has ended"
        self._components.add(component)
        return ""

    def end(self, component: str) -> None:
        """Note that the repair of a component has ended."""
        self._components.discard(component)


def why_not_called(component: str, service: str, kind: str | None) -> str:
    """Return why a service can't repair a component, with the remedy; empty where it can.

    Args:
        component: its name.
        service: full name of the service.
        kind: its type, e.g. `std_srvs/Trigger`; None: nobody offers it.
    """
    where = f"repairs/{component}/service"
    if kind is None:
        return f"nobody offers the service {service}: start its node, or correct {where}"
    if kind not in (TRIGGER, EMPTY):
        return f"service {service} is of type {kind}, not {TRIGGER} or {EMPTY}: name another one in {where}"
    return ""


def told_by_service(service: str, response: Any) -> RepairOutcome:
    """Return how a repair ended, by what its service has answered.

    Args:
        service: full name of the service.
        response: of std_srvs/Trigger or std_srvs/Empty.
    """
    ok, words = bool(getattr(response, "success", True)), " ".join(str(getattr(response, "message", "")).split())
    if ok:
        return RepairOutcome(True, f"{service} was called{words and f': {words}'}")
    return RepairOutcome(False, f"{service} has failed: {words or 'it does not say why'}")


def told_by_launcher(
    report: LauncherReport | None, change: int, missing: Collection[str], conflict: str, timeout: float | None
) -> RepairOutcome | None:
    """Return how the start of a driver ended; None: it is under way.

    A node that dies meanwhile is started again by the launcher, as often as the launcher tolerates.

    Args:
        report: the launcher's last one of the driver.
        change: number of the change that has started it.
        missing: the nodes that do not answer under their names yet.
        conflict: who has taken the name of one of them, for the end of a line; empty: nobody has.
        timeout: the time that they had, if it is over, s; None: it is not.
    """
    if report is not None and report.state == FAILED and report.change == change:
        return RepairOutcome(False, report.message)
    if not missing:
        nodes = report.nodes if report else ()
        return RepairOutcome(True, f"started again: {', '.join(nodes) or 'its nodes have done their work'}")
    if timeout is None:
        return None
    awaited = f"node{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
    return RepairOutcome(False, f"not up within {timeout:g} s: {awaited}{conflict}; see their logs")


def may_be_asked(node: str, words: Iterable[str]) -> bool:
    """Tell whether a node may be asked to end at the address that the master knows.

    The node may be dead, and its address another one's now: roslaunch puts the name of each node into its command.

    Args:
        node: its full name.
        words: of the command line of the process that listens at the address; empty: nothing is known of it.
    """
    return _name_in(words) in ("", _base(node))


def may_be_killed(node: str, words: Iterable[str]) -> bool:
    """Tell whether the process that listens at the address of a node is surely the node's own."""
    return _name_in(words) == _base(node)


def _name_in(words: Iterable[str]) -> str:
    names = [word.removeprefix(_NAME) for word in words if word.startswith(_NAME)]
    return names[-1] if names else ""


def _base(node: str) -> str:
    return node.rpartition("/")[2]


class RepairedDrivers:
    """The drivers that the launcher runs since a repair, as configurations."""

    def __init__(self, drivers: Iterable[Configuration], report: Callable[[str], LauncherReport | None]) -> None:
        """Begin with those that run already, because an earlier manipulator has repaired them.

        Args:
            drivers: all that a repair may start.
            report: returns the launcher's last report of a function; None: it has made none at all yet.
        """
        self._report = report
        self._running = {driver for driver in drivers if _runs(driver, report(driver.function))}
        self._next_try: dict[Configuration, float] = {}

    def started(self, driver: Configuration) -> None:
        """Note that the launcher runs a driver."""
        self._running.add(driver)

    def given_up(self) -> list[LauncherReport]:
        """Return the reports of drivers that the launcher has given up since the last call; it runs them no more."""
        reports = {driver: self._report(driver.function) for driver in self._running}
        failed = {driver: report for driver, report in reports.items() if report and report.state == FAILED}
        self._running -= failed.keys()
        return list(failed.values())

    def lost(self, now: float) -> list[Configuration]:
        """Return the drivers that have ended with their launcher, which is there again, and that are to be started now.

        Args:
            now: monotonic s.
        """
        reports = {driver: self._report(driver.function) for driver in self._running}
        lost = [
            driver
            for driver, report in reports.items()
            if report and report.state not in (CHANGING, FAILED) and report.configuration != driver.name
        ]
        due = [driver for driver in lost if now >= self._next_try.get(driver, now)]
        return sorted(due, key=lambda driver: driver.name)

    def tried(self, driver: Configuration, now: float) -> None:
        """Note that a lost driver was started again, or could not be; `lost` leaves it out for a while."""
        self._next_try[driver] = now + RETRY_PERIOD


def _runs(driver: Configuration, report: LauncherReport | None) -> bool:
    return report is not None and report.configuration == driver.name and report.state != FAILED
