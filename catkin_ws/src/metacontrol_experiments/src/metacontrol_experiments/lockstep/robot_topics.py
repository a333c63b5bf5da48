"""The simulated robot's topics for observers: those of the simulator's node, at the same rates as on ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from pybullet_simulator.messages.state import (
    BASE,
    ODOM,
    OdometryWriter,
    battery_state,
    illuminance,
    localised_pose,
    stamp,
)
from pybullet_simulator.physics.simulation import ENERGY_STEPS, LIGHT_STEPS, LOCALISATION_STEPS, MOTION_STEPS
from robot_formulas.geometry import quaternion_of
from sensor_msgs.msg import BatteryState, Illuminance
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

    import genpy
    from pybullet_simulator.physics.simulation import Simulation
    from pybullet_simulator.robot.robot import Robot

STATIC_FRAMES = "tf_static"


@dataclass(frozen=True)
class Topic:
    """One topic.

    Attributes:
        message_class: of its messages.
        steps: simulation steps between two messages.
        message: makes one.
    """

    message_class: type
    steps: int
    message: Callable[[Simulation, genpy.Time], Any]


def _filtered(simulation: Simulation, now: genpy.Time) -> Odometry:
    odometry = simulation.odometry
    velocity = (*odometry.velocity[:2], odometry.turn_rate)
    return OdometryWriter(ODOM, simulation.settings.errors.slip).write(now, odometry.filtered, velocity)


def _localised(simulation: Simulation, now: genpy.Time) -> PoseWithCovarianceStamped:
    return localised_pose(simulation.localised, simulation.settings.errors.localisation, now)


TOPICS: dict[str, Topic] = {
    "odometry/filtered": Topic(Odometry, MOTION_STEPS, _filtered),
    "amcl_pose": Topic(PoseWithCovarianceStamped, LOCALISATION_STEPS, _localised),
    "battery_state": Topic(BatteryState, ENERGY_STEPS, battery_state),
    "illuminance": Topic(Illuminance, LIGHT_STEPS, lambda simulation, now: illuminance(simulation.illuminance, now)),
    "power_load": Topic(Float32, ENERGY_STEPS, lambda simulation, _now: Float32(simulation.load)),
}
"""The topics with a rate, by name without a leading slash. Frames that never move are told once (`static_frames`)."""
MESSAGE_STEPS = math.gcd(*(topic.steps for topic in TOPICS.values()))
"""No topic has a message in a step that this does not divide."""


def due_messages(simulation: Simulation, step: int, wanted: Collection[str]) -> Iterator[tuple[str, Any]]:
    """Yield those of the wanted topics that are published in this step, each with its message."""
    for name, topic in TOPICS.items():
        if step % topic.steps == 0 and name in wanted:
            yield name, topic.message(simulation, stamp(simulation.time_ns))


def stamp_at(now: float) -> genpy.Time:
    """Return a time in s for messages."""
    return stamp(round(now * 1e9))


def static_frames(robot: Robot) -> TFMessage:
    """Return the frames of the robot's sensors, as robot_state_publisher tells them."""
    transforms = []
    for mount in (robot.front_laser.mount, robot.rear_laser.mount, robot.camera.mount):
        transform = TransformStamped(child_frame_id=mount.frame)
        transform.header.frame_id = BASE
        place, turn = transform.transform.translation, transform.transform.rotation
        place.x, place.y, place.z = mount.x, mount.y, mount.z
        turn.z, turn.w = quaternion_of(mount.yaw)
        transforms.append(transform)
    return TFMessage(transforms)
