"""Let contingencies happen in a running system, by signals to nodes and services of simulator and power meter."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING, Any, NamedTuple

import psutil
import rospy
from metacontrol_sim.srv import (
    Contingency as ContingencyService,
)
from metacontrol_sim.srv import (
    ContingencyRequest,
    ContingencyResponse,
    IncreaseConsumptionFactor,
)
from nav_msgs.msg import OccupancyGrid
from node_kit.io.xml_rpc import CallError
from node_kit.ros.services import call
from pybullet_simulator.io.fault_signals import SIGNALS
from pybullet_simulator.messages.grid import GridMessageError, read_grid
from pybullet_simulator.robot.faults import Fault
from pybullet_simulator.ros.device import UNPLUGGED
from pybullet_simulator.world.clutter import ClutterError, scatter
from robot_formulas.geometry import Pose
from simulator_msgs.srv import SetLight, SpawnObstacle

from metacontrol_experiments.contingency.contingency import AT_START, InjectionError, Kind
from metacontrol_experiments.contingency.parsing import ComponentError, ContingencyError, make, node_of
from metacontrol_experiments.io.node_processes import NodeProcessError, pid_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from metacontrol_experiments.contingency.contingency import Contingency

SERVICE = "contingency/strike"
_SPAWN = "simulator/spawn_obstacle"
_SIGNALS = {
    Kind.KILL: signal.SIGKILL,
    Kind.STOP: signal.SIGINT,
    Kind.UNPLUG: signal.SIGKILL,
    Kind.FREEZE: signal.SIGSTOP,
    Kind.THAW: signal.SIGCONT,
    Kind.REPEAT: SIGNALS[Fault.REPEAT],
    Kind.JUMP: SIGNALS[Fault.JUMP],
}
_WAIT_S = 10.0
_CALL_S = 2.0
"""Wall seconds for the map to be there, and for a call to a node's own API."""


class Injected(NamedTuple):
    """What an event tells of a contingency that has happened."""

    stamp: rospy.Time
    """Just before it happened: the system may answer before the call that made it happen returns."""
    values: dict[str, str]
    """What is worth telling of it."""


