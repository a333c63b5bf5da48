"""Everything that listens to topics: nodes that are made without a master, and good messages to begin from."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import genpy
import numpy as np
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from control_msgs.msg import FollowJointTrajectoryActionGoal, GripperCommandActionGoal
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    ConfigDescription,
    DoubleParameter,
    Group,
    IntParameter,
    ParamDescription,
    StrParameter,
)
from geometry_msgs.msg import (
    Point32,
    Polygon,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    TransformStamped,
    Twist,
)
from map_msgs.msg import OccupancyGridUpdate
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    Candidate,
    Cause,
    Decision,
    ExpectedQA,
    FunctionGrounding,
    LaunchedFunction,
    LaunchedFunctions,
    MissionEvent,
    NodeDescription,
    ProcessUsage,
    ReasonerJournal,
)
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.msg import Path as PathMessage
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import (
    BatteryState,
    CameraInfo,
    ChannelFloat32,
    CompressedImage,
    Illuminance,
    Image,
    Imu,
    JointState,
    LaserScan,
    PointCloud,
    PointCloud2,
    PointField,
)
from simulator_msgs.msg import ArmCommand, ArmState
from std_msgs.msg import Bool, Float32
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectoryPoint

from bad_input.journals import ENTRIES, journal
from bad_input.messages import changed, pack, serialised, unpack
from bad_input.mutation import LARGEST
from bad_input.unconnected import NAME, NOW, Ros, unconnected

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from random import Random

Good = "list[tuple[str, Any]]"
_OTHER = 0.3
"""Share of inputs with the messages of a seed in another order, or one of them twice."""
_CLOCK = "/clock"
_CLOCK_JUMPS = 0.1
"""Share of inputs with a message that sets the clock, to any time."""


@dataclass(frozen=True)
class Listener:
    """Something that listens to topics.

    Attributes:
        name: of it.
        modules: that listen.
        make: makes it; may return what is to be called after all messages.
        seeds: returns good messages by their topics.
        parameters: of the parameter server.
        types: of topics without a type.
        share: of all inputs, beside that of the others.
    """

    name: str
    modules: tuple[str, ...]
    make: Callable[[Ros], Callable[[], object] | None]
    seeds: Callable[[], list[tuple[str, Any]]]
    parameters: dict[str, Any] = field(default_factory=dict)
    types: dict[str, str] = field(default_factory=dict)
    share: float = 1.0


def packed(listener: Listener, messages: Sequence[tuple[str, Any]]) -> bytes:
    """Return messages as one input."""
    topics = topics_of(listener)
    return pack([(topics.index(topic), serialised(message)) for topic, message in messages])


_GOOD: dict[str, list[tuple[str, Any]]] = {}


def _good(listener: Listener) -> list[tuple[str, Any]]:
    """Return a listener's good messages, and one that sets the clock."""
    if listener.name not in _GOOD:
        _GOOD[listener.name] = [*listener.seeds(), (_CLOCK, Clock(rospy.Time.from_sec(NOW + 1.0)))]
    return _GOOD[listener.name]


def topics_of(listener: Listener) -> list[str]:
    """Return the topics of a listener's messages, and that of the clock; each has its number."""
    return list(dict.fromkeys(topic for topic, _ in _good(listener)))


def mutated_messages(rng: Random, listener: Listener, seeds: Sequence[bytes]) -> bytes:
    """Return messages, at least one of which is bad."""
    topics, kinds = topics_of(listener), {topic: type(message) for topic, message in _good(listener)}
    parts = [(topic % len(topics), data) for topic, data in unpack(rng.choice(seeds))] or [(0, b"")]
    if rng.random() < _OTHER:
        rng.shuffle(parts)
        parts = parts[: rng.randrange(1, len(parts) + 1)]
        parts.append(rng.choice(parts))
    if rng.random() < _CLOCK_JUMPS:
        clock = serialised(Clock(rospy.Time(rng.choice((0, 1, int(NOW) - 50, int(NOW) + 50, 2**31)))))
        parts.insert(rng.randrange(1, len(parts) + 1), (topics.index(_CLOCK), clock))
    for _ in range(rng.choice((1, 1, 2, 3))):
        place = rng.randrange(len(parts))
        number, data = parts[place]
        others = [other for topic, other in parts if topic == number]
        parts[place] = number, changed(rng, data, kinds[topics[number]], others)
    return pack(parts)[:LARGEST]


def take(listener: Listener, data: bytes) -> str | None:
    """Have a new listener take the messages of an input; return its first warning.

    Raises:
        Exception: a callback has fallen over, or what follows from it.
    """
    topics = topics_of(listener)
    warnings: list[str] = []
    with unconnected(listener.parameters) as ros:
        ros.types.update(listener.types)
        settle = listener.make(ros)
        for number, message in unpack(data):
            topic = topics[number % len(topics)]
            if topic == _CLOCK:
                _set_clock(message)
            for subscriber in ros.listening(topic):
                try:
                    received = subscriber.received(message)
                except Exception as error:  # rospy's own code, which logs it and goes on
                    warnings.append(f"no message: {error}")
                else:
                    subscriber.give(received)
            rospy.rostime._set_rostime(rospy.get_rostime() + rospy.Duration(0, 100_000_000))
        if settle is not None:
            settle()
        warnings += ros.said
    return " ".join(warnings[0].split()) if warnings else None


