"""What one launcher tells: by its reports, and by its answers to requests, which may arrive before them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from rosgraph_launcher.launching.report import CHANGING, LauncherReport


class Reported:
    """What a launcher has told of each function.

    Its reports come over a topic and its answers by a service, so an answer may overtake reports, by seconds where the
    host is busy or a connection is made anew. What was true before a change that has been answered says nothing of what
    runs now: until the change itself is reported, its function counts as CHANGING.
    """

    def __init__(self) -> None:
        self._reports: dict[str, LauncherReport] = {}
        self._answered: dict[str, int] = {}  # by function: number of the last change that was answered
        self._connection: object = None

    @property
    def connection(self) -> object:
        """The connection over which it reports; None: it has not reported yet."""
        return self._connection

    @property
    def functions(self) -> frozenset[str]:
        """The functions of which it has told anything."""
        return frozenset(self._reports) | frozenset(self._answered)

    def take(self, reports: Mapping[str, LauncherReport], connection: object) -> bool:
        """Take in the reports of all functions; return whether they are the first ones over a connection.

        The first ones may be of another process, which counts its changes from the start. They are of what is now.
        """
        is_first = connection is not self._connection
        if is_first:
            self._answered = {}
        self._reports, self._connection = dict(reports), connection
        return is_first

    def answer(self, function: str, change: int, connection: object) -> None:
        """Note that it has answered a change.

        Args:
            function: the one that was changed.
            change: number of the change.
            connection: the one over which it reported when it was asked. Where that is another one by now, the answer
                may be of a process that has died.
        """
        if connection is not None and connection is self._connection:
            self._answered[function] = change

    def report(self, function: str) -> LauncherReport | None:
        """Return what it tells of a function; None: nothing."""
        if function not in self.functions:
            return None
        report = self._reports.get(function, LauncherReport(function))
        return replace(report, state=CHANGING) if report.change < self._answered.get(function, 0) else report

    def forget(self) -> None:
        """Forget what it has told: it is another process."""
        self._reports, self._answered = {}, {}
