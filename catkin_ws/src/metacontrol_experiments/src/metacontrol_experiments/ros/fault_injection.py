"""Let contingencies happen in a running system, by signals to nodes and services of simulator and power meter."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING, NamedTuple

import rosgraph
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
from node_kit.io.xml_rpc import CallError, Client
from pybullet_simulator.io.fault_signals import SIGNALS
from pybullet_simulator.messages.grid import GridMessageError, read_grid
from pybullet_simulator.robot.faults import Fault
from pybullet_simulator.ros.device import UNPLUGGED
from pybullet_simulator.world.clutter import ClutterError, scatter
from robot_formulas.geometry import Pose
from simulator_msgs.srv import SetLight, SpawnObstacle

from metacontrol_experiments.contingency.contingency import AT_START, InjectionError, Kind
from metacontrol_experiments.contingency.parsing import ComponentError, ContingencyError, make, node_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from metacontrol_experiments.contingency.contingency import Contingency

SERVICE = "contingency/strike"
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
"""Wall seconds for a service or the map to be there, and for a call to a node's own API."""


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
        self._pids: dict[str, int] = {}  # of frozen nodes, which no longer tell theirs

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
                return self._call(
                    "increase_power_consumption", IncreaseConsumptionFactor, factor=f"{contingency.value:g}"
                )(contingency.value)
            if contingency.kind is Kind.LIGHT:
                return self._call("simulator/set_light", SetLight, light=f"{contingency.value:g}")(contingency.value)
            if contingency.kind is Kind.CLUTTER:
                return self._clutter(contingency, way)
        except (CallError, OSError, rospy.ROSException, ValueError) as error:
            raise InjectionError(f"{contingency}: {' '.join(str(error).split())}") from error
        except (rospy.ServiceException, ComponentError, ClutterError, GridMessageError) as error:
            raise InjectionError(f"{contingency}: {error}") from error
        raise InjectionError(f"{contingency}: no injector knows contingencies of kind {contingency.kind.value}")

    def _signal(self, contingency: Contingency) -> Injected:
        """Send a component's node the signal of a kind."""
        node = rospy.resolve_name(node_of(contingency.target, self._components))
        pid = self._pids.get(node) or self._pid_of(node)
        if not self._owns(pid):
            raise InjectionError(f"{node} (pid {pid}) is not a process that the fault injector may signal")
        number = _SIGNALS[contingency.kind]
        if contingency.kind.spoils_data and not _handles(pid, number):
            raise InjectionError(f"{node} (pid {pid}) is not a driver that can simulate wrong data")
        if contingency.kind is Kind.UNPLUG:
            rospy.set_param(f"{node}/{UNPLUGGED}", True)  # whoever starts the driver again
        stamp = rospy.Time.now()
        os.kill(pid, number)
        if contingency.kind is Kind.FREEZE:
            self._pids[node] = pid
        else:
            self._pids.pop(node, None)
        return Injected(stamp, {"node": node, "pid": str(pid), "how": contingency.kind.value})

    def _pid_of(self, node: str) -> int:
        """Return the process of a node, as its own API tells."""
        caller = rospy.get_name()
        with Client(rosgraph.get_master_uri(), caller, _CALL_S) as master:
            uri = master.call("lookupNode", node)
        with Client(uri, caller, _CALL_S, peer=f"node {node} at") as api:
            return int(api.call("getPid"))

    def _clutter(self, contingency: Contingency, way: tuple[Pose, Pose] | None) -> Injected:
        """Put obstacles on the floor: the listed ones, or random ones off the ends of the way."""
        places = tuple(Pose(x, y, 0.0) for x, y in contingency.places)
        if not places and contingency.count:
            if way is None:
                raise InjectionError(f"{contingency}: random places need a pose on amcl_pose; list the places instead")
            grid = read_grid(rospy.wait_for_message("map", OccupancyGrid, _WAIT_S))
            places = scatter(grid, *way, contingency.count, contingency.seed or 0)
        spawn = self._call("simulator/spawn_obstacle", SpawnObstacle)
        stamp = rospy.Time.now()
        for place in places:
            spawn(x=place.x, y=place.y, yaw=place.yaw)
        return Injected(stamp, {"places": " ".join(f"{place.x:.3f},{place.y:.3f}" for place in places)})

    def _call(self, service: str, kind: type, **told: str) -> Callable[..., Injected]:
        """Return a call of a service that raises where it is refused, and returns its moment and what is told."""
        rospy.wait_for_service(service, _WAIT_S)
        proxy = rospy.ServiceProxy(service, kind)

        def call(*arguments: float, **fields: float) -> Injected:
            stamp = rospy.Time.now()
            answer = proxy(*arguments, **fields)
            if not answer.success:
                raise InjectionError(f"{service} refused: {getattr(answer, 'message', '') or arguments}")
            return Injected(stamp, told)

        return call


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