def _set_clock(data: bytes) -> None:
    """Set ROS time by a message on `/clock`, to any that its successors can be told in."""
    clock = Clock()
    try:
        clock.deserialize(data)
    except genpy.DeserializationError:
        return
    rospy.rostime._set_rostime(rospy.Time.from_sec(min(clock.clock.to_sec(), 2.0**32 - 100.0)))


# -- good messages -----------------------------------------------------------------------------------------------------

STAMP = rospy.Time.from_sec(NOW - 0.1)


def stamped(message: Any, frame: str = "") -> Any:
    message.header.stamp, message.header.frame_id = STAMP, frame
    return message


def configuration(function: str = "f_talk", name: str = "fast") -> ActiveConfiguration:
    return stamped(ActiveConfiguration(functions=[FunctionGrounding(function, name, "STABLE")]))


def _status(message: str, key: str, value: str, level: int = 0, name: str = "/talker", more: str = "") -> Any:
    values = [KeyValue(key, value)] + ([KeyValue("reason", more)] if more else [])
    return stamped(DiagnosticArray(status=[DiagnosticStatus(level, name, message, "robot", values)]))


def diagnostics() -> list[tuple[str, Any]]:
    return [
        ("/diagnostics", _status("QA status", "freshness", "0.1")),
        ("/diagnostics", _status("QA status", "power", "1.5")),
        ("/diagnostics", _status("QA stale", "power", "silent")),
        ("/diagnostics", _status("Component status", "talker", "FALSE", more="dead")),
        ("/diagnostics", _status("Component status", "talker", "RECOVERED")),
        ("/diagnostics", _status("Wrong param configuration", "rate", "5", 2)),
        ("/diagnostics", _status("Missing node", "node", "x", 2)),
        ("/diagnostics", _status("CPU Usage", "/reasoner", "12.5")),
        ("/diagnostics", _status("Binding status", "o/role", "camera")),
    ]


def _goals(status: int = 1) -> GoalStatusArray:
    return stamped(GoalStatusArray(status_list=[GoalStatus(GoalID(STAMP, "a-1"), status, "text")]))


def goal() -> MoveBaseActionGoal:
    goal = stamped(MoveBaseActionGoal(goal_id=GoalID(STAMP, "a-1")))
    goal.goal.target_pose = pose("map")
    return goal


def pose(frame: str = "odom") -> PoseStamped:
    pose = stamped(PoseStamped(), frame)
    pose.pose.position.x, pose.pose.orientation.w = 1.0, 1.0
    return pose


def _placed(frame: str = "map") -> PoseWithCovarianceStamped:
    pose = stamped(PoseWithCovarianceStamped(), frame)
    pose.pose.pose.orientation.w = 1.0
    pose.pose.covariance = [0.01] * 36
    return pose


def _odometry() -> Odometry:
    odometry = stamped(Odometry(child_frame_id="base_link"), "odom")
    odometry.pose.pose.orientation.w, odometry.twist.twist.linear.x = 1.0, 0.3
    return odometry


def _scan(frame: str = "front_laser") -> LaserScan:
    scan = LaserScan(
        angle_min=-1.5, angle_max=1.5, angle_increment=0.1, range_min=0.1, range_max=10.0, scan_time=0.1,
        ranges=[1.0 + n * 0.1 for n in range(31)],
    )  # fmt: skip
    return stamped(scan, frame)


def _grid(width: int = 12, height: int = 9) -> OccupancyGrid:
    grid = stamped(OccupancyGrid(data=[0] * (width * height)), "map")
    grid.info.width, grid.info.height, grid.info.resolution = width, height, 0.5
    grid.info.origin.position.x = grid.info.origin.position.y = -2.0
    grid.info.origin.orientation.w = 1.0
    return grid


def _cloud() -> PointCloud2:
    fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    data = np.arange(30, dtype=np.float32).tobytes()
    return stamped(
        PointCloud2(height=1, width=10, fields=fields, point_step=12, row_step=120, data=data, is_dense=True),
        "camera_link",
    )


