"""Setting up a mission in lockstep: launch file, models and world are read, and the reasoner's process is started."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.loop.diagnostics import DiagnosticsReader
from node_kit.parameters import ParameterError
from node_kit.plugins import PluginError
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.physics.simulation import Settings as SimulationSettings
from pybullet_simulator.physics.simulation import Simulation, SimulationError
from pybullet_simulator.robot.motion_sensors import REAL
from pybullet_simulator.world.world import WorldError, rasterise
from ros_model.errors import ModelError
from ros_model.io.files import resolve
from ros_model.io.models import read_system
from rosgraph_manipulator.change.tactics import load_tactics
from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.io.configuration_file import options_from
from rosgraph_manipulator.io.launch_files import LaunchFileError, read_launch_file
from rosgraph_monitor.observers import plugins

from metacontrol_experiments.io.input_files import PackageError, simulation_package
from metacontrol_experiments.io.tables import read_delays
from metacontrol_experiments.lockstep.delays import DelayError
from metacontrol_experiments.lockstep.drivers import Drivers
from metacontrol_experiments.lockstep.lockstep import Lockstep, Robot
from metacontrol_experiments.lockstep.metacontroller import Cores, Metacontroller
from metacontrol_experiments.lockstep.observation import Observers
from metacontrol_experiments.lockstep.reconfiguration import plan_change, restarts
from metacontrol_experiments.lockstep.system import LockstepError, System, private_parameters
from metacontrol_experiments.managers.d2_rules import RuleError
from metacontrol_experiments.managers.manager import ManagerError, Situation, make_manager

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Sequence
    from pathlib import Path

    from ros_model.language.metamodel import RosSystem
    from rosgraph_launcher.description import SystemDescription
    from rosgraph_monitor.observer import Observer

    from metacontrol_experiments.mission.settings import Settings

_Read = TypeVar("_Read")

_MONITOR = ("rosgraph_monitor", "monitor")
_REASONER = ("mros1_reasoner", "reasoner")
_MANIPULATOR = ("rosgraph_manipulator", "rosgraph_manipulator")
"""Package and executable of the nodes whose parameters are used."""

_UNUSABLE = (
    ConfigurationError,
    DelayError,
    KnowledgeBaseError,
    LaunchFileError,
    ManagerError,
    ModelError,
    PackageError,
    ParameterError,
    PluginError,
    ReasonerError,
    RuleError,
    SimulationError,
    WorldError,
)


class Library:
    """What the missions of one process have in common: it is read for the first of them."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._read: dict[Hashable, Any] = {}

    def once(self, key: Hashable, read: Callable[[], _Read]) -> _Read:
        """Return what was read under a key; nobody may change it."""
        if key not in self._read:
            self._read[key] = read()
        made: _Read = self._read[key]
        return made


def set_up(settings: Settings, library: Library | None = None) -> Lockstep:
    """Return a mission, ready to run; its end also ends the processes that were started for it.

    Args:
        settings: the mission.
        library: of the missions of this process; without it, all is read anew.

    Raises:
        LockstepError: something is not there in lockstep, or cannot be used; the message names it.
    """
    library = library or Library()
    with ExitStack() as failing:
        try:
            system = describe_system(settings.launch_package, settings.launch_file, settings.launch_arguments, library)
            robot = _robot(settings, system.base, library)
            failing.callback(robot.simulation.close)
            cores = _cores(settings, system.launched, robot.drivers, library)
            failing.callback(cores.manager.close)
            delays = library.once("delays", read_delays)
            metacontroller = Metacontroller(system, cores, delays, settings.initial_configuration, settings.seed)
            lockstep = Lockstep(settings, robot, system, metacontroller)
        except _UNUSABLE as error:
            raise LockstepError(str(error)) from error
        failing.pop_all()
    return lockstep


