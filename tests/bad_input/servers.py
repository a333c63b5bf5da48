"""Everything that offers services or actions: nodes that are made without a master, and good requests and goals."""

from __future__ import annotations

from functools import cache, partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

import rospy
from actionlib_msgs.msg import GoalID
from dynamic_reconfigure.msg import BoolParameter, Config, DoubleParameter, GroupState, IntParameter, StrParameter
from dynamic_reconfigure.srv import ReconfigureRequest
from geometry_msgs.msg import Point
from metacontrol_manipulation.msg import BuildPyramidActionGoal
from metacontrol_msgs.msg import (
    ChangeFunctionActionGoal,
    ChangeFunctionGoal,
    ExpectedQA,
    MvpReconfigurationActionGoal,
    NodeDescription,
    ObjectiveActionGoal,
    ObjectiveGoal,
    RepairActionGoal,
)
from metacontrol_msgs.srv import (
    AddObjectiveRequest,
    ApproveDecisionRequest,
    ChangeNodesRequest,
    CheckNodesRequest,
    FeasibleRequest,
    LastDecisionsRequest,
    ListObserversRequest,
    LoadObserverRequest,
    ReadUsageRequest,
    RemoveObjectiveRequest,
    SaveKnowledgeBaseRequest,
    SetNfrRequest,
    StandByRequest,
    UnloadObserverRequest,
)
from metacontrol_sim.srv import ContingencyRequest, IncreaseConsumptionFactorRequest
from nav_msgs.srv import GetPlanRequest
from sensor_msgs.msg import LaserScan
from simulator_msgs.srv import (
    DeleteObstacle,
    DeleteObstacleRequest,
    SetLight,
    SetLightRequest,
    SpawnObstacle,
    SpawnObstacleRequest,
)
from std_srvs.srv import EmptyRequest, TriggerRequest

from bad_input.listeners import (
    STAMP,
    Listener,
    configuration,
    diagnostics,
    goal,
    made_move_base,
    made_simulators,
    move_base_good,
    pose,
    reasoner,
    stamped,
)
from bad_input.unconnected import NAME, Ros

if TYPE_CHECKING:
    from collections.abc import Callable

Good = list[tuple[str, Any]]


def _asked_for(kind: Any, name: str, wish: Any = None) -> Any:
    """Return a goal of an action."""
    asked = stamped(kind(goal_id=GoalID(STAMP, name)))
    if wish is not None:
        asked.goal = wish
    return asked


# -- the reasoner ------------------------------------------------------------------------------------------------------


def _reasoner_good() -> Good:
    objective = "/mros1_reasoner/objective"
    wish = ObjectiveGoal("f_talk", "o_talk", [ExpectedQA("power", 3.0)], 1, 5.0)
    return [
        ("/rosgraph_manipulator/active_configuration", configuration()),
        *diagnostics()[:2],
        (f"{objective}/goal", _asked_for(ObjectiveActionGoal, "o-1", wish)),
        (f"{NAME}/set_nfr", SetNfrRequest("", "power", 3.0)),
        (f"{NAME}/add_objective", AddObjectiveRequest("o_more", "f_talk", [ExpectedQA("power", 2.0)])),
        (f"{NAME}/remove_objective", RemoveObjectiveRequest("o_more")),
        (f"{NAME}/feasible", FeasibleRequest("f_talk")),
        (f"{NAME}/approve", ApproveDecisionRequest("")),
        (f"{NAME}/reject", ApproveDecisionRequest("1")),
        *((f"{NAME}/{name}", TriggerRequest()) for name in ("pause", "resume", "lock", "unlock")),
        ("/mros1_reasoner/decisions", LastDecisionsRequest(3)),
        (f"{objective}/cancel", GoalID(STAMP, "o-1")),
    ]


# -- the monitor -------------------------------------------------------------------------------------------------------


def _observer_host(_ros: Ros) -> Callable[[], object]:
    from rosgraph_monitor.ros.diagnostics import DiagnosticsTopic
    from rosgraph_monitor.ros.observers import ObserverHost

    host = ObserverHost(DiagnosticsTopic())
    return host.supervise