def _image(encoding: str, width: int = 16, height: int = 12, size: int = 1) -> Image:
    data = np.linspace(0, 200, width * height * size).astype(np.uint8).tobytes()
    if encoding.startswith("32F"):
        data = np.linspace(0.2, 5.0, width * height * size // 4).astype(np.float32).tobytes()
    return stamped(Image(height=height, width=width, encoding=encoding, step=width * size, data=data), "camera_link")


def _info() -> CameraInfo:
    return stamped(
        CameraInfo(height=12, width=16, distortion_model="plumb_bob", D=[0.0] * 5,
                   K=[20.0, 0, 8.0, 0, 20.0, 6.0, 0, 0, 1.0], R=[1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0],
                   P=[20.0, 0, 8.0, 0, 0, 20.0, 6.0, 0, 0, 0, 1.0, 0])
    )  # fmt: skip


def _transform(parent: str, child: str) -> TransformStamped:
    transform = stamped(TransformStamped(child_frame_id=child), parent)
    transform.transform.rotation.w = 1.0
    return transform


def _tree() -> list[tuple[str, Any]]:
    pairs = (("map", "odom"), ("odom", "base_link"), ("base_link", "front_laser"), ("base_link", "camera_link"))
    return [("/tf", TFMessage([_transform(*pair) for pair in pairs]))]


def decision() -> Decision:
    expected = [ExpectedQA(name="freshness", value=0.1)]
    found = stamped(Decision(id="d-1", state="DECIDED", objective="o_talk", trigger="qa:freshness", causes=["late"]))
    found.candidates = [Candidate(name="fast", expected_qas=expected, utility=0.5, chosen=True)]
    found.reasons, found.to_configuration, found.stamp_monitored = [Cause()], "fast", STAMP
    return found


def _event() -> MissionEvent:
    return stamped(MissionEvent(kind="PERTURBATION", name="clutter:7", values=[KeyValue("places", "1.0,2.0")]))


def _sign() -> DiagnosticStatus:
    values = [KeyValue("part", "reasoner"), KeyValue("uri", "http://a:1/"), KeyValue("started", "12.5")]
    return DiagnosticStatus(0, "/reasoner", "Part of the meta-controller", "", values)


def _result() -> MoveBaseActionResult:
    return stamped(MoveBaseActionResult(status=GoalStatus(GoalID(STAMP, "a-1"), 3, "reached")))


def _journals() -> list[tuple[str, ReasonerJournal]]:
    topic = "/mros1_reasoner/journal"
    return [(topic, stamped(journal())), (topic, stamped(journal(len(ENTRIES), begins=False)))]


def _arm_state() -> ArmState:
    return ArmState(stamp=STAMP, positions=[0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.8], gripper_width=0.04, contact_force=1.0)


# -- who listens -------------------------------------------------------------------------------------------------------


_SAVED = TemporaryDirectory()
"""Where reasoners save what they know."""


@cache
def _reasoning() -> Any:
    from mros1_reasoner.io.parameters import Parameters
    from mros1_reasoner.io.reasoners import make_reasoner

    from bad_input.journals import PARAMETERS

    parameters = Parameters({**PARAMETERS, "task_actions": {"o_talkA": "talk"}, "save_folder": _SAVED.name})
    knowledge = parameters.knowledge_base()
    reasoner = make_reasoner("rules")
    reasoner.load(knowledge.ontology)
    return parameters, knowledge, parameters.objectives(knowledge), reasoner


def reasoner(_ros: Ros) -> Callable[[], object]:
    from mros1_reasoner.loop.entries import Step
    from mros1_reasoner.ros.reasoner import ReasonerNode

    node = ReasonerNode(*_reasoning())

    def settle() -> None:
        for heartbeat in (False, True):
            node._inbox.drain()
            node._take(Step(heartbeat))
            node._tasks.look()
            node._requests.look()
            node._journal.flush()
            node._next_look()

    return settle


def _monitor(_ros: Ros) -> Callable[[], object]:
    from rosgraph_monitor.graph.desired import Grounding
    from rosgraph_monitor.health.components import parse_components
    from rosgraph_monitor.health.topics import merged, model_topics, parse_topics
    from rosgraph_monitor.io.models import desired_model
    from rosgraph_monitor.ros.driver_status import DriverStatusListener
    from rosgraph_monitor.ros.topics import BatteryListener, TopicListener

    components = parse_components(
        {
            "battery": {"topic": "battery_state", "below": 0.2, "above": 0.3},
            "arm": {"diagnostic": "arm: safety"},
            "laser": {"node": "laser", "topic": "scan", "max_age": 2.0, "min_rate": 2.0},
        }
    )
    listener = TopicListener(1.0)
    listener.follow(parse_topics({"odom": {"max_age": 1.0, "min_rate": 5.0, "stuck_after": 3}}))
    batteries = BatteryListener(components.batteries, lambda: None)
    drivers = DriverStatusListener(components.driver_statuses, lambda: None)
    models = Path(__file__).resolve().parents[2] / "examples/talker_listener/models"
    model = desired_model(str(models / "talker_listener.rossystem"), str(models / "variants"), lambda _: None)

    def follow(message: ActiveConfiguration) -> None:
        current = model.follow(Grounding(f.function, f.configuration, f.state) for f in message.functions)
        system = current.system
        merged(model_topics(system) if system else {}, {})

    rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, follow)
    return lambda: (listener.judge(), batteries.conditions, batteries.reasons, drivers.conditions, drivers.reasons)


