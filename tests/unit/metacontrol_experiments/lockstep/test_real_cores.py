"""Lockstep runs the cores of the real nodes, here on a system unlike D2: other names, a namespace, other observers."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticStatus
from metacontrol_experiments.lockstep.metacontroller import Cores, Metacontroller
from metacontrol_experiments.lockstep.observation import Observers
from metacontrol_experiments.lockstep.reconfiguration import navigation_parameters, plan_change, restarts
from metacontrol_experiments.lockstep.system import LockstepError, System, private_parameters
from metacontrol_experiments.managers.manager import Manager
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.physics.simulation import Settings as SimulationSettings
from pybullet_simulator.physics.simulation import Simulation
from robot_formulas.geometry import Pose
from ros_model.errors import ModelError
from ros_model.language.metamodel import RosSystem
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_manipulator.change.tactics import load_tactics
from rosgraph_manipulator.configuration.configurations import Configuration
from rosgraph_monitor.observer import Observer, ServiceObserver, TopicObserver
from rosgraph_monitor.observers.localization import LocalizationQualityObserver
from std_msgs.msg import Bool, Float32

PACKAGE = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim"
NODE = "/carrier/driver"


def flat(tree, prefix=""):
    """Parameters by full name, as the launch file's reader returns them."""
    found = {}
    for key, value in tree.items():
        found |= flat(value, f"{prefix}{key}/") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return found


def starting(name=NODE, executable="move_base", **parameters):
    """A configuration that starts one node."""
    node = NodeDescription(
        name, "/carrier/", "move_base", executable, parameters={k.replace("__", "/"): v for k, v in parameters.items()}
    )
    return SystemDescription({name: node})


@pytest.fixture
def system():
    shared = yaml.safe_load((PACKAGE / "config/move_base.yaml").read_text())
    sources = "local_costmap__obstacles_layer__observation_sources"
    described = {
        "slow": starting(TrajectoryPlannerROS__max_vel_x=0.3),
        "fast": starting(TrajectoryPlannerROS__max_vel_x=0.6),
        "dark": starting(TrajectoryPlannerROS__max_vel_x=0.3, **{sources: "point_cloud"}),
        "light": starting(TrajectoryPlannerROS__max_vel_x=0.3, **{sources: "scan"}),
        "reckless": starting(TrajectoryPlannerROS__max_vel_x=30.0),
        "arm": starting("/carrier/arm", "arm_controller"),
    }
    return System(
        SystemDescription(parameters=flat(shared, f"{NODE}/")),
        {name: Configuration(name, "f_carry", f"{name}.launch") for name in described},
        RosSystem("carrier"),
        described.__getitem__,
        RosSystem,
    )


def test_parameters_that_navigation_takes_restart_nothing(system):
    plan = plan_change(system, "slow", "fast", load_tactics())
    assert plan.tactic == "parameters" and not restarts(plan)


@pytest.mark.parametrize(("running", "wanted"), [("light", "dark"), ("slow", "reckless")])
def test_what_no_server_takes_restarts_the_node(system, running, wanted):
    plan = plan_change(system, running, wanted, load_tactics())
    assert restarts(plan) and plan.started == (NODE,)


def test_tactic_of_another_package_decides_too(system):
    tactics = load_tactics()
    only_replace = {"replace": tactics["replace"]}
    assert restarts(plan_change(system, "slow", "fast", only_replace))


def test_configuration_overrides_what_all_share(system):
    parameters = navigation_parameters(system, "fast")
    assert parameters.controller.max_vel_x == 0.6
    assert parameters.controller.vtheta_samples == 20


def test_node_that_lockstep_cannot_run_is_named(system):
    with pytest.raises(LockstepError, match=r"arm starts /carrier/arm \(move_base/arm_controller\).*--engine ros"):
        plan_change(system, "slow", "arm", load_tactics())


def test_node_that_the_launch_file_lacks_is_named(system):
    with pytest.raises(LockstepError, match="0 nodes mros1_reasoner/reasoner"):
        private_parameters(system.launched, "mros1_reasoner", "reasoner")