def _observer_host_good() -> Good:
    name = "EnergyQualityObserver"
    return [
        ("/load_observer", LoadObserverRequest(name)),
        ("/active_observers", ListObserversRequest()),
        ("/list_observers", ListObserversRequest()),
        ("/unload_observer", UnloadObserverRequest(name)),
    ]


# -- manipulator and launcher ------------------------------------------------------------------------------------------


@cache
def _options() -> Any:
    from rosgraph_manipulator.configuration.configurations import (
        Configuration,
        FunctionOptions,
        ManipulatorOptions,
        Repair,
    )

    configurations = {name: Configuration(name, "f_talk", "/talk.launch") for name in ("fast", "frugal")}
    driver = Configuration("gripper", "gripper", "/gripper.launch")
    return ManipulatorOptions(
        configurations,
        {"f_talk": FunctionOptions(save_action="talk")},
        repairs={"talker": Repair("talker", "talker/reset"), "gripper": Repair("gripper", driver=driver)},
    )


def _manipulator(_ros: Ros) -> Callable[[], object]:
    from node_kit.io.inbox import Inbox
    from rosgraph_manipulator.change.deployment import Outcome, Result
    from rosgraph_manipulator.change.request_queue import Policy
    from rosgraph_manipulator.ros.repairs import RepairServer
    from rosgraph_manipulator.ros.requests import RequestServer

    options, inbox = _options(), Inbox()

    def carry_out(order: Any) -> Outcome:
        requests.check()
        return Outcome(Result.OK, options.configurations.get(order.configuration), "")

    requests = RequestServer(options, Policy.REPLACE, inbox, carry_out, lambda _: None)
    repairs = RepairServer(options, inbox, SimpleNamespace(report=lambda _: None, is_unconnected=bool), 1.0)
    requests.start()
    repairs.start()

    def settle() -> None:
        inbox.drain()
        repairs.look()

    return settle


def _manipulator_good() -> Good:
    asked, change, repair = "/rosgraph_manipulator_action_server", "/rosgraph_manipulator/change_function", \
        "/rosgraph_manipulator/repair"  # fmt: skip
    return [
        (f"{asked}/goal", _wanted("fast")),
        (f"{change}/goal", _asked_for(ChangeFunctionActionGoal, "c-2", ChangeFunctionGoal("f_talk", "frugal", ["a"]))),
        (f"{repair}/goal", _repaired("talker")),
        (f"{asked}/cancel", GoalID(STAMP, "c-1")),
        (f"{change}/cancel", GoalID(STAMP, "c-2")),
        (f"{repair}/cancel", GoalID(STAMP, "r-1")),
    ]


def _wanted(name: str) -> Any:
    asked = _asked_for(MvpReconfigurationActionGoal, "c-1")
    asked.goal.desired_configuration_name = name
    return asked


def _repaired(component: str) -> Any:
    asked = _asked_for(RepairActionGoal, "r-1")
    asked.goal.component = component
    return asked


def _relay(_ros: Ros) -> Callable[[], object]:
    from move_base_msgs.msg import MoveBaseAction
    from rosgraph_manipulator.ros import relay

    node = relay.Relay("/relayed", "/move_base", MoveBaseAction)
    node._waits = SimpleNamespace(of=lambda _: None, why_gone=lambda *_: "")

    def settle() -> None:
        node._inbox.drain()
        with patch.object(relay, "is_connected", lambda _: True):
            node._send_goals()

    return settle


def _launcher(_ros: Ros) -> None:
    """Have the launcher's services, without the processes behind them; whatever is asked is signed."""
    from rosgraph_launcher.ros import launcher

    _launcher_services(partial(patch.object, launcher, "check_signature", lambda *_: None))


def _signatures(_ros: Ros) -> None:
    """Have the same services, with a secret."""
    from rosgraph_launcher.io import secret

    _launcher_services(partial(patch.object, secret, "read_secret", lambda: _SECRET))


_SECRET = b"secret"


