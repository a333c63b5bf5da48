"""ROS shell of the monitor: parameters and the active configuration in, diagnostics out."""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import ActiveConfiguration
from ros_model.errors import ModelError
from ros_model.files import resolve, safe_file_name
from ros_model.reader import read_system
from ros_model.snapshot import GraphSnapshot, MasterClient, MasterGoneError, SnapshotError

from rosgraph_monitor.comparison import DEFAULT_IGNORED, resolved
from rosgraph_monitor.components import parse_mapping
from rosgraph_monitor.desired import DesiredModel, Grounding
from rosgraph_monitor.liveness import Life, Timing
from rosgraph_monitor.monitor import GraphMonitor
from rosgraph_monitor.observer_node import ObserverHost
from rosgraph_monitor.usage import UsageMeter
from rosgraph_monitor.watch import Watcher

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ros_model.metamodel import RosSystem

    from rosgraph_monitor.status import Status

BAD_START = 2
"""Exit status of a start that failed. The loss of the master ends the node with 0: it has done all it could."""

_MASTER = "ROS master"
_MASTER_SILENCE = 5.0
"""Wall seconds without a useful answer after which the master counts as lost; if it is gone, that shows at once."""
_COALESCE = 0.02
"""Wall seconds between evaluations, for events that come in a bunch."""
_USAGE_PERIOD = 1.0
_LAUNCHER = "rosgraph_launcher"
_METACONTROL_NODES = ["rosgraph_monitor", "reasoner", "rosgraph_manipulator", _LAUNCHER]


class ParameterError(Exception):
    """A parameter of the node is not usable; the message names it."""


class MonitorNode:
    """The node /rosgraph_monitor."""

    def __init__(self, load: Iterable[str]) -> None:
        """Read the parameters and start watching.

        Args:
            load: observers to start, beside those of `~observers`.

        Raises:
            ParameterError: a parameter has the wrong type or range.
            ModelError: the base model can't be read.
        """
        self._period = 1.0 / _number("~rate", 2.0)
        self._namespace = rospy.get_namespace()
        self._variants = _text("~variants")
        self._monitor = GraphMonitor(
            _components(),
            ignored=(*DEFAULT_IGNORED, *_names("~ignore", [])),
            namespace=self._namespace,
            startup_grace=_number("~startup_grace", 10.0),
            restart_patience=_number("~restart_patience", 1.0),
        )
        base = _text("~desired_rossystem")
        self._model = DesiredModel(read_system(resolve(base)) if base else None, self._read_variant)
        self._metacontrol = _names("~metacontrol_nodes", _METACONTROL_NODES)
        self._meter = UsageMeter(alone=frozenset({_LAUNCHER}))
        self._usage_due = 0.0
        self._changed = threading.Event()
        self._refresh = False
        self._silent_since: float | None = None
        self._snapshot: GraphSnapshot | None = None
        self._client = MasterClient(rosgraph.get_master_uri(), rospy.get_name())
        timing = Timing(
            probe_period=_number("~probe_period", Timing.probe_period),
            probe_deadline=_number("~probe_deadline", Timing.probe_deadline),
        )
        self._watcher = Watcher(self._changed.set, timing, rospy.get_name())
        observers = dict.fromkeys((*_names("~observers", []), *load))
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=50)
        self._observers = ObserverHost(self._diagnostics)
        self._observers.follow(self._model.current.system)
        for name in observers:
            self._observers.load(name)
        self._subscriber = rospy.Subscriber(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, self._follow, queue_size=5
        )
        rospy.on_shutdown(self._changed.set)

    def run(self) -> None:
        """Evaluate at the fixed rate and whenever a node dies or returns, until the node or the master ends."""
        self._watcher.start()
        due = time.monotonic()
        try:
            while not rospy.is_shutdown():
                now = time.monotonic()
                if now >= due or self._refresh or self._master_seems_gone():
                    self._refresh = False
                    if not self._look(now):
                        break
                    due = max(due + self._period, now)
                self._publish(self._evaluate())
                self._wait(due)
        finally:
            self._watcher.close()
            self._client.close()

    def _wait(self, due: float) -> None:
        """Wait until the next look is due or something has changed."""
        time.sleep(_COALESCE)
        self._changed.wait(max(due - time.monotonic(), 0.0))
        self._changed.clear()

    def _look(self, now: float) -> bool:
        """Take a snapshot; False if the master is lost."""
        try:
            self._snapshot = self._client.snapshot()
            self._silent_since = None
        except MasterGoneError as error:
            rospy.logfatal("%s: the monitor ends, start it again with the master", error)
            return False
        except SnapshotError as error:
            if self._silent_since is None:
                self._silent_since = now
                rospy.logerr("%s", error)
            elif time.monotonic() - self._silent_since > _MASTER_SILENCE:
                rospy.logfatal("%s: silent for %g s, the monitor ends", error, _MASTER_SILENCE)
                return False
            return True
        nodes = {name: node.uri for name, node in self._snapshot.nodes.items() if name != rospy.get_name()}
        self._watcher.watch(nodes | {_MASTER: self._client.uri})
        return True

    def _master_seems_gone(self) -> bool:
        return self._watcher.lives().get((_MASTER, self._client.uri)) is Life.DEAD

    def _evaluate(self) -> list[Status]:
        if self._snapshot is None:
            return []
        lives = self._watcher.lives()
        own = self._snapshot.nodes.get(rospy.get_name())
        if own:
            lives[own.name, own.uri] = Life.ALIVE
        now = time.monotonic()
        statuses = self._monitor.evaluate(self._snapshot, lives, self._model.current, now)
        if now >= self._usage_due:
            self._usage_due = now + _USAGE_PERIOD
            statuses.extend(self._meter.measure(self._metacontrol_pids(), now))
        return statuses

    def _metacontrol_pids(self) -> dict[str, int]:
        """Return the process ids of the meta-controller's nodes that run on this host."""
        pids = self._watcher.pids() | {rospy.get_name(): os.getpid()}
        nodes = self._snapshot.nodes if self._snapshot else {}
        local = {}
        for name in self._metacontrol:
            graph_name = resolved(name, self._namespace)
            if graph_name in pids and graph_name in nodes and _is_local(nodes[graph_name].uri):
                local[name] = pids[graph_name]
        return local

    def _publish(self, statuses: list[Status]) -> None:
        if not statuses or rospy.is_shutdown():
            return
        array = DiagnosticArray(status=[_message(status) for status in statuses])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)

    def _follow(self, msg: ActiveConfiguration) -> None:
        """Take the desired model from the active configuration."""
        before = self._model.current
        current = self._model.follow(Grounding(f.function, f.configuration, f.state) for f in msg.functions)
        if current.problem and current.problem != before.problem:
            rospy.logerr("desired model stays as it was: %s", current.problem)
        if current.system != before.system:
            self._observers.follow(current.system)
        self._refresh = True
        self._changed.set()

    def _read_variant(self, name: str) -> RosSystem:
        if not self._variants:
            raise ModelError(f"configuration {name!r}: set ~variants to the folder of the variants' models")
        return read_system(resolve(self._variants) / f"{safe_file_name(name, 'configuration')}.rossystem")


