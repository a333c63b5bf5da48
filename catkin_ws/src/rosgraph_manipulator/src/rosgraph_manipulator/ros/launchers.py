"""The launchers of all hosts, which make changes together."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future, wait
from dataclasses import dataclass
from functools import partial
from typing import Any

import rosgraph
import rospy
from metacontrol_msgs.srv import (
    ChangeNodes,
    ChangeNodesRequest,
    ChangeNodesResponse,
    CheckNodes,
    StandBy,
    StandByRequest,
)
from node_kit.io.background import NoThreadError, in_background, start_thread
from node_kit.ros.services import SERVICE_FAILURES
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.hosts import no_launcher
from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.secret import SecretError, sign
from rosgraph_launcher.launching.report import ENDING, FAILED
from rosgraph_launcher.ros.node_messages import to_message
from rospy.exceptions import TransportException, TransportInitError

from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.hosts.merging import stale
from rosgraph_manipulator.hosts.splitting import Part, split
from rosgraph_manipulator.ros.launcher_reports import ASKING, REPEAT_PERIOD, WATCH_PERIOD, LauncherReports

ASK_PERIOD = 0.05  # s, wall, between two questions whether a launcher is there

_NOT_REACHED = (TransportInitError, rosgraph.MasterError, NoThreadError)
"""How a request fails that was not sent: what rospy has caught when it raises a ServiceException (no registration, no
connection), and no thread that asks."""


@dataclass(frozen=True)
class Changed:
    """A change that all launchers have made.

    Attributes:
        number: what the reports together have as their number once all have reported it.
        phases: durations of the slowest launcher's phases, s.
    """

    number: int
    phases: Mapping[str, float]


class Launchers(LauncherReports):
    """Follows the launchers of all hosts, and asks them for changes."""

    def check(self, node: NodeDescription) -> tuple[bool, str]:
        """Ask a node's launcher whether the node is up, and who has taken its name."""
        name = self._find(node.machine)
        if not name:
            return False, ""
        try:
            answer = self._wait_for(name, lambda: rospy.ServiceProxy(f"{name}/check", CheckNodes)([node.name]))
        except (DeploymentError, *SERVICE_FAILURES):
            return False, ""
        return answer.up[0], answer.conflicts[0]

    # -- changes --------------------------------------------------------------------------------------------------

    def require(self, function: str, nodes: Iterable[NodeDescription]) -> None:
        """Wait until the launchers answer that a change of a function asks.

        What a change does before it asks them, such as ending nodes of others, can't be undone without them.

        Args:
            function: its name.
            nodes: those that it is to have.

        Raises:
            DeploymentError: one is not there, or hangs.
        """
        places = {self._place(node) for node in nodes}
        with self._lock:
            having = {name for name, report in self._of(function).items() if report.configuration or report.nodes}
            names = places | {name for name in having if not self._known[name].lost}
        deadline = time.monotonic() + self._timeout
        asked = {name: in_background(partial(self._answers, name, deadline), ASKING) for name in sorted(names)}
        for name, answer in asked.items():
            if not self._result(name, answer):
                raise DeploymentError(f"{name} does not answer, so nothing is changed: kill it, and start it again")

    def _answers(self, name: str, deadline: float) -> bool:
        """Wait until the API of a launcher answers; its services are found although it hangs."""
        while not NodeApi.is_answering(name):
            if time.monotonic() > deadline or rospy.is_shutdown():
                return False
            time.sleep(ASK_PERIOD)
        return True

    def change(
        self,
        function: str,
        configuration: str,
        nodes: Iterable[NodeDescription],
        stop: Iterable[str],
        start: Iterable[str],
        found: Callable[[], None],
    ) -> Changed:
        """Have the launchers change the nodes of a function, side by side.

        Args:
            function: its name.
            configuration: name of the configuration; empty: stop what only this function needs.
            nodes: all nodes of the configuration.
            stop: the nodes to stop.
            start: the nodes to start.
            found: is called when a launcher is there, before it is asked.

        Raises:
            DeploymentError: a launcher is not there, or refuses, or has died. Others may have made their part.
        """
        described = {node.name: node for node in nodes}
        places = {name: self._place(node) for name, node in described.items()}
        with self._lock:
            parts = split(places, self._of(function), list(stop), list(start))
            lost = {name for name, known in self._known.items() if known.lost}
            asked = [part for part in parts if part.launcher not in lost]  # what a lost one runs ends when it is back
            self._parts[function] = frozenset(part.launcher for part in asked)
            numbers = {name: report.change for name, report in self._of(function).items()}
        if not configuration and not asked:  # as ever: there must be a launcher, also to release nothing
            asked = [Part(self._main, releases=True)]
        phases: dict[str, float] = {}
        for turn in (True, False):
            taking_turn = [part for part in asked if part.comes_first is turn]
            answers = self._ask_all(function, configuration, described, taking_turn, found)
            for name, answer in answers.items():
                numbers[name] = answer.change
                for phase in answer.phases:
                    phases[phase.name] = max(phases.get(phase.name, 0.0), phase.duration)
        with self._lock:
            self._parts[function] = frozenset(part.launcher for part in asked if configuration and not part.releases)
        self.on_reports()
        return Changed(sum(numbers.values()), phases)

    def stand_by(self, nodes: Iterable[NodeDescription]) -> None:
        """Tell each launcher which nodes may be needed next, without waiting; where that fails, they start cold.

        Raises:
            NoThreadError: not all could be told now.
        """
        told: dict[str, list[NodeDescription]] = {}
        for node in nodes:
            name = self._find(node.machine)
            if name:
                told.setdefault(name, []).append(node)
        for name, own in told.items():
            start_thread(partial(self._tell_expected, name, own), ASKING)

    def _tell_expected(self, name: str, nodes: Sequence[NodeDescription]) -> None:
        service = rospy.ServiceProxy(f"{name}/stand_by", StandBy)
        with contextlib.suppress(*SERVICE_FAILURES, SecretError):
            service.wait_for_service(self._timeout)
            request = StandByRequest([to_message(node) for node in nodes], "")
            sign(request, name)
            service(request)

    def clear(self, function: str) -> list[str]:
        """Stop what runs for a function where it should not; return the hosts on which something did."""
        connected = self._connected()  # what one that has ended ran has ended, too
        with self._lock:
            if function not in self._parts:
                return []  # nothing has been decided about it yet
            told = self._of(function).items()
            reports = {name: report for name, report in told if name in connected and not self._known[name].lost}
            names = stale(reports, self._parts[function])
            hosts = [self._known[name].place.host for name in names]
        self._release(function, names)
        return hosts

    def stop_rest(self, function: str) -> None:
        """Stop what is left of a function that has failed on one host; its launchers stay as they are expected."""
        with self._lock:
            names = [
                name
                for name, report in self._of(function).items()
                if report.configuration and report.nodes and report.state != FAILED and not self._known[name].lost
            ]
        self._release(function, names)

    def _release(self, function: str, launchers: list[str]) -> None:
        try:
            self._ask_all(function, "", {}, [Part(name, releases=True) for name in launchers], lambda: None)
        except DeploymentError as error:
            rospy.logwarn("%s", error)

    def _place(self, node: NodeDescription) -> str:
        """Return the launcher of a node; wait for one."""
        deadline = time.monotonic() + self._timeout
        while not (name := self._find(node.machine)):
            if time.monotonic() > deadline or rospy.is_shutdown():
                with self._lock:
                    places = [known.place for known in self._known.values()]
                raise DeploymentError(no_launcher(node.name, node.machine, places))
            time.sleep(REPEAT_PERIOD)
        with self._lock:
            if name in self._known and self._known[name].lost:
                raise DeploymentError(f"node {node.name}: {self._line(self._known[name])}")
        return name

    def _ask_all(
        self,
        function: str,
        configuration: str,
        nodes: Mapping[str, NodeDescription],
        parts: list[Part],
        found: Callable[[], None],
    ) -> dict[str, ChangeNodesResponse]:
        """Ask launchers side by side, and wait for all answers."""
        asked = {}
        for part in parts:
            request = ChangeNodesRequest(
                function=function,
                configuration="" if part.releases else configuration,
                nodes=[to_message(nodes[name]) for name in part.nodes],
                stop=list(part.stop),
                start=list(part.start),
            )
            try:
                sign(request, part.launcher)
            except SecretError as error:
                raise DeploymentError(str(error)) from error
            asked[part.launcher] = in_background(partial(self._ask, part.launcher, request, found), ASKING)
        answers, failures = {}, []
        for name, future in asked.items():
            try:
                answers[name] = answer = self._result(name, future)
                if not answer.ok:
                    failures.append(answer.message if len(parts) == 1 else f"{self._host(name)}: {answer.message}")
            except (DeploymentError, NoThreadError) as error:
                failures.append(str(error))
            except SERVICE_FAILURES as error:
                failures.append(f"{name.rpartition('/')[2]} has failed ({error}): check that it runs")
        if failures:
            raise DeploymentError("; ".join(failures))
        return answers

    def _ask(self, name: str, request: ChangeNodesRequest, found: Callable[[], None]) -> ChangeNodesResponse:
        """Return a launcher's answer to a request, which is made as soon as the launcher is there.

        A launcher that is being killed may accept the connection by which `wait_for_service` finds it and refuse the
        next one, because the kernel closes its sockets one after the other. One that ends by itself may close a
        connection without an answer, until rospy has unregistered its services. A request that reached no launcher is
        repeated. One that reached a launcher that ends or has died is left for its successor, because all nodes end
        with it. Any other is not repeated, because a part of it may be done.
        """
        service = rospy.ServiceProxy(f"{name}/change", ChangeNodes)
        deadline = time.monotonic() + self._timeout
        while True:
            service.wait_for_service(max(deadline - time.monotonic(), REPEAT_PERIOD))
            found()
            with self._lock:
                connection = self._known[name].told.connection if name in self._known else None
            try:
                answer = self._answer(name, service, request)
            except (rospy.ServiceException, TransportException, OSError) as error:
                if time.monotonic() > deadline or not self._is_undone(error, name, service.uri):
                    raise
                time.sleep(REPEAT_PERIOD)
                continue
            with self._lock:
                if answer.ok and name in self._known:  # a change that is refused at once is not reported
                    self._known[name].told.answer(request.function, answer.change, connection)
            return answer

    def _answer(self, name: str, service: rospy.ServiceProxy, request: ChangeNodesRequest) -> ChangeNodesResponse:
        """Return a launcher's answer to a request; a change may take long, but the launcher lives meanwhile.

        Raises:
            DeploymentError: it does not answer, nor does its API, for the time to look for a launcher: it hangs.
        """
        answer = in_background(partial(service, request), ASKING)
        heard = time.monotonic()
        while not wait([answer], WATCH_PERIOD).done:
            if NodeApi.is_answering(name):
                heard = time.monotonic()
            elif time.monotonic() - heard > self._timeout and not answer.done():
                request.signature = ""  # a request that is not sent yet is refused when the launcher goes on
                raise DeploymentError(f"{name} takes requests and does not answer: kill it, and start it again")
        return answer.result()

    def _is_undone(self, error: Exception, name: str, uri: str) -> bool:
        """Tell whether nothing is left of a request that has failed: it reached no launcher, or that one has ended.

        Args:
            error: how it failed.
            name: the launcher's name.
            uri: address of the service that was asked.
        """
        cause = error.__context__ if isinstance(error, rospy.ServiceException) else error
        if isinstance(cause, _NOT_REACHED) or ENDING in str(error):
            return True
        return isinstance(cause, (TransportException, OSError)) and not self._serves(name, uri)

    def _serves(self, name: str, uri: str) -> bool:
        """Tell whether a launcher still serves under an address; one that ends closes all connections."""
        try:
            rospy.ServiceProxy(f"{name}/check", CheckNodes)([])
            # After the check, which a successor may have answered: it registers this service before that one.
            return bool(rosgraph.Master(rospy.get_name()).lookupService(f"{name}/change") == uri)
        except (*SERVICE_FAILURES, rosgraph.MasterException):
            return False

    def _wait_for(self, name: str, work: Callable[[], Any]) -> Any:
        """Do work that waits for a launcher, until its host is lost."""
        return self._result(name, in_background(work, ASKING))

    def _result(self, name: str, future: Future[Any]) -> Any:
        """Return what a launcher has answered.

        Raises:
            DeploymentError: its host was lost meanwhile.
        """
        while not wait([future], REPEAT_PERIOD).done:
            with self._lock:
                if name in self._known and self._known[name].lost:
                    raise DeploymentError(self._line(self._known[name]))
        return future.result()