class Door(TopicObserver):
    """Listens to what no simulated robot has."""

    def __init__(self, name, topics=(("door/open", Bool),)):
        super().__init__(name, 1.0, topics)


class Failing(Observer):
    def generate_diagnostics(self, now):
        raise ZeroDivisionError("nothing to divide")


class Asking(ServiceObserver):
    def __init__(self, name):
        super().__init__(name, "ask", Bool)


@pytest.mark.parametrize(
    ("observer", "said"),
    [
        (Door("Door"), r"Door listens to door/open \(Bool\).*amcl_pose"),
        (Door("Door", [("power_load", Bool)]), r"power_load \(Bool\).*power_load \(Float32\)"),
        (Asking("Asking"), "calls a service"),
    ],
)
def test_observer_that_cannot_be_fed_is_refused(observer, said):
    with pytest.raises(LockstepError, match=said):
        Observers([observer], {})


def test_observer_that_fails_ends_the_mission_with_its_name():
    with pytest.raises(LockstepError, match=r"Failing fails at 1\.00 s: ZeroDivisionError"):
        list(Observers([Failing("Failing")], {}).evaluate(100, 1.0))


def test_observer_is_evaluated_at_its_rate_on_the_topics_that_it_names():
    world = read_world(PACKAGE / "worlds/factory.yaml")
    observer = LocalizationQualityObserver()
    observers = Observers([observer], {})
    simulation = Simulation(world, SimulationSettings(Pose(-8.0, -8.0, 0.78)))
    evaluated = {}
    try:
        for step in range(1, 201):
            simulation.step()
            observers.listen(simulation, step, simulation.time)
            for statuses in observers.evaluate(step, simulation.time):
                evaluated[step] = statuses
    finally:
        simulation.close()
    assert list(evaluated) == [50, 100, 150, 200]
    assert {status.values[0].key for statuses in evaluated.values() for status in statuses} == {"localization"}
    assert all(status.level == DiagnosticStatus.OK for statuses in evaluated.values() for status in statuses)


def test_sensor_of_the_model_feeds_observers():
    heard = Door("Door", [("carrier/range", Float32)])
    observers = Observers([heard], {"carrier/range": Float32})
    observers.receive("carrier/range", Float32(2.5), 1.0)
    assert heard.latest("carrier/range", 1.0).data == 2.5


class Noting(Manager):
    """Notes what it is told."""

    observes = True

    def __init__(self):
        self.facts = []

    def take(self, now, fact):
        self.facts.append(fact)


def cores(manager, *components):
    return Cores(manager, Observers([], {}), DiagnosticsReader([], components), 2.0, {})


def test_function_is_that_of_the_configuration(system):
    manager = Noting()
    Metacontroller(system, cores(manager), None, "slow", seed=1)
    assert manager.facts == [ActiveFact("f_carry", "slow", "STABLE")]


def test_system_without_model_of_the_variant_is_refused(system):
    def missing(name):
        raise ModelError(f"no {name}.rossystem")

    with pytest.raises(LockstepError, match=r"no slow\.rossystem"):
        Metacontroller(replace(system, variant=missing), cores(Noting()), None, "slow", seed=1)


def test_manager_that_observes_nothing_is_told_nothing(system):
    metacontroller = Metacontroller(system, cores(Manager(), "gripper"), None, "slow", seed=1)
    metacontroller.component_changed(1.0, "gripper", works=False)
    assert metacontroller.step(1.1, 1) == [] and metacontroller.components == []


class NoDelays:
    """Everything is at once."""

    def draw(self, kind, rng):
        return 0.0


def test_component_that_the_reasoner_does_not_model_is_seen_but_left_out(system):
    manager = Noting()
    metacontroller = Metacontroller(system, cores(manager, "gripper"), NoDelays(), "slow", seed=1)
    for component in ("gripper", "wheel"):
        metacontroller.component_changed(1.0, component, works=False)
    assert metacontroller.step(1.1, 1) == []
    assert [report.component for report in metacontroller.components] == ["gripper", "wheel"]
    assert manager.facts[1:] == [ComponentFact("gripper", "FALSE")]