def main() -> None:
    """Run the node; exit with status 2 and one line if it can't start."""
    parser = argparse.ArgumentParser(prog="monitor", description="Compares the live ROS graph with the desired one.")
    parser.add_argument("--load", nargs="+", default=[], metavar="NAME", help="observers to start")
    options = parser.parse_args(rospy.myargv()[1:])
    uri = rosgraph.get_master_uri()
    if not rosgraph.is_master_online():
        sys.stderr.write(f"rosgraph_monitor: no ROS master at {uri}: start roscore or set ROS_MASTER_URI\n")
        sys.exit(BAD_START)
    rospy.init_node("rosgraph_monitor")
    try:
        node = MonitorNode(options.load)
    except (ParameterError, ModelError, SnapshotError) as error:
        rospy.logfatal("%s", error)
        sys.exit(BAD_START)
    node.run()
    rospy.signal_shutdown("the monitor has ended")


def _message(status: Status) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=int(status.level),
        name=status.name,
        message=status.message,
        hardware_id=status.hardware_id,
        values=[KeyValue(key, value) for key, value in status.values],
    )


def _is_local(uri: str) -> bool:
    host, _ = rosgraph.network.parse_http_host_and_port(uri)
    return bool(rosgraph.network.is_local_address(host))


def _parameter(name: str, default: Any) -> Any:
    return rospy.get_param(name, default)


def _number(name: str, default: float) -> float:
    value = _parameter(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0.0:
        raise ParameterError(f"parameter {rospy.resolve_name(name)}: {value!r} is no positive number")
    return float(value)


def _text(name: str) -> str:
    value = _parameter(name, "")
    if not isinstance(value, str):
        raise ParameterError(f"parameter {rospy.resolve_name(name)}: {value!r} is no text")
    return value


def _names(name: str, default: list[str]) -> list[str]:
    value = _parameter(name, default)
    if not isinstance(value, list) or not all(isinstance(entry, str) for entry in value):
        raise ParameterError(f"parameter {rospy.resolve_name(name)}: {value!r} is no list of names")
    return value


def _components() -> dict[str, str]:
    try:
        return parse_mapping(_parameter("~components", {}))
    except ValueError as error:
        raise ParameterError(f"parameter {rospy.resolve_name('~components')}: {error}") from error
