"""Node metacontrol_dashboard: hears the system, and serves the page that shows it."""

from __future__ import annotations

import os
import threading
import time
from typing import TYPE_CHECKING, Any

import genpy
import rosgraph
import roslib.message
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from metacontrol_bags import messages, ownership
from metacontrol_msgs.msg import ActiveConfiguration, Decision, MissionEvent, ReasonerJournal
from metacontrol_msgs.srv import LastDecisions
from node_kit.io.background import in_background
from node_kit.io.xml_rpc import CallError
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.connections import latest
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.parts import TOPIC as SIGNS
from node_kit.ros.parts import sign_of
from ros_model.errors import ModelError
from ros_model.io.master import MasterClient
from rosgraph_monitor.diagnostics.overview import of_robot, thresholds
from rosgraph_monitor.graph.desired import Grounding
from rosgraph_monitor.io.models import desired_model

from metacontrol_dashboard.io.page import PageError, page_files
from metacontrol_dashboard.io.server import Access, Content, Server, ServerError
from metacontrol_dashboard.ros.operator import Operator
from metacontrol_dashboard.ros.reasoner import ReasonerFollower
from metacontrol_dashboard.state.feed import Feed
from metacontrol_dashboard.state.graph import graph_entries
from metacontrol_dashboard.state.places import CAMERA, COSTMAP, MAP, take_place, topics_of_places, type_of
from metacontrol_dashboard.state.store import Store

if TYPE_CHECKING:
    from ros_model.graph.snapshot import GraphSnapshot
    from rosgraph_monitor.graph.desired import DesiredModel

NAME = "metacontrol_dashboard"
TOKEN = "METACONTROL_TOKEN"  # noqa: S105 the name of a variable, no token
"""Environment variable with the token of those who may control."""
_PERIOD = 0.5  # s, wall, between two looks at the graph
_PLACES_EACH = 0.2  # s, wall, between two messages of a pose or way that are heeded
_LARGE_EACH = 1.0  # s, wall, the same of maps and images
_DECISIONS_WAIT = 1.0  # s, wall, for a reasoner to tell its last decisions


