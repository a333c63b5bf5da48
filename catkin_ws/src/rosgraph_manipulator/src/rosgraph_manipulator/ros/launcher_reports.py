"""What the launchers of all hosts tell, as the reports of one launcher, and which hosts are lost."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import rosgraph
import rospy
from metacontrol_msgs.msg import LaunchedFunctions
from node_kit.io.background import NoThreadError, in_background
from node_kit.io.xml_rpc import CallError
from node_kit.ros.connections import latest
from rosgraph_launcher.description import NodeDescription
from rosgraph_launcher.hosts import HostLauncher, launcher_at
from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.ownership import is_this_host, launcher_mark
from rosgraph_launcher.io.this_host import resolved
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_launcher.ros.node_messages import report_from

from rosgraph_manipulator.hosts.merging import merged
from rosgraph_manipulator.hosts.reported import Reported
from rosgraph_manipulator.io.master import get_parameters, publishers

TOPIC = "rosgraph_launcher/functions"
REPEAT_PERIOD = 0.01  # s, wall
WATCH_PERIOD = 0.5  # s, wall, between two questions whether a host is there
WARN_PERIOD = 10.0  # s, wall, between two equal warnings
ASKING = "ask a launcher"  # name of the threads that do


@dataclass
class _Known:
    """A launcher that has been heard of, or a stranger that may be one.

    Attributes:
        place: its name and its host.
        is_here: whether it runs on this host.
        told: what it has told of its functions.
        answered: when it was heard last, monotonic wall s.
        pid: of its process, as it says itself; None: nobody has asked.
        uri: address of its API; None: unknown.
        lost: whether its host is lost.
        is_read: whether place and host are those of the process that runs now.
    """

    place: HostLauncher
    is_here: bool
    told: Reported = field(default_factory=Reported)
    answered: float = field(default_factory=time.monotonic)
    pid: int | None = None
    uri: str | None = None
    lost: bool = False
    is_read: bool = False


class LauncherReports:
    """Follows the launchers of all hosts. Callbacks of rospy and a thread of its own keep it up to date."""

    def __init__(self, timeout: float, host_timeout: float) -> None:
        """Begin to follow the launchers.

        Args:
            timeout: how long to look for a launcher, s, wall.
            host_timeout: how long the launcher of another host may be silent, before that host counts as lost, s, wall.
        """
        self.on_reports: Callable[[], object] = lambda: None  # called whenever something differs, in any thread
        self.losses = 0  # how often a host was lost
        self._timeout, self._host_timeout = timeout, host_timeout
        self._main = rospy.resolve_name("rosgraph_launcher")
        self._lock = threading.RLock()
        self._known: dict[str, _Known] = {}
        self._strangers: dict[str, _Known] = {}  # they report, and have not said where they run
        self._parts: dict[str, frozenset[str]] = {}  # by function: the launchers that should have a part of it
        self._subscriber = rospy.Subscriber(TOPIC, LaunchedFunctions, latest(self._take), queue_size=20)
        threading.Thread(target=self._watch, name="hosts", daemon=True).start()

    # -- what they tell -------------------------------------------------------------------------------------------

    def find(self) -> bool:
        """Wait for all launchers that are registered and answer, at most the time to look; tell whether one was heard.

        All are asked side by side, because one that has died stays registered, and its host may let a call wait.
        """
        begun = time.monotonic()
        asked: dict[str, Future[Any]] = {}
        while not rospy.is_shutdown():
            try:
                registered = publishers(rospy.resolve_name(TOPIC))
            except CallError:
                registered = set()
            for name in registered - asked.keys():
                asked[name] = in_background(partial(NodeApi.answer, name), ASKING)
            answers = {name: answer.exception() or answer.result() for name, answer in asked.items() if answer.done()}
            for name in [name for name, answer in answers.items() if isinstance(answer, NoThreadError)]:
                del asked[name]  # ask again
            silent = {name for name, answer in answers.items() if answer is None}
            with self._lock:
                heard = set(self._known)
            waited = time.monotonic() - begun
            if heard and (registered <= heard | silent or waited > min(self._host_timeout, self._timeout)):
                return True
            if waited > self._timeout:
                return False
            time.sleep(REPEAT_PERIOD)
        return False

    def reports(self) -> dict[str, LauncherReport]:
        """Return what all launchers tell together, by function."""
        with self._lock:
            functions = {name for known in self._known.values() for name in known.told.functions} | set(self._parts)
            lost = {name: self._line(known) for name, known in self._known.items() if known.lost}
            return {name: merged(name, self._of(name), self._parts.get(name), lost) for name in sorted(functions)}

    def lost_hosts(self, function: str) -> list[str]:
        """Return the lost hosts that should have a part of what runs for a function."""
        with self._lock:
            names = self._parts.get(function, ())
            known = [self._known[name] for name in names if name in self._known]
            return sorted(launcher.place.host for launcher in known if launcher.lost)

    def unconnected(self, function: str) -> str:
        """Return a launcher that should have a part of what runs for a function and has ended; empty: none has."""
        connected = self._connected()
        with self._lock:
            return next((name for name in sorted(self._parts.get(function, ())) if name not in connected), "")

    def main_has_ended(self, function: str) -> bool:
        """Tell whether this host's main launcher should have a part of what runs for a function and has ended.

        `_look_around` sees the ends of all others.
        """
        connected = self._connected()
        with self._lock:
            known, parts = self._known.get(self._main), self._parts.get(function, ())
            return known is not None and known.is_here and self._main in parts and self._main not in connected

    def _connected(self) -> set[str]:
        return {connection.callerid_pub for connection in list(self._subscriber.impl.connections)}

    def adopt(self, function: str, nodes: Iterable[NodeDescription]) -> None:
        """Note which nodes should run for a function although no change has started them."""
        places = {self._find(node.machine) or f"the launcher of {node.machine}" for node in nodes}
        with self._lock:
            self._parts[function] = frozenset(places)
        self.on_reports()

    def expect_nothing(self, function: str) -> None:
        """Note that nothing should run for a function although its nodes may not have been stopped."""
        with self._lock:
            self._parts[function] = frozenset()
        self.on_reports()

    # -- where nodes are ------------------------------------------------------------------------------------------

    def is_here(self, node: NodeDescription) -> bool:
        """Tell whether a node runs on this host, as far as is known."""
        name = self._find(node.machine)
        with self._lock:
            return self._known[name].is_here if name in self._known else not node.machine

    def mark(self, node: NodeDescription | None) -> str:
        """Return what the processes of a node's launcher have in their environment."""
        return launcher_mark((node and self._find(node.machine)) or self._main)

    def _find(self, machine: str) -> str:
        """Return the launcher of a host by its name or address; empty: there is none."""
        if not machine:
            return self._main
        with self._lock:
            places = [known.place for known in self._known.values()]
        found = launcher_at(machine, places) or launcher_at(machine, places, resolved(machine))
        return found.name if found else ""

    # -- the hosts ------------------------------------------------------------------------------------------------

    def _take(self, message: LaunchedFunctions) -> None:
        connection = message._connection_header
        name = connection["callerid"]
        try:
            reports = {function.function: report_from(function) for function in message.functions}
        except ValueError as error:
            rospy.logwarn_throttle(WARN_PERIOD, f"a report of {name} is left out: {error}: is its version another one?")
            return
        with self._lock:
            known = self._known.get(name) or self._strangers.get(name)
            if known is None:
                known = self._strangers[name] = _Known(HostLauncher(name), is_here=True)
            is_new = known.told.take(reports, connection)
            if is_new:  # it may be another process, on another host
                known.uri, known.is_read = None, False
            self._heard(known)
        if is_new:
            self._read(name)
        with self._lock:
            is_launcher = name in self._known
        if is_launcher:
            self.on_reports()
        elif is_new:
            rospy.logwarn("reports of %s are left out until it has set %s/addresses, as each launcher does", name, name)

    def _read(self, name: str) -> bool:
        """Read where a launcher runs, and count a stranger among the launchers if it is one; tell whether that is news.

        A launcher sets the parameter that says where it runs before it reports. The main one counts in any case. Where
        the master does not answer, what was known stays until the next look.
        """
        addresses, is_here = _addresses_of(name), _is_here(name)
        with self._lock:
            known = self._known.get(name) or self._strangers.get(name)
            if known is None or (addresses is None and (name in self._known or name != self._main)):
                return False
            before = known.place, known.is_here
            known.place = HostLauncher(name, addresses or ())
            known.is_here = known.is_here if is_here is None else is_here
            known.is_read = addresses is not None and is_here is not None
            is_stranger = self._strangers.pop(name, None) is not None
            self._known[name] = known
            return is_stranger or before != (known.place, known.is_here)

    def _heard(self, known: _Known) -> None:
        known.answered = time.monotonic()
        if known.lost:
            known.lost = False
            rospy.logwarn("host %s is back", known.place.host)

    def _line(self, known: _Known) -> str:
        reports = [known.told.report(function) for function in known.told.functions]
        nodes = ", ".join(sorted({node for report in reports if report for node in report.nodes}))
        silence = f"{known.place.name} has not answered for {self._host_timeout:g} s{nodes and f', and ran {nodes}'}"
        if known.is_here:
            return f"{silence}: start it again"
        return f"host {known.place.host} is lost: {silence}: check its power and its network"

    def _host(self, name: str) -> str:
        with self._lock:
            return f"host {self._known[name].place.host}" if name in self._known else name

    def _of(self, function: str) -> dict[str, LauncherReport]:
        told = {name: known.told.report(function) for name, known in self._known.items()}
        return {name: report for name, report in told.items() if report is not None}

    def _watch(self) -> None:
        while not rospy.is_shutdown():
            time.sleep(WATCH_PERIOD)
            self._look_around()

    def _look_around(self) -> None:
        """Ask the launchers whether they are there, and the master where they run and whether strangers are launchers.

        The main one on this host is not asked: its end shows at once by its closed connection.
        """
        with self._lock:
            asked = [known for name, known in self._known.items() if name != self._main or not known.is_here]
        for known in asked:
            self._look(known)
        self._look_at_unread()

    def _look_at_unread(self) -> None:
        """Ask again where launchers run that were started anew, and whether strangers are launchers.

        The master may not have answered before. Strangers that are gone are forgotten.
        """
        connected, now = self._connected(), time.monotonic()
        with self._lock:
            for name, stranger in list(self._strangers.items()):
                if name not in connected and now - stranger.answered > self._host_timeout:
                    del self._strangers[name]
            names = [*self._strangers, *(name for name, known in self._known.items() if not known.is_read)]
        if [name for name in names if self._read(name)]:
            self.on_reports()

    def _look(self, known: _Known) -> None:
        pid = NodeApi.pid(known.uri) if known.uri else None  # without the master, which may be slow itself
        if pid is None:
            known.uri = NodeApi.address(known.place.name)
            pid = NodeApi.pid(known.uri) if known.uri else None
        with self._lock:
            was_lost = known.lost
            if pid is not None:
                if known.pid not in (None, pid):  # it is another process
                    known.is_read = False
                    if was_lost:
                        known.told.forget()  # it tells what it has as soon as it is connected
                known.pid = pid
                self._heard(known)
            elif time.monotonic() - known.answered > self._host_timeout:
                known.lost = True
                self.losses += not was_lost
            differs = known.lost is not was_lost
            concerns = any(known.place.name in parts for parts in self._parts.values())
            if known.lost and known.is_here and not concerns and known.place.name not in self._connected():
                del self._known[known.place.name]  # it has ended, and its nodes with it
        if differs and known.lost and not concerns:  # the failure of a function tells it, too
            rospy.logwarn("%s", self._line(known))
        if differs:
            self.on_reports()


def _addresses_of(name: str) -> tuple[str, ...] | None:
    """Return the addresses of a launcher's host, as it says in its parameter; None: nothing is known."""
    parameter = f"{name}/addresses"
    try:
        addresses = get_parameters([parameter]).get(parameter)
    except CallError:
        return None
    return tuple(map(str, addresses)) if isinstance(addresses, list) else None


def _is_here(name: str) -> bool | None:
    """Return whether a launcher runs on this host; None: nothing is known."""
    uri = NodeApi.address(name)
    return None if uri is None else is_this_host(rosgraph.network.parse_http_host_and_port(uri)[0])
