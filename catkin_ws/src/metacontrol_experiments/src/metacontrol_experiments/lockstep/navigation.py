"""Navigation's node in lockstep: the navigator, which is started, stopped and reconfigured as its process on ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from move_base.costmap.sensors import cloud_observation, scan_observation
from move_base.costmap.static_map import StaticMap
from move_base.navigation.navigator import Navigator
from pybullet_simulator.messages.grid import occupancy_grid
from pybullet_simulator.messages.state import stamp
from pybullet_simulator.physics.simulation import STEP
from robot_formulas.geometry import Velocity

if TYPE_CHECKING:
    from move_base.navigation.result import Result
    from move_base.parameters.parameters import MoveBaseParameters
    from pybullet_simulator.robot.motion_sensors import Odometry
    from pybullet_simulator.world.grid import Grid
    from robot_formulas.geometry import Pose

    from metacontrol_experiments.lockstep.frames import Frames

_MAP_FRAME = "map"


class Navigation:
    """The navigator while the node runs, and its control rate.

    Attributes:
        parameters: those in force; a stopped node starts with them.
    """

    def __init__(self, parameters: MoveBaseParameters, grid: Grid) -> None:
        """Start the node, without a goal.

        Args:
            parameters: of the initial configuration.
            grid: the map, which it receives at each start.
        """
        self.parameters = parameters
        self._map = _static_map(grid)
        self._navigator: Navigator | None = None
        self._next_tick = 0.0
        self._start()

    @property
    def topics(self) -> set[str]:
        """Topics of the sensors that it listens to, without a leading slash."""
        return {source.topic.strip("/") for source in self._navigator.sources} if self._navigator else set()

    def stop(self) -> None:
        """Stop the node: its goal and its costmaps are gone."""
        self._navigator = None

    def deploy(self, parameters: MoveBaseParameters, goal: Pose, now: float) -> None:
        """Let parameters take effect: a stopped node starts and takes the goal over, a running one is reconfigured."""
        self.parameters = parameters
        if self._navigator is None:
            self._start()
            self.set_goal(goal, now)
        else:
            self._navigator.reconfigure(parameters)

    def set_goal(self, goal: Pose, now: float) -> None:
        """Drive to a goal, a pose in the map frame, from now on."""
        if self._navigator is not None:
            self._navigator.set_goal(goal, now)

    def receive(self, topic: str, message: Any, now: float) -> None:
        """Take a sensor's message, if the node runs and listens to its topic."""
        for source in self._navigator.sources if self._navigator else ():
            if self._navigator is not None and source.topic.strip("/") == topic:
                convert = scan_observation if source.data_type == "LaserScan" else cloud_observation
                self._navigator.observe(convert(message, source), now)
                return

    def step(self, now: float, frames: Frames, odometry: Odometry) -> Result | None:
        """Return what the navigator decides; None between two periods of control, or while the node is stopped."""
        if now < self._next_tick - 1e-9:
            return None
        self._next_tick = max(self._next_tick, now - STEP) + 1.0 / self.parameters.controller_frequency
        if self._navigator is None:
            return None
        velocity = Velocity(*odometry.velocity[:2], odometry.turn_rate)
        return self._navigator.step(now, frames, velocity)

    def _start(self) -> None:
        self._navigator = Navigator(self.parameters)
        self._navigator.set_map(self._map)


def _static_map(grid: Grid) -> StaticMap:
    """Return the map as navigation receives it on its topic."""
    message = occupancy_grid(grid, stamp(0))
    info = message.info
    origin = (grid.origin_x, grid.origin_y, grid.origin_yaw)
    return StaticMap.create(message.data, info.width, info.height, info.resolution, origin, _MAP_FRAME)