def _launcher_services(meanwhile: Callable[[], Any]) -> None:
    from node_kit.io.inbox import Inbox
    from rosgraph_launcher.ros import launcher

    node = object.__new__(launcher.LauncherNode)
    node._inbox = Inbox()
    node._launcher = SimpleNamespace(
        is_up=lambda name: name == "/a", conflict=lambda _: "", expect=len, changes=1, change=lambda *_: {"start": 0.1}
    )

    def answer(callback: Callable[[Any], Any], request: Any) -> Any:
        with meanwhile():
            return callback(request)

    rospy.Service("~change", launcher.ChangeNodes, partial(answer, node._on_change))
    rospy.Service("~check", launcher.CheckNodes, node._on_check)
    rospy.Service("~usage", launcher.ReadUsage, node._on_usage)
    rospy.Service("~stand_by", launcher.StandBy, partial(answer, node._on_stand_by))


def _launcher_good() -> Good:
    import os

    node = NodeDescription(name="/a", package="p", executable="e", remaps=["a:=b"], environment=["A=b"])
    return [
        (f"{NAME}/change", ChangeNodesRequest("f", "fast", [node], ["/b"], ["/a"], "signed")),
        (f"{NAME}/check", CheckNodesRequest(["/a", "/b"])),
        (f"{NAME}/usage", ReadUsageRequest([os.getpid()], [])),
        (f"{NAME}/stand_by", StandByRequest([node], "signed")),
    ]


def _signatures_good() -> Good:
    from rosgraph_launcher.io import secret

    asked = [one for one in _launcher_good() if hasattr(one[1], "signature")]
    with patch.object(secret, "read_secret", lambda: _SECRET):
        for _, request in asked:
            secret.sign(request, NAME)
    return asked


# -- the robot ---------------------------------------------------------------------------------------------------------


def _move_base(_ros: Ros) -> Callable[[], object]:
    node, settle = made_move_base()
    node._offer_the_rest()
    rospy.Subscriber("/scan", LaserScan, lambda _: settle())  # it has costmaps from then on
    return settle


def _move_base_asked() -> Good:
    node = Config(
        bools=[BoolParameter("make_plan_clear_costmap", True)],
        ints=[IntParameter("max_planning_retries", 2)],
        strs=[StrParameter("base_global_planner", "navfn/NavfnROS")],
        doubles=[DoubleParameter("controller_frequency", 4.0)],
        groups=[GroupState("Default", True, 0, 0)],
    )
    layer = Config(bools=[BoolParameter("enabled", True)], doubles=[DoubleParameter("max_obstacle_height", 1.5)])
    plan = GetPlanRequest(pose("map"), pose("map"), 0.5)
    plan.goal.pose.position.x = 2.0
    asked = [
        (f"{NAME}/make_plan", plan),
        (f"{NAME}/set_parameters", ReconfigureRequest(node)),
        (f"{NAME}/local_costmap/obstacles/set_parameters", ReconfigureRequest(layer)),
        (f"{NAME}/clear_costmaps", EmptyRequest()),
        (f"{NAME}/make_plan", plan),
    ]
    return [*(one for one in move_base_good() if one[0] in ("/tf", "/map", "/odom", "/scan")), *asked]


def _simulators(_ros: Ros) -> Callable[[], object]:
    robot, cell, settle = made_simulators()
    robot._output = SimpleNamespace(tell_light=lambda: None)
    cell._obstacles, cell._light = {}, SimpleNamespace(publish=lambda _: None)
    for node in (robot, cell):
        rospy.Service("~spawn_obstacle", SpawnObstacle, node._on_spawn)
        rospy.Service("~delete_obstacle", DeleteObstacle, node._on_delete)
        rospy.Service("~set_light", SetLight, node._on_set_light)

    def clear() -> None:
        settle()
        for node in (robot, cell):  # they are the same for all inputs
            node._on_delete(DeleteObstacleRequest(""))
            node._on_set_light(SetLightRequest(1.0))

    return clear


def _simulators_good() -> Good:
    box = SpawnObstacleRequest(name="box", x=3.0, y=2.0, yaw=0.1, length=0.3, width=0.3, height=0.9, mass=2.0)
    walker = SpawnObstacleRequest(name="walker", waypoints=[Point(3.0, 3.0, 0.0), Point(4.0, 3.0, 0.0)], speed=0.5)
    return [
        (f"{NAME}/spawn_obstacle", box),
        (f"{NAME}/spawn_obstacle", walker),
        (f"{NAME}/set_light", SetLightRequest(0.5)),
        (f"{NAME}/delete_obstacle", DeleteObstacleRequest("box")),
    ]