class DashboardNode:
    """Hears what the meta-controller says, and keeps the state of the page."""

    def __init__(self, parameters: ParameterTree) -> None:
        """Connect, and start the server.

        Raises:
            ParameterError, PageError, ServerError: it can't start.
        """
        access = Access(
            parameters.text("address") or "localhost",
            int(parameters.number("port", 8090, low=0, high=65535)),
            os.environ.get(TOKEN, ""),  # not a parameter: roslaunch shows those, and rosparam tells them to everybody
            parameters.flag("control", True),
        )
        self._robot = rospy.get_namespace()
        self._lock = threading.Lock()
        self._store = Store()
        self._feed = Feed(self._store, self._robot)
        self._diagnostics = rospy.resolve_name(ownership.TOPIC)
        self._client = MasterClient(rosgraph.get_master_uri(), rospy.get_name())
        self._groundings: tuple[Grounding, ...] = ()
        self._desired: DesiredModel | None = None
        self._desired_of: tuple[str, str] | None = None
        self._places: dict[str, rospy.Subscriber] = {}
        self._shown: tuple[Any, ...] = ()
        self._reasoner = ReasonerFollower(self._store, self._feed, self._lock)
        operator = Operator(self._reasoner)
        self._server = Server(Content(page_files(), self._store, self._lock, operator.act), access)
        self._server.start()
        with self._lock:
            self._store.set("system", "name", self._robot)
        self._listen()
        rospy.loginfo("the page of this system: %s", self._server.url)
        rospy.set_param("~url", self._server.url)
        if not access.is_local and not access.token:
            rospy.loginfo("the page can only look: to control the system by it, set %s and start it again", TOKEN)

    def _listen(self) -> None:
        rospy.Subscriber(ownership.TOPIC, DiagnosticArray, self._on_diagnostics, queue_size=100)
        rospy.Subscriber(SIGNS, DiagnosticStatus, self._on_sign, queue_size=50)
        active = "rosgraph_manipulator/active_configuration"
        rospy.Subscriber(active, ActiveConfiguration, latest(self._on_configuration), queue_size=20)
        rospy.Subscriber("mros1_reasoner/decision", Decision, self._on_decision, queue_size=100)
        rospy.Subscriber("mission/event", MissionEvent, self._on_event, queue_size=100)
        rospy.Subscriber("mros1_reasoner/journal", ReasonerJournal, self._on_journal, queue_size=1000)

    def run(self) -> None:
        """Look at the graph again and again, until the node ends."""
        in_background(self._tell_earlier_decisions, "earlier decisions")  # a reasoner that hangs never answers
        while not rospy.is_shutdown():
            begin = time.monotonic()
            try:
                self._look(self._client.snapshot())
            except CallError as error:
                rospy.logwarn_throttle(30.0, "%s: the graph is not shown", error)
            except Exception as error:  # whatever a graph or a model has, the next look may do
                what = " ".join(f"{type(error).__name__}: {error}".split())
                rospy.logerr_throttle(30.0, "a look at the graph has failed: %s", what)
            time.sleep(max(0.1, _PERIOD - (time.monotonic() - begin)))

    def close(self) -> None:
        """End the server."""
        self._server.close()

    def _look(self, snapshot: GraphSnapshot) -> None:
        self._follow_places(snapshot)
        _, tree = of_robot(snapshot.nodes, snapshot.parameters, self._robot)
        desired = self._desired_model(tree)
        stamp, wall = rospy.get_time(), time.monotonic()
        with self._lock:
            self._feed.take_clock(stamp)
            self._feed.look(wall)
            now = desired.current if desired else None
            inputs = (snapshot, now, {key: row.values for key, row in self._feed.overview.findings.items()})
            if inputs != self._shown:
                self._shown = inputs
                nodes, topics = graph_entries(snapshot, now, self._feed.overview.findings, self._robot)
                self._store.replace("node", nodes)
                self._store.replace("topic", topics)
            self._reasoner.look(stamp, thresholds(tree))

    def _desired_model(self, tree: Any) -> DesiredModel | None:
        """Return the model that the monitor has: its parameters tell the files."""
        own = tree.get("rosgraph_monitor", {})
        own = own if isinstance(own, dict) else {}
        of = str(own.get("desired_rossystem", "")), str(own.get("variants", ""))
        if of != self._desired_of:
            self._desired_of, self._desired = of, None
            try:
                self._desired = desired_model(*of, rospy.logdebug) if of[0] else None
            except ModelError as error:
                rospy.logwarn("the desired graph is not shown: %s", error)
            self._follow_desired()
        return self._desired

    def _follow_desired(self) -> None:
        if self._desired is not None and self._groundings:
            self._desired.follow(self._groundings)

    def _follow_places(self, snapshot: GraphSnapshot) -> None:
        """Subscribe to the topics that tell where the robot is, as soon as they are there.

        Images cost their publisher much: they are heard while somebody looks at the page.
        """
        home = self._robot
        topics = ((t.name, t.type) for t in snapshot.topics.values() if t.name.startswith(home) and t.publishers)
        found = topics_of_places(topics)
        if not self._server.viewers:
            found.pop(CAMERA, None)
            if CAMERA in self._places:
                self._places.pop(CAMERA).unregister()
        for role, topic in found.items():
            known = self._places.get(role)
            if known is not None and known.resolved_name == topic:
                continue
            if known is not None:
                known.unregister()
            kind = roslib.message.get_message_class(type_of(snapshot.topics[topic].type))
            if kind is not None:
                take = _Sparse(self._on_place, role, kind).take
                self._places[role] = rospy.Subscriber(topic, rospy.AnyMsg, take, queue_size=1)

    def _on_place(self, role: str, message: Any) -> None:
        with self._lock:
            take_place(self._feed, role, message)

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        publisher = array._connection_header.get("callerid", "")
        with self._lock:
            self._feed.take_diagnostics(array, rospy.get_time(), time.monotonic(), publisher, self._diagnostics)

    def _on_sign(self, status: DiagnosticStatus) -> None:
        with self._lock:
            self._feed.take_sign(sign_of(status), time.monotonic())

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        with self._lock:
            self._feed.take_configuration(message, rospy.get_time())
            self._groundings = tuple(Grounding(f.function, f.configuration, f.state) for f in message.functions)
            self._follow_desired()

    def _on_decision(self, message: Decision) -> None:
        with self._lock:
            self._feed.take_decision(messages.decision(message, rospy.get_time()))

    def _on_event(self, message: MissionEvent) -> None:
        with self._lock:
            self._feed.take_event(messages.event(message, rospy.get_time()))

    def _on_journal(self, message: ReasonerJournal) -> None:
        self._reasoner.take(message)

    def _tell_earlier_decisions(self) -> None:
        name = "mros1_reasoner/decisions"
        try:
            rospy.wait_for_service(name, _DECISIONS_WAIT)
            found = rospy.ServiceProxy(name, LastDecisions)(0)
        except (OSError, rospy.ROSException, rospy.ServiceException):
            return  # no reasoner runs yet
        with self._lock:
            for decision in found.decisions:
                self._feed.take_decision(messages.decision(decision, rospy.get_time()))


class _Sparse:
    """Passes on messages of a topic, but not more often than a page shows."""

    def __init__(self, take: Any, role: str, kind: Any) -> None:
        self._take, self._role, self._kind = take, role, kind
        self._period = _LARGE_EACH if role in (MAP, COSTMAP, CAMERA) else _PLACES_EACH
        self._due = 0.0

    def take(self, message: rospy.AnyMsg) -> None:
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + self._period
        try:
            decoded = self._kind().deserialize(message._buff)
        except genpy.DeserializationError as error:  # of another version, or damaged
            rospy.logwarn_throttle(30.0, "the %s of the robot can't be read: %s", self._role, error)
            return
        self._take(self._role, decoded)


def main() -> None:
    """Run the node; exit status 2 where it can't start."""
    with Lifetime(NAME, ParameterError, PageError, ServerError) as life:
        life.start()
        node = DashboardNode(ParameterTree(rospy.get_param("~", {}), rospy.get_name()))
        rospy.on_shutdown(node.close)
        node.run()