_OBSERVERS = (
    "SafetyQualityObserver",
    "EnergyQualityObserver",
    "LightObserver",
    "LocalizationQualityObserver",
    "ObjectiveErrorObserver",
)


def _observers(_ros: Ros) -> Callable[[], object]:
    from rosgraph_monitor.observers import plugins

    observers = [plugins.make(name, _exported()) for name in _OBSERVERS]
    for observer in observers:
        if observer.name == "SafetyQualityObserver":
            observer._need_cloud = True
        for topic, kind in observer.topics:
            rospy.Subscriber(topic, kind, lambda m, a: a[0].receive(a[1], m, rospy.get_time()), (observer, topic))

    def settle() -> None:
        for observer in observers:
            for status in observer.evaluate(rospy.get_time()):
                serialised(status)
            for _, output in observer.take_outputs():
                serialised(output)

    return settle


@cache
def _exported() -> Any:
    from rosgraph_monitor.observers import plugins

    return plugins.exported()


def _watch(_ros: Ros) -> Callable[[], object]:
    from metacontrol_bags import ownership
    from node_kit.ros.parts import sign_of
    from rich.console import Console
    from rosgraph_monitor.diagnostics.aggregator_names import unique_name
    from rosgraph_monitor.diagnostics.overview import Overview

    overview = Overview()

    def take_array(message: DiagnosticArray) -> None:
        for status in message.status:
            status.name = unique_name(status)
        overview.take(ownership.own(message.status, "/", "/other", "/diagnostics"), 1.0)

    rospy.Subscriber("/diagnostics", DiagnosticArray, take_array)
    rospy.Subscriber("metacontrol_parts", DiagnosticStatus, lambda m: overview.parts.hear(sign_of(m), 1.0))
    rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, overview.take_configuration)

    def settle() -> None:
        console = Console(width=80)
        with console.capture():
            console.print(overview.render(["/talker"], {"freshness": 1.0}, 2.0))

    return settle


def _rviz_text(_ros: Ros) -> Callable[[], object]:
    from rosgraph_monitor.ros.rviz_text import RvizTextNode

    return RvizTextNode()._publish


def _pending_goal(_ros: Ros) -> Callable[[], object]:
    from rosgraph_manipulator.ros.goal import PendingGoal

    pending = PendingGoal("move_base", "move_base_msgs/MoveBaseAction")
    pending._clients = SimpleNamespace(of=lambda _: None, why_gone=lambda *_: "")

    def settle() -> None:
        pending.server_stops()
        pending.server_started()
        pending.deliver()

    return settle


def _launchers(_ros: Ros) -> Callable[[], object]:
    from rosgraph_launcher.hosts import HostLauncher
    from rosgraph_launcher.ros.node_messages import from_message, samples_from
    from rosgraph_manipulator.ros.launcher_reports import LauncherReports, _Known

    followed = LauncherReports(1.0, 1.0)
    followed._known["/other"] = _Known(HostLauncher("/other", ()), is_here=True)

    def take_node(message: NodeDescription) -> None:
        with contextlib.suppress(ValueError):  # the service answers with it
            from_message(message)

    rospy.Subscriber("change", NodeDescription, take_node)
    rospy.Subscriber("usage", ProcessUsage, lambda message: samples_from([message]))
    return followed.reports


def _reconfigure(_ros: Ros) -> None:
    from rosgraph_manipulator.ros.reconfigure_client import _described

    rospy.Subscriber("parameter_descriptions", ConfigDescription, lambda m: _described("/server", m))


def _description() -> ConfigDescription:
    parameters = [ParamDescription(n, k, 0, "", "") for n, k in (("a", "int"), ("b", "double"), ("c", "str"))]
    values = Config(
        bools=[BoolParameter("d", True)],
        ints=[IntParameter("a", 1)],
        strs=[StrParameter("c", "x")],
        doubles=[DoubleParameter("b", 1.0)],
    )
    return ConfigDescription([Group(name="Default", parameters=parameters)], values, values, values)


