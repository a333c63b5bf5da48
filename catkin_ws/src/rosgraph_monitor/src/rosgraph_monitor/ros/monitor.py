"""ROS shell of the monitor: parameters and the active configuration in, diagnostics out."""

from __future__ import annotations

import resource
import threading
import time
from typing import TYPE_CHECKING, Any

import click
import diagnostic_updater
import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import ActiveConfiguration
from node_kit.master import PATIENCE
from node_kit.parameters import ParameterError
from node_kit.ros.connections import latest
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.parts import watch_parts
from ros_model.errors import ModelError

from rosgraph_monitor.evaluation import GraphEvaluator
from rosgraph_monitor.graph.desired import Grounding
from rosgraph_monitor.health.liveness import Life, is_newer
from rosgraph_monitor.health.topics import merged, model_topics
from rosgraph_monitor.io.graph_client import GraphClient
from rosgraph_monitor.io.graph_poller import GraphPoller, PolledGraph
from rosgraph_monitor.io.models import desired_model
from rosgraph_monitor.io.node_connections import NodeConnections
from rosgraph_monitor.ros import parameters as parameters_node
from rosgraph_monitor.ros.diagnostics import DiagnosticsTopic
from rosgraph_monitor.ros.driver_status import DriverStatusListener
from rosgraph_monitor.ros.observers import ObserverHost
from rosgraph_monitor.ros.topics import BatteryListener, TopicListener
from rosgraph_monitor.ros.usage import UsageWatch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from node_kit.ros.parts import PartsWatch
    from ros_model.graph.snapshot import GraphSnapshot

    from rosgraph_monitor.diagnostics.status import Status
    from rosgraph_monitor.graph.desired import Desired

