"""Node mission_contingencies: a timeline of contingencies for a system that `metacontrol run` did not start.

The way begins with a goal for move_base. `contingency/strike` is there all the time.
"""

from __future__ import annotations

import math
import threading
from pathlib import Path
from typing import TYPE_CHECKING

import psutil
import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped
from metacontrol_msgs.msg import MissionEvent
from move_base_msgs.msg import MoveBaseActionGoal
from node_kit.ros.lifetime import Lifetime
from robot_formulas.geometry import Pose, yaw_of

from metacontrol_experiments.contingency.contingency import InjectionError, contingencies_due, with_seed
from metacontrol_experiments.contingency.parsing import ComponentError, ContingencyError, node_of, parse_contingency
from metacontrol_experiments.io.input_files import PackageError, read_components, read_contingencies, simulation_package
from metacontrol_experiments.ros.fault_injection import FaultInjector, serve

if TYPE_CHECKING:
    from metacontrol_experiments.contingency.contingency import Contingency

_PERIOD_S = 0.1


class ContingencyNode:
    """Follows one way after another; each contingency strikes once."""

    def __init__(self) -> None:
        """Read the timeline and connect.

        Raises:
            ContingencyError: the timeline makes no sense.
            ComponentError: it hits a component that nobody knows.
        """
        seed = rospy.get_param("~seed", 0)
        if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
            raise ContingencyError(f"parameter ~seed is {seed!r}; give a whole number, 0 or more")
        models = simulation_package() / "models" / "metacontrol.yaml"
        components = read_components(Path(rospy.get_param("~components", str(models))))
        self._plan = with_seed(_timeline(), seed)
        for contingency in self._plan:
            if contingency.kind.hits_component:
                node_of(contingency.target, components)
        self._injector = FaultInjector(components, psutil.pid_exists)
        self._injected: frozenset[int] = frozenset()
        self._pose: Pose | None = None
        self._goal: Pose | None = None
        self._began: tuple[float, float] | None = None  # time and distance to the goal when it was sent
        self._lock = threading.RLock()
        self._events = rospy.Publisher("mission/event", MissionEvent, queue_size=10)
        self._service = serve(self._inject, seed)
        self._inputs = (
            rospy.Subscriber("amcl_pose", PoseWithCovarianceStamped, self._on_pose),
            rospy.Subscriber("move_base/goal", MoveBaseActionGoal, self._on_goal),
        )
        self._timer = rospy.Timer(rospy.Duration.from_sec(_PERIOD_S), lambda _event: self._on_time(), reset=True)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        pose = Pose(position.x, position.y, yaw_of(turn.z, turn.w))
        if all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            with self._lock:
                self._pose = pose

    def _on_goal(self, message: MoveBaseActionGoal) -> None:
        position = message.goal.target_pose.pose.position
        if not (math.isfinite(position.x) and math.isfinite(position.y)):
            rospy.logwarn("a goal of move_base is not finite; the timeline goes on with the last one")
            return
        with self._lock:
            self._goal = Pose(position.x, position.y, 0.0)
            self._began = None

    def _on_time(self) -> None:
        """Let what is due strike."""
        with self._lock:
            due = self._due()
            self._injected |= set(due)
        for index in due:
            try:
                self._inject(self._plan[index])
            except InjectionError as error:
                rospy.logerr(f"contingency failed: {error}")

    def _due(self) -> tuple[int, ...]:
        pose, goal, now = self._pose, self._goal, rospy.get_time()
        if pose is None:
            return ()
        if goal is None:  # no way yet: what is there from the start
            return tuple(i for i, entry in enumerate(self._plan) if entry.when.at_start and i not in self._injected)
        left = math.dist((pose.x, pose.y), (goal.x, goal.y))
        if self._began is None:
            self._began = (now, max(left, 1e-6))
        began, whole = self._began
        return contingencies_due(self._plan, self._injected, max(0.0, 1.0 - left / whole), now - began, pose.x, pose.y)

    def _inject(self, contingency: Contingency) -> None:
        pose = self._pose
        way = None if pose is None else (pose, self._goal or pose)
        injected = self._injector.inject(contingency, way)
        message = MissionEvent(kind=MissionEvent.PERTURBATION, name=contingency.event)
        message.header.stamp = injected.stamp
        message.values = [KeyValue(key, value) for key, value in injected.values.items()]
        self._events.publish(message)
        rospy.loginfo(f"contingency: {contingency.event}")


def _timeline() -> tuple[Contingency, ...]:
    """Return the contingencies of the parameters ~timeline (a file) and ~contingencies (a list of texts)."""
    path, texts = rospy.get_param("~timeline", ""), rospy.get_param("~contingencies", [])
    if not isinstance(path, str) or not isinstance(texts, list):
        raise ContingencyError("parameters: ~timeline is the path of a YAML file, ~contingencies a list of texts")
    listed = read_contingencies(Path(path).expanduser()) if path else ()
    return (*listed, *(parse_contingency(str(text)) for text in texts))


def main() -> None:
    """Run the node; exit status 2 when the timeline cannot be used."""
    with Lifetime("mission_contingencies", ContingencyError, ComponentError, PackageError) as life:
        life.start()
        ContingencyNode()
        rospy.spin()