_SEES = {"marking": True, "clearing": True, "expected_update_rate": 10.0}
_MOVE_BASE: dict[str, Any] = {
    "controller_frequency": 5.0,
    "global_costmap": {
        "global_frame": "map", "robot_base_frame": "base_link", "footprint_topic": "footprint", "resolution": 0.5,
        "transform_tolerance": 10.0,
        "footprint": [[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]],
        "plugins": [{"name": "static_layer", "type": "costmap_2d::StaticLayer"},
                    {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"},
                    {"name": "inflation", "type": "costmap_2d::InflationLayer"}],
        "static_layer": {"map_topic": "map", "subscribe_to_updates": True},
        "obstacles": {"observation_sources": "scan",
                      "scan": {"data_type": "LaserScan", "topic": "scan", **_SEES}},
    },
    "local_costmap": {
        "global_frame": "odom", "robot_base_frame": "base_link", "rolling_window": True, "width": 3.0, "height": 3.0,
        "resolution": 0.2, "transform_tolerance": 10.0,
        "footprint": [[0.3, 0.3], [-0.3, 0.3], [-0.3, -0.3], [0.3, -0.3]],
        "plugins": [{"name": "static_layer", "type": "costmap_2d::StaticLayer"},
                    {"name": "obstacles", "type": "costmap_2d::ObstacleLayer"}],
        "obstacles": {"observation_sources": "scan cloud points",
                      "scan": {"data_type": "LaserScan", "topic": "scan", **_SEES},
                      "cloud": {"data_type": "PointCloud2", "topic": "cloud", **_SEES},
                      "points": {"data_type": "PointCloud", "topic": "points", **_SEES}},
    },
}  # fmt: skip


def _move_base(_ros: Ros) -> Callable[[], object]:
    return made_move_base()[1]


def made_move_base() -> tuple[Any, Callable[[], object]]:
    """Return a node, and what has it work on what it has heard."""
    from move_base.parameters.reader import read_parameters
    from move_base.ros.move_base import MoveBaseNode

    node = MoveBaseNode(read_parameters(_MOVE_BASE), dict(_MOVE_BASE), None)

    began = rospy.get_time()

    def settle() -> None:
        if rospy.get_time() < began:
            node._clock_set_back(rospy.get_time())
        for _ in range(3):
            node._take_parameters()
            node._tick(rospy.get_time())
            rospy.rostime._set_rostime(rospy.get_rostime() + rospy.Duration(0, 200_000_000))

    return node, settle


def move_base_good() -> list[tuple[str, Any]]:
    update = stamped(OccupancyGridUpdate(x=1, y=1, width=3, height=2, data=[0] * 6), "map")
    points = [Point32(1.0, 0.5 * n, 0.3) for n in range(5)]
    cloud = stamped(PointCloud(points=points, channels=[ChannelFloat32("i", [1.0] * 5)]), "camera_link")
    corners = [Point32(x, y, 0.0) for x, y in ((0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3))]
    return [
        *_tree(),
        ("/map", _grid()),
        ("/map_updates", update),
        ("/odom", _odometry()),
        ("/scan", _scan()),
        ("/cloud", _cloud()),
        ("/points", cloud),
        ("/node/global_costmap/footprint", Polygon(corners)),
        ("/move_base/cancel", GoalID(rospy.Time(), "other")),
        ("/move_base/goal", goal()),
        ("/move_base_simple/goal", pose("map")),
    ]


def _load_control(_ros: Ros) -> Callable[[], object]:
    from metacontrol_sim.ros.battery_load_control import BatteryLoadControlNode

    node = BatteryLoadControlNode()

    def settle() -> None:
        rospy.rostime._set_rostime(rospy.get_rostime() + rospy.Duration(1))
        node._on_tick(None)

    return settle


def _sensors(_ros: Ros) -> None:
    from pybullet_simulator.ros.camera import CameraNode
    from pybullet_simulator.ros.colour_camera import ColourCameraNode
    from pybullet_simulator.ros.laser import LaserNode

    LaserNode("front").peer_subscribe("", None, None)
    CameraNode().peer_subscribe("", None, None)
    ColourCameraNode()


def _arm(_ros: Ros) -> None:
    from pybullet_simulator.ros.arm import ArmNode

    ArmNode()


def _arm_good() -> list[tuple[str, Any]]:
    motion = stamped(FollowJointTrajectoryActionGoal(goal_id=GoalID(STAMP, "m-1")))
    from pybullet_simulator.messages.arms import joint_names

    motion.goal.trajectory.joint_names = joint_names("left")
    later = [0.1, -0.5, 0.0, -2.0, 0.0, 1.5, 0.8]
    motion.goal.trajectory.points = [
        JointTrajectoryPoint(positions=p, velocities=[0.0] * 7, time_from_start=rospy.Duration(t))
        for t, p in ((0, _arm_state().positions), (2, later))
    ]
    grip = stamped(GripperCommandActionGoal(goal_id=GoalID(STAMP, "g-1")))
    grip.goal.command.position, grip.goal.command.max_effort = 0.02, 10.0
    state, after = "/simulator/left_arm/state", _arm_state()
    after.stamp = STAMP + rospy.Duration(1)
    motions, grips = f"{NAME}/follow_joint_trajectory", f"{NAME}/gripper_command"
    return [(state, _arm_state()), (f"{motions}/goal", motion), (f"{grips}/goal", grip), (state, after),
            (f"{motions}/cancel", GoalID(STAMP, "m-1"))]  # fmt: skip


@cache
def _simulations() -> Any:
    from pybullet_simulator.io.world_file import read_world
    from pybullet_simulator.physics.cell_simulation import CellSimulation
    from pybullet_simulator.physics.simulation import Settings, Simulation
    from robot_formulas.geometry import Pose as Place

    world = Path(__file__).resolve().parents[2] / "catkin_ws/src/metacontrol_sim/worlds/factory.yaml"
    return Simulation(read_world(world), Settings(Place(2.0, 2.0, 0.0))), CellSimulation(0)


def _simulator(_ros: Ros) -> Callable[[], object]:
    return made_simulators()[2]


def made_simulators() -> tuple[Any, Any, Callable[[], object]]:
    """Return the simulators of D2 and D1, and what has both take a step."""
    from node_kit.io.inbox import Inbox
    from pybullet_simulator.ros.cell_simulator import CellSimulatorNode
    from pybullet_simulator.ros.simulator import SimulatorNode

    robot, cell = object.__new__(SimulatorNode), object.__new__(CellSimulatorNode)
    robot._simulation, cell._simulation = _simulations()
    robot._inbox, cell._inbox = Inbox(), Inbox()
    rospy.Subscriber("cmd_vel", Twist, robot._on_command)
    rospy.Subscriber("power_load", Float32, robot._on_load)
    rospy.Subscriber("power_consumption_factor", Float32, robot._on_factor)
    rospy.Subscriber("cmd_vel", Twist, cell._on_drive)
    rospy.Subscriber("simulator/left_arm/command", ArmCommand, cell._on_arm, "left")

    def settle() -> None:
        for node in (robot, cell):
            node._inbox.drain()
            node._simulation.step()

    return robot, cell, settle


def _dashboard(_ros: Ros) -> Callable[[], object]:
    import threading

    from metacontrol_dashboard.ros.dashboard import DashboardNode
    from metacontrol_dashboard.ros.reasoner import ReasonerFollower
    from metacontrol_dashboard.state.feed import Feed
    from metacontrol_dashboard.state.places import CAMERA, COSTMAP, GOAL, MAP, POSE, WAY
    from metacontrol_dashboard.state.store import Store

    node = object.__new__(DashboardNode)
    node._robot, node._lock, node._store = "/", threading.Lock(), Store()
    node._feed = Feed(node._store, "/")
    node._diagnostics, node._groundings, node._desired = "/diagnostics", (), None
    node._reasoner = ReasonerFollower(node._store, node._feed, node._lock)
    node._listen()
    kinds = {MAP: OccupancyGrid, COSTMAP: OccupancyGrid, POSE: Odometry, WAY: PathMessage, GOAL: MoveBaseActionGoal}
    topics = [(role, role, kind) for role, kind in kinds.items()]
    for topic, role, kind in (*topics, ("image", CAMERA, Image), ("compressed", CAMERA, CompressedImage)):
        rospy.Subscriber(f"place/{topic}", kind, lambda message, role: node._on_place(role, message), role)

    def settle() -> None:
        import json

        node._feed.look(1.0)
        with node._lock:
            node._reasoner.look(rospy.get_time(), {})
        json.dumps(node._store.changes(0), default=str)

    return settle


def _dashboard_good() -> list[tuple[str, Any]]:
    return [
        *diagnostics(),
        ("/metacontrol_parts", _sign()),
        ("/rosgraph_manipulator/active_configuration", configuration()),
        ("/mros1_reasoner/decision", decision()),
        ("/mission/event", _event()),
        ("/place/map", _grid()),
        ("/place/costmap", _grid(3, 4)),
        ("/place/pose", _odometry()),
        ("/place/way", stamped(PathMessage(poses=[pose("map")] * 3), "map")),
        ("/place/goal", goal()),
    ]


def _pictures() -> list[tuple[str, Any]]:
    import cv2

    shades = np.linspace(0, 255, 24 * 32 * 3).astype(np.uint8).reshape(24, 32, 3)
    packed = {kind: cv2.imencode(f".{kind}", shades)[1].tobytes() for kind in ("jpeg", "png")}
    images = [_image("rgb8", size=3), _image("bayer_rggb8"), _image("16UC1", size=2), _image("32FC1", size=4)]
    return [
        *(("/place/image", image) for image in images),
        *(("/place/compressed", CompressedImage(format=kind, data=data)) for kind, data in packed.items()),
    ]


def _cell_places(_ros: Ros) -> Callable[[], object]:
    import threading

    from metacontrol_manipulation.ros.places import BaseOdometry, GivenCell
    from metacontrol_manipulation.ros.robot import RosRobot
    from metacontrol_manipulation.ros.tag_localizer import TagLocalizer

    localizer = TagLocalizer()
    odometry = BaseOdometry()
    place = GivenCell(odometry, 0.0)
    robot = object.__new__(RosRobot)
    robot._news, robot._joints, robot._widths, robot._stopped = threading.Condition(), {}, {}, set()
    robot._arms = {"left": None, "right": None}
    rospy.Subscriber("joint_states", JointState, robot._on_joints)
    rospy.Subscriber("/diagnostics", DiagnosticArray, robot._on_diagnostics)

    def settle() -> None:
        localizer._odometry.at(rospy.Time.now())
        place._is_good()
        if place._known is not None:
            place._known.moved(odometry._track.latest or place._known.base).deviation  # noqa: B018
        robot.held, robot.working, robot.joints  # noqa: B018

    return settle


def _cell_good() -> list[tuple[str, Any]]:
    from pybullet_simulator.messages.arms import joint_names

    names = [*joint_names("left"), "left_panda_finger_joint1", "left_panda_finger_joint2"]
    joints = stamped(JointState(name=names, position=[0.1] * len(names)))
    later = _odometry()
    later.header.stamp = STAMP + rospy.Duration(0, 50_000_000)
    return [
        ("/odom", _odometry()),
        ("/odom", later),
        ("/camera/camera_info", _info()),
        ("/camera/image_raw", _image("rgb8", 32, 24, 3)),
        ("/cell_pose", _placed("odom")),
        ("/joint_states", joints),
        ("/diagnostics", _status("x", "force", "3", 2, "left_arm: safety")),
    ]


def _mission(_ros: Ros) -> Callable[[], object]:
    from metacontrol_bags import messages
    from metacontrol_bags.goal_status import GoalStatus as Status
    from metacontrol_bags.timeline import Timeline
    from metacontrol_experiments.mission.clock import SteadyClock
    from metacontrol_experiments.mission.readiness import Readiness
    from metacontrol_experiments.ros.goal import MissionGoal
    from metacontrol_experiments.ros.mission import NavigationMission

    node = object.__new__(NavigationMission)
    node._clock = SteadyClock()
    node._timeline, node._readiness, node._state, node._position = Timeline({"freshness": 0.2}), Readiness(), None, None
    node._goal = MissionGoal("move_base", MoveBaseActionGoal)
    node._display = SimpleNamespace(entry=lambda _: None)
    rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, node._on_configuration)
    rospy.Subscriber("mros1_reasoner/decision", Decision, node._on_decision)
    rospy.Subscriber("/diagnostics", DiagnosticArray, node._on_diagnostics)
    rospy.Subscriber("amcl_pose", PoseWithCovarianceStamped, node._on_pose)
    rospy.Subscriber("move_base/status", GoalStatusArray, node._on_status)
    rospy.Subscriber("move_base/status", GoalStatusArray, node._goal.status_in)
    rospy.Subscriber("move_base/result", MoveBaseActionResult, node._on_result)
    rospy.Subscriber("move_base/result", MoveBaseActionResult, lambda m: Status.of(m.status.status))
    rospy.Subscriber("mission/event", MissionEvent, lambda m: messages.event(m, rospy.get_time()))
    return lambda: node._readiness.failed