NAME = "rosgraph_monitor"
_MASTER_TIMEOUT = 1.2
"""Wall seconds for one answer of the master."""
_COALESCE = 0.02
"""Wall seconds between evaluations at least, for events that come in a bunch."""
_LONGEST_REST = 0.2
"""The same at most, after an evaluation that took long."""
_FRESH = 0.15
"""Wall seconds to wait, after a node died, for a poll that says whether it has unregistered."""
_TOPIC_PERIOD = 0.05
_OBSERVERS_PERIOD = 1.0
_METACONTROL_NODES = [NAME, "reasoner", "rosgraph_manipulator", "rosgraph_launcher"]


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
        self._events = threading.Event()
        self._polled = threading.Event()
        self._connections = NodeConnections(self._on_life, parameters_node.timing(), rospy.get_name())
        self._period = 1.0 / parameters_node.poll_rate()
        self._poller = GraphPoller(
            GraphClient(rosgraph.get_master_uri(), rospy.get_name(), _MASTER_TIMEOUT),
            self._connections,
            self._period,
            rospy.get_name(),
            self._on_poll,
        )
        self._ending = False
        rospy.on_shutdown(self._end)
        self._connections.start()
        self._poller.start()
        self._namespace = rospy.get_namespace()
        components = parameters_node.components()
        self._topic_specs = merged(components.topics, parameters_node.topics())
        self._patience = parameters_node.patience()
        self._grace = self._patience.startup
        self._monitor = GraphEvaluator(
            components.of_node, scope=parameters_node.scope(self._topic_specs), patience=self._patience
        )
        base = parameters_node.text("desired_rossystem")
        self._model_lock = threading.Lock()
        self._model = desired_model(base, parameters_node.text("variants"), rospy.logwarn)
        self._observers_due = 0.0
        self._running_observers = 0
        self._evaluation = 0.0
        self._graph_problem = ""
        observers = dict.fromkeys((*parameters_node.names("observers", []), *load))
        self._diagnostics = DiagnosticsTopic()
        self._updater = diagnostic_updater.Updater()
        self._updater.setHardwareID(self._diagnostics.robot)
        self._updater.add("look at the graph", self._tell_poll)
        self._observers = ObserverHost(self._diagnostics)
        self._followed = self._model.current.system  # by observers and topics
        self._observers.follow(self._followed)
        self._observers.begin(observers)
        self._topics = TopicListener(self._grace)
        self._topic_states: dict[str, str] = {}
        self._follow_topics()
        self._batteries = BatteryListener(components.batteries, self._events.set)
        self._drivers = DriverStatusListener(components.driver_statuses, self._events.set)
        self._usage = UsageWatch(
            parameters_node.names("metacontrol_nodes", _METACONTROL_NODES),
            self._snapshot,
            self._connections.pids,
            self._publish,
        )
        self._subscriber = rospy.Subscriber(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, latest(self._follow), queue_size=5
        )

    def run(self, parts: PartsWatch) -> None:
        """Evaluate after every poll, and whenever a node or topic fails or returns, until the node ends.

        Args:
            parts: watches over the other parts of the meta-controller.
        """
        while not self._ending:
            polled = self._poller.latest
            if polled:
                begin = time.monotonic()
                self._grace = self._patience.grace(parts.head_start)
                self._publish(self._evaluate(polled))
                self._evaluation = time.monotonic() - begin
                # It rests as long again, up to a limit: hundreds of nodes may come or go together.
                time.sleep(min(max(_COALESCE, self._evaluation), _LONGEST_REST))
            self._wait()

    def _end(self) -> None:
        self._ending = True
        self._events.set()

    def _on_life(self) -> None:
        """Poll, then evaluate, after a node died or came back: it may be unregistered or have another address."""
        self._polled.clear()
        self._poller.request()
        self._events.set()

    def _on_poll(self) -> None:
        polled = self._poller.latest
        if polled and is_newer(polled.lives, self._connections.lives()):
            self._polled.set()
        self._events.set()

    def _wait(self) -> None:
        """Wait until there is something to evaluate."""
        while not self._events.wait(_TOPIC_PERIOD if self._topics.topics else None):
            if self._topics_changed():
                return
        self._events.clear()
        if not self._ending:
            self._polled.wait(_FRESH)

    def _topics_changed(self) -> bool:
        states = {v.spec.name: v.message for v in self._topics.judge(self._excused_topics(), self._grace)}
        return states != self._topic_states

    def _excused_topics(self) -> frozenset[str]:
        polled = self._poller.latest
        desired = self._model.current
        return self._monitor.excused_topics(polled.snapshot, desired, self._topics.topics) if polled else frozenset()

    def _evaluate(self, polled: PolledGraph) -> list[Status]:
        lives = self._connections.lives()
        is_fresh = is_newer(polled.lives, lives)
        own = polled.snapshot.nodes.get(rospy.get_name())
        if own:
            lives[own.name, own.uri] = Life.ALIVE
        if polled.problem != self._graph_problem:
            self._graph_problem = polled.problem
            if polled.problem:
                rospy.logerr("%s", polled.problem)
            else:
                rospy.loginfo("all parameters of the master can be read again")
        now = time.monotonic()
        verdicts = self._topics.judge(self._excused_topics(), self._grace)
        self._topic_states = {verdict.spec.name: verdict.message for verdict in verdicts}
        statuses = self._monitor.evaluate(
            polled.snapshot,
            lives,
            self._model.current,
            now,
            topics=verdicts,
            others={**self._batteries.conditions, **self._drivers.conditions},
            reasons={**self._batteries.reasons, **self._drivers.reasons},
            is_fresh=is_fresh,
            grace=self._grace,
            problem=polled.problem,
        )
        if now >= self._observers_due:
            self._observers_due = now + _OBSERVERS_PERIOD
            self._take_model(self._model.look_again)
            self._running_observers = self._observers.supervise()
            self._updater.force_update()  # `update` would ask the master for its period, and wait for the answer
        return statuses

    def _tell_poll(self, status: Any) -> Any:
        """Report the times and counts of the monitor itself."""
        polled = self._poller.latest
        if polled is None or polled.duration > self._period:
            status.summary(DiagnosticStatus.WARN, "the master is slow")
        else:
            status.summary(DiagnosticStatus.OK, "in time")
        if polled:
            status.add("seconds for a look", f"{polled.duration:.4f}")
            status.add("seconds for an evaluation", f"{self._evaluation:.4f}")
            status.add("looks", str(self._poller.count))
            status.add("nodes", str(len(polled.snapshot.nodes)))
        status.add("observers", str(self._running_observers))
        return status

    def _snapshot(self) -> GraphSnapshot | None:
        polled = self._poller.latest
        return polled.snapshot if polled else None

    def _publish(self, statuses: list[Status]) -> None:
        if statuses:
            self._diagnostics.publish([_message(status) for status in statuses], rospy.Time.now())

    def _follow(self, msg: ActiveConfiguration) -> None:
        """Take the desired model from the active configuration."""
        groundings = [Grounding(f.function, f.configuration, f.state) for f in msg.functions]
        self._take_model(lambda: self._model.follow(groundings))
        self._polled.clear()
        self._poller.request()
        self._events.set()

    def _take_model(self, read: Callable[[], Desired]) -> None:
        """Follow what should run now; callbacks and the main thread take turns."""
        with self._model_lock:
            before, current = self._model.current, read()
            if current.problem and current.problem != before.problem:
                rospy.logerr("desired model stays as it was: %s", current.problem)
            if current.system != self._followed:
                self._observers.follow(current.system)
                self._follow_topics()
                self._followed = current.system

    def _follow_topics(self) -> None:
        """Watch the topics for which the settings or the active model have expectations; settings take precedence."""
        system = self._model.current.system
        self._topics.follow(merged(model_topics(system) if system else {}, self._topic_specs))


def main() -> None:
    """Run the command with the arguments that are not roslaunch's."""
    command.main(args=rospy.myargv()[1:], prog_name="monitor")


@click.command()
@click.option("--load", multiple=True, metavar="NAME...", help="Observers to start, beside those of ~observers.")
@click.argument("more", nargs=-1, metavar="")
def command(load: tuple[str, ...], more: tuple[str, ...]) -> None:
    """Compare the live ROS graph with the desired one, until the node is ended.

    Exit status: 2, with one line, if it can't start.
    """
    if more and not load:
        raise click.UsageError(f"unexpected argument {more[0]!r}: name observers after --load")
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))  # a connection to each node
    with Lifetime(NAME, ParameterError, ModelError) as life:
        life.start()
        for line in parameters_node.strangers():
            rospy.logwarn("%s", line)
        life.watch.patience = parameters_node.number("master_patience", PATIENCE)
        node = MonitorNode((*load, *more))
        life.begun()
        node.run(watch_parts("monitor"))


def _message(status: Status) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=int(status.level),
        name=status.name,
        message=status.message,
        hardware_id=status.hardware_id,
        values=[KeyValue(key, value) for key, value in status.values],
    )