def _meter(_ros: Ros) -> None:
    from metacontrol_experiments.ros.fault_injection import serve
    from metacontrol_sim.ros.battery_load_control import BatteryLoadControlNode

    BatteryLoadControlNode()
    serve(lambda _: None, 1)


def _cameras(_ros: Ros) -> None:
    from metacontrol_manipulation.ros.tag_localizer import TagLocalizer
    from pybullet_simulator.ros.colour_camera import ColourCameraNode

    ColourCameraNode()
    TagLocalizer()


def _cameras_asked() -> Good:
    light = Config(doubles=[DoubleParameter("exposure", 0.004), DoubleParameter("gain", 2.0)])
    return [(f"{NAME}/set_parameters", ReconfigureRequest(light))] * 2


def _builder(_ros: Ros) -> None:
    from metacontrol_manipulation.msg import BuildPyramidAction
    from metacontrol_manipulation.ros.action_server import SimpleServer

    SimpleServer("build", BuildPyramidAction, None)


SERVERS: tuple[Listener, ...] = (
    Listener(
        "what the reasoner is asked",
        ("mros1_reasoner/ros/services.py", "mros1_reasoner/ros/objectives.py", "mros1_reasoner/ros/decisions.py"),
        reasoner, _reasoner_good, share=0.5,
    ),
    Listener(
        "a knowledge base that is saved", ("mros1_reasoner/ros/services.py",), reasoner,
        lambda: [(f"{NAME}/save_knowledge_base", SaveKnowledgeBaseRequest("saved.owl"))], share=0.05,
    ),
    Listener("the host of observers", ("rosgraph_monitor/ros/observers.py",), _observer_host, _observer_host_good,
             share=0.05),
    Listener(
        "what the manipulator is asked", ("rosgraph_manipulator/ros/requests.py", "rosgraph_manipulator/ros/repairs.py",
                                          "rosgraph_manipulator/ros/action_server.py"),
        _manipulator, _manipulator_good,
    ),
    Listener(
        "a relay of goals", ("rosgraph_manipulator/ros/relay.py",), _relay,
        lambda: [("/relayed/goal", goal()), ("/rosgraph_manipulator/active_configuration", configuration()),
                 ("/relayed/cancel", GoalID(STAMP, "a-1"))],
    ),
    Listener("what a launcher is asked", ("rosgraph_launcher/ros/launcher.py",), _launcher, _launcher_good),
    Listener("signatures of requests", ("rosgraph_launcher/io/secret.py",), _signatures, _signatures_good, share=0.5),
    Listener("what move_base is asked", ("move_base/ros/move_base.py", "move_base/ros/reconfigure.py"), _move_base,
             _move_base_asked, share=0.5),
    Listener(
        "what simulators are asked",
        ("pybullet_simulator/ros/simulator.py", "pybullet_simulator/ros/cell_simulator.py"),
        _simulators, _simulators_good, share=0.5,
    ),
    Listener(
        "contingencies that are asked for", ("metacontrol_experiments/ros/fault_injection.py",
                                             "metacontrol_sim/ros/battery_load_control.py"), _meter,
        lambda: [("/contingency/strike", ContingencyRequest("clutter", "", 3.0, 7)),
                 ("/contingency/strike", ContingencyRequest("kill", "front_laser", 0.0, 0)),
                 ("/increase_power_consumption", IncreaseConsumptionFactorRequest(1.5))],
        share=0.5,
    ),
    Listener(
        "settings of a camera",
        ("pybullet_simulator/ros/colour_camera.py", "metacontrol_manipulation/ros/tag_localizer.py"),
        _cameras, _cameras_asked, share=0.5,
    ),
    Listener(
        "who builds pyramids", ("metacontrol_manipulation/ros/action_server.py",), _builder,
        lambda: [("/build/goal", _asked_for(BuildPyramidActionGoal, "b-1")), ("/build/cancel", GoalID(STAMP, "b-1"))],
        share=0.5,
    ),
)  # fmt: skip