class FaultInjector:
    """Knows which node is behind a component, and how each kind of contingency is made."""

    def __init__(self, components: Mapping[str, str], owns: Callable[[int], bool]) -> None:
        """Keep what it needs.

        Args:
            components: name -> node.
            owns: tells whether a process may be signalled.
        """
        self._components = components
        self._owns = owns
        self._frozen: dict[str, psutil.Process] = {}  # node -> its process, which no longer tells its number

    def inject(self, contingency: Contingency, way: tuple[Pose, Pose] | None) -> Injected:
        """Let a contingency happen now; return when it did, and what is worth telling of it.

        Args:
            contingency: what is to happen.
            way: where the robot starts and where it goes; clutter at random places follows from it and the seed.

        Raises:
            InjectionError: it could not.
        """
        try:
            if contingency.kind.hits_component:
                return self._signal(contingency)
            if contingency.kind is Kind.POWER:
                return _ask("increase_power_consumption", IncreaseConsumptionFactor, contingency.value, "factor")
            if contingency.kind is Kind.LIGHT:
                return _ask("simulator/set_light", SetLight, contingency.value, "light")
            if contingency.kind is Kind.CLUTTER:
                return self._clutter(contingency, way)
        except (CallError, OSError, psutil.Error, rospy.ROSException, ValueError) as error:
            raise InjectionError(f"{contingency}: {' '.join(str(error).split())}") from error
        except (rospy.ServiceException, NodeProcessError, ComponentError, ClutterError, GridMessageError) as error:
            raise InjectionError(f"{contingency}: {error}") from error
        raise InjectionError(f"{contingency}: no injector knows contingencies of kind {contingency.kind.value}")

    def _signal(self, contingency: Contingency) -> Injected:
        """Send a component's node the signal of a kind."""
        node = rospy.resolve_name(node_of(contingency.target, self._components))
        process = self._process_of(node)
        pid = process.pid
        if not self._owns(pid):
            raise InjectionError(f"{node} (pid {pid}) is not a process that the fault injector may signal")
        number = _SIGNALS[contingency.kind]
        if contingency.kind.spoils_data and not _handles(pid, number):
            raise InjectionError(f"{node} (pid {pid}) is not a driver that can simulate wrong data")
        if contingency.kind is Kind.UNPLUG:
            rospy.set_param(f"{node}/{UNPLUGGED}", True)  # whoever starts the driver again
        stamp = rospy.Time.now()
        process.send_signal(number)
        if contingency.kind is Kind.FREEZE:
            self._frozen[node] = process
        else:
            self._frozen.pop(node, None)
        return Injected(stamp, {"node": node, "pid": str(pid), "how": contingency.kind.value})

    def _process_of(self, node: str) -> psutil.Process:
        """Return the process of a node: the one that was frozen, while it lives; else the one that the node tells.

        Raises:
            CallError, NodeProcessError, psutil.Error: there is none, as far as is seen.
        """
        frozen = self._frozen.get(node)
        if frozen is not None and _lives(frozen) and self._owns(frozen.pid):
            return frozen
        return psutil.Process(pid_of(node, rospy.get_name(), _CALL_S))

    def _clutter(self, contingency: Contingency, way: tuple[Pose, Pose] | None) -> Injected:
        """Put obstacles on the floor: the listed ones, or random ones off the ends of the way."""
        places = tuple(Pose(x, y, 0.0) for x, y in contingency.places)
        if not places and contingency.count:
            if way is None:
                raise InjectionError(f"{contingency}: random places need a pose on amcl_pose; list the places instead")
            grid = read_grid(rospy.wait_for_message("map", OccupancyGrid, _WAIT_S))
            places = scatter(grid, *way, contingency.count, contingency.seed or 0)
        rospy.wait_for_service(_SPAWN, _WAIT_S)
        stamp = rospy.Time.now()
        for place in places:
            _check(_SPAWN, call(_SPAWN, SpawnObstacle, x=place.x, y=place.y, yaw=place.yaw))
        return Injected(stamp, {"places": " ".join(f"{place.x:.3f},{place.y:.3f}" for place in places)})


def _ask(service: str, kind: type, value: float, name: str) -> Injected:
    """Have a service set a value, and tell it by its name.

    Raises:
        InjectionError: the service refuses it.
        ROSException, ServiceException, OSError: it does not answer.
    """
    rospy.wait_for_service(service, _WAIT_S)
    stamp = rospy.Time.now()
    _check(service, call(service, kind, value), value)
    return Injected(stamp, {name: f"{value:g}"})


def _check(service: str, answer: Any, *asked: float) -> None:
    if not answer.success:
        raise InjectionError(f"{service} refused: {getattr(answer, 'message', '') or asked}")


def _lives(process: psutil.Process) -> bool:
    """Tell whether a process is still there, and not another one with its number."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _handles(pid: int, number: int) -> bool:
    """Tell whether a process takes a signal that would end it otherwise."""
    with open(f"/proc/{pid}/status", encoding="ascii", errors="replace") as status:
        caught = next((line.split()[1] for line in status if line.startswith("SigCgt:")), "0")
    return bool(int(caught, 16) >> (number - 1) & 1)


def serve(inject: Callable[[Contingency], None], seed: int) -> rospy.Service:
    """Offer the service `contingency/strike`, by which anybody lets a contingency happen now.

    Args:
        inject: lets it happen; called in a thread of rospy; raises InjectionError.
        seed: of random places where the request has none.
    """

    def answer(request: ContingencyRequest) -> ContingencyResponse:
        kind = request.kind
        what: object = request.target if request.target else request.value
        if kind == Kind.CLUTTER.value:
            what = {"count": request.value, "seed": request.seed or seed}
        try:
            contingency = make(kind, what, AT_START, SERVICE)
            inject(contingency)
        except (ContingencyError, InjectionError) as error:
            rospy.logwarn(f"contingency refused: {error}")
            return ContingencyResponse(False, str(error))
        return ContingencyResponse(True, contingency.event)

    return rospy.Service(SERVICE, ContingencyService, answer)