def _mission_good() -> list[tuple[str, Any]]:
    return [
        ("/rosgraph_manipulator/active_configuration", configuration()),
        ("/mros1_reasoner/decision", decision()),
        *diagnostics(),
        ("/amcl_pose", _placed()),
        ("/move_base/status", _goals()),
        ("/move_base/result", _result()),
        ("/mission/event", _event()),
    ]


def _contingencies(_ros: Ros) -> Callable[[], object]:
    from metacontrol_experiments.ros.contingencies import ContingencyNode

    node = ContingencyNode()
    return node._due


def _pyramid(_ros: Ros) -> None:
    from metacontrol_experiments.mission.clock import SteadyClock
    from metacontrol_experiments.pyramid import course
    from metacontrol_experiments.ros.pyramid_mission import PyramidMission

    node = object.__new__(PyramidMission)
    node._clock = SteadyClock()
    node._state, node._placing, node._scenario = course.start(NOW), "left", None
    node._display = SimpleNamespace(progress=lambda *_: None)
    rospy.Subscriber("simulator/left_arm/state", ArmState, lambda m: node._on_arm("left", m))
    rospy.Subscriber("ground_truth/blocks", PoseArray, node._on_blocks)


LISTENERS: tuple[Listener, ...] = (
    Listener(
        "the reasoner", ("mros1_reasoner/ros/reasoner.py",), reasoner,
        lambda: [("/rosgraph_manipulator/active_configuration", configuration()), *diagnostics(),
                 ("/obj_error", Bool(True)), ("/talk/status", _goals(4))],
        share=0.5,
    ),
    Listener(
        "the monitor", ("rosgraph_monitor/ros/monitor.py", "rosgraph_monitor/ros/topics.py",
                        "rosgraph_monitor/ros/driver_status.py"), _monitor,
        lambda: [("/battery_state", stamped(BatteryState(percentage=0.5, charge=1.0, capacity=2.0))),
                 ("/odom", _odometry()), ("/diagnostics", _status("x", "force", "3", 2, "arm: safety")),
                 ("/rosgraph_manipulator/active_configuration", configuration())],
        types={"/odom": "nav_msgs/Odometry"}, share=0.5,
    ),
    Listener(
        "the observers", ("rosgraph_monitor/ros/observers.py",), _observers,
        lambda: [("/odometry/filtered", _odometry()), ("/tf_static", _tree()[0][1]), ("/front/scan", _scan()),
                 ("/camera/depth/points", _cloud()), ("/power_load", Float32(3.0)),
                 ("/illuminance", stamped(Illuminance(illuminance=200.0))), ("/amcl_pose", _placed()),
                 ("/move_base/status", _goals(4))],
        share=2.0,
    ),
    Listener(
        "the monitor's views", ("rosgraph_monitor/ros/watch.py", "rosgraph_monitor/ros/diagnostic_names.py"), _watch,
        lambda: [*diagnostics(), ("/metacontrol_parts", _sign()),
                 ("/rosgraph_manipulator/active_configuration", configuration())], share=0.5,
    ),
    Listener(
        "the text for RViz", ("rosgraph_monitor/ros/rviz_text.py",), _rviz_text,
        lambda: [*diagnostics(), ("/rosgraph_manipulator/active_configuration", configuration())],
    ),
    Listener(
        "the keeper of goals", ("rosgraph_manipulator/ros/goal.py",), _pending_goal,
        lambda: [("/move_base/goal", goal()), ("/move_base/status", _goals()), ("/move_base/result", _result()),
                 ("/move_base/cancel", GoalID(STAMP, "a-1"))],
    ),
    Listener(
        "reports of launchers", ("rosgraph_manipulator/ros/launcher_reports.py", "rosgraph_launcher/ros/launcher.py"),
        _launchers,
        lambda: [("/rosgraph_launcher/functions", LaunchedFunctions(functions=[LaunchedFunction(
                     "f", "fast", 1, "STABLE", ["/a"], ["/b"], "dead")])),
                 ("/change", NodeDescription(name="/a", package="p", executable="e", remaps=["a:=b"],
                                             environment=["A=b"])),
                 ("/usage", ProcessUsage())],
    ),
    Listener(
        "descriptions of parameters", ("rosgraph_manipulator/ros/reconfigure_client.py",), _reconfigure,
        lambda: [("/parameter_descriptions", _description())],
    ),
    Listener("move_base", ("move_base/ros/move_base.py", "move_base/ros/goals.py"), _move_base, move_base_good,
             share=1.0),
    Listener(
        "the battery's load", ("metacontrol_sim/ros/battery_load_control.py",), _load_control,
        lambda: [("/odom", _odometry()), ("/imu/data", stamped(Imu())), ("/cmd_vel", Twist())],
    ),
    Listener(
        "drivers of sensors", ("pybullet_simulator/ros/laser.py", "pybullet_simulator/ros/camera.py",
                               "pybullet_simulator/ros/colour_camera.py"), _sensors,
        lambda: [("/simulator/front_rays", _scan()), ("/simulator/depth", _image("32FC1", size=4)),
                 ("/simulator/light", Float32(0.5)), ("/simulator/image", _image("32FC3", size=12))],
    ),
    Listener("the driver of an arm", ("pybullet_simulator/ros/arm.py",), _arm, _arm_good),
    Listener(
        "the simulators", ("pybullet_simulator/ros/simulator.py", "pybullet_simulator/ros/cell_simulator.py"),
        _simulator,
        lambda: [("/cmd_vel", Twist()), ("/power_load", Float32(3.0)), ("/power_consumption_factor", Float32(1.0)),
                 ("/simulator/left_arm/command", ArmCommand(_arm_state().positions, 0.04, 10.0))],
        share=0.5,
    ),
    Listener("the dashboard", ("metacontrol_dashboard/ros/dashboard.py",), _dashboard, _dashboard_good),
    Listener("the dashboard's camera", ("metacontrol_dashboard/ros/dashboard.py",), _dashboard, _pictures),
    Listener("a reasoner's journal", ("metacontrol_dashboard/ros/reasoner.py",), _dashboard, _journals, share=0.1),
    Listener(
        "the work cell", ("metacontrol_manipulation/ros/robot.py", "metacontrol_manipulation/ros/places.py",
                          "metacontrol_manipulation/ros/tag_localizer.py"), _cell_places, _cell_good,
    ),
    Listener("a mission", ("metacontrol_experiments/ros/mission.py", "metacontrol_experiments/ros/mission_node.py"),
             _mission, _mission_good),
    Listener(
        "contingencies on the way", ("metacontrol_experiments/ros/contingencies.py",), _contingencies,
        lambda: [("/amcl_pose", _placed()), ("/move_base/goal", goal())],
        share=0.5,
    ),
    Listener(
        "a mission of pyramids", ("metacontrol_experiments/ros/pyramid_mission.py",), _pyramid,
        lambda: [("/simulator/left_arm/state", _arm_state()), ("/ground_truth/blocks", PoseArray(poses=[Pose()] * 2))],
    ),
)  # fmt: skip
