"""ROS messages of arms and grippers. No rospy: these are plain conversions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sensor_msgs.msg import JointState

from pybullet_simulator.robot.arm_controller import JOINTS, Trajectory, TrajectoryError

if TYPE_CHECKING:
    import genpy
    from simulator_msgs.msg import ArmState
    from trajectory_msgs.msg import JointTrajectory

FINGERS = 2


def joint_names(arm: str) -> list[str]:
    """Return the names of an arm's joints: left_panda_joint1 and so on."""
    return [f"{arm}_panda_joint{number}" for number in range(1, JOINTS + 1)]


def joint_state(arm: str, state: ArmState, now: genpy.Time) -> JointState:
    """Return the state of an arm's joints, those of its fingers included."""
    message = JointState()
    message.header.stamp = now
    message.name = [*joint_names(arm), *(f"{arm}_panda_finger_joint{number}" for number in range(1, FINGERS + 1))]
    message.position = [*state.positions, *[state.gripper_width / FINGERS] * FINGERS]
    message.velocity = [*state.velocities, *[0.0] * FINGERS]
    message.effort = [*state.efforts, *[0.0] * FINGERS]
    return message


def read_trajectory(message: JointTrajectory, arm: str) -> Trajectory:
    """Return a trajectory, its joints in the arm's order.

    Raises:
        TrajectoryError: it is not one of this arm's joints, or can't be followed.
    """
    names = joint_names(arm)
    if sorted(message.joint_names) != sorted(names):
        raise TrajectoryError(
            f"its joints are {', '.join(message.joint_names) or 'none'}; this arm has {names[0]} to {JOINTS}"
        )
    order = [message.joint_names.index(name) for name in names]

    def ordered(values: list[float]) -> tuple[float, ...]:
        if len(values) != JOINTS:
            raise TrajectoryError(f"each point needs {JOINTS} positions and velocities")
        return tuple(values[index] for index in order)

    return Trajectory(
        tuple(point.time_from_start.to_sec() for point in message.points),
        tuple(ordered(point.positions) for point in message.points),
        tuple(ordered(point.velocities) for point in message.points),
    )