def describe_system(
    package: str, launch_file: str, arguments: Sequence[str] = (), library: Library | None = None
) -> System:
    """Return what the launch file of a whole system and the models that it names say.

    Args:
        package: has the file in its folder launch.
        launch_file: name of the file.
        arguments: of the file, each NAME:=VALUE.
        library: of the missions of this process; without it, all is read anew.

    Raises:
        LockstepError: a file cannot be used.
    """
    library = library or Library()
    try:
        launched = read_launch_file(resolve(f"package://{package}/launch/{launch_file}"), arguments).system
        manipulator = options_from(private_parameters(launched, *_MANIPULATOR))
        monitor = private_parameters(launched, *_MONITOR)
        base = _read_system(resolve(monitor["desired_rossystem"]), library)
        models = resolve(monitor["variants"])
    except KeyError as error:
        raise LockstepError(f"{'/'.join(_MONITOR)} has no parameter {error}: generate its configuration") from error
    except _UNUSABLE as error:
        raise LockstepError(str(error)) from error

    def describe(configuration: str) -> SystemDescription:
        known = manipulator.configurations.get(configuration)
        if known is None:
            raise LockstepError(
                f"no configuration {configuration!r}; there are {', '.join(manipulator.configurations)}"
            )
        try:
            key = ("configuration", known.launch_file, tuple(known.args))
            return library.once(key, lambda: read_launch_file(known.launch_file, known.args).system)
        except LaunchFileError as error:
            raise LockstepError(str(error)) from error

    return System(
        launched,
        manipulator.configurations,
        base,
        describe,
        lambda configuration: _read_system(models / f"{configuration}.rossystem", library),
    )


def _read_system(path: Path, library: Library) -> RosSystem:
    return library.once(("model", path), lambda: read_system(path))


def restarts_between(package: str, launch_file: str) -> Callable[[str, str], bool]:
    """Return a function that tells whether a change between two configurations of a system restarts nodes.

    Raises:
        LockstepError: a file cannot be used.
    """
    system = describe_system(package, launch_file)
    try:
        tactics = load_tactics()
    except PluginError as error:
        raise LockstepError(str(error)) from error
    return cache(lambda running, wanted: restarts(plan_change(system, running, wanted, tactics)))


def _robot(settings: Settings, base: RosSystem, library: Library) -> Robot:
    """Return the robot at the start of the route."""
    path = settings.world or simulation_package() / "worlds" / "factory.yaml"
    world = library.once(("world", path), lambda: read_world(path))
    grid = library.once(("map", path), lambda: rasterise(world))
    simulation = Simulation(world, SimulationSettings(settings.route.start, settings.seed, REAL))
    return Robot(simulation, grid, Drivers(simulation, base, settings.seed))


def _cores(settings: Settings, launched: SystemDescription, drivers: Drivers, library: Library) -> Cores:
    """Return the manager, and the deciding parts of the nodes beside it, with the parameters of these nodes."""
    situation = Situation(settings.initial_configuration, settings.seed)
    observers, parameters = Observers([], {}), Parameters({})
    reader, tactics = DiagnosticsReader([], []), {}
    if settings.metacontrol:
        values = private_parameters(launched, *_REASONER)
        parameters = Parameters(values)
        files = tuple(repr(values.get(name)) for name in ("model_file", "tomasys_file", "qa_direction", "spares"))
        knowledge = library.once(("knowledge", files), parameters.knowledge_base)
        if settings.initial_configuration not in knowledge.designs:
            raise ParameterError(f"{settings.initial_configuration} needs a spare, and the mission goes without spares")
        objectives = parameters.objectives(knowledge)
        situation = replace(situation, knowledge=knowledge, objectives=objectives, parameters=values)
        observers = Observers(_observers(private_parameters(launched, *_MONITOR), library), drivers.topics)
        reader = DiagnosticsReader(
            {*knowledge.qualities, *knowledge.environment}, knowledge.components, parameters.nodes
        )
        tactics = library.once("tactics", load_tactics)
    manager = make_manager(settings.manager, situation, *_UNUSABLE)
    if not manager.observes:
        observers = Observers([], {})
    return Cores(manager, observers, reader, parameters.period, tactics)


def _observers(monitor: dict[str, Any], library: Library) -> list[Observer]:
    """Return the observers that the monitor's parameters name, made and configured as its node does."""
    exported = library.once("observers", plugins.exported)
    made = []
    for name in monitor.get("observers", []):
        observer = plugins.make(name, exported)
        try:
            observer.configure(monitor.get(observer.name, {}))
        except ValueError as error:
            raise LockstepError(str(error)) from error
        made.append(observer)
    return made
