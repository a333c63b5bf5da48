"""Messages of arms are read whatever the order of their joints, and refused where they are another arm's."""

import genpy
import pytest
from pybullet_simulator.messages.arms import joint_names, joint_state, read_trajectory
from pybullet_simulator.robot.arm_controller import TrajectoryError
from simulator_msgs.msg import ArmState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint


def point(values, seconds, velocities=None):
    return JointTrajectoryPoint(
        positions=values, velocities=velocities or [0.0] * 7, time_from_start=genpy.Duration.from_sec(seconds)
    )


def test_joints_are_put_into_the_arms_order():
    names = joint_names("right")
    order = [3, 1, 0, 2, 6, 5, 4]
    message = JointTrajectory(
        joint_names=[names[i] for i in order],
        points=[point([float(i) for i in order], 0.0), point([i + 0.5 for i in order], 2.0)],
    )
    trajectory = read_trajectory(message, "right")
    assert trajectory.positions[0] == tuple(float(i) for i in range(7))
    assert trajectory.positions[1] == tuple(i + 0.5 for i in range(7))
    assert trajectory.duration == 2.0


@pytest.mark.parametrize(
    ("names", "points", "problem"),
    [
        (joint_names("left"), [point([0.0] * 7, 0.0)], "this arm has right_panda_joint1"),
        (joint_names("right")[:6], [point([0.0] * 6, 0.0)], "this arm has"),
        ([], [], "none"),
        (joint_names("right"), [], "there must be points"),
        (joint_names("right"), [point([0.0] * 6, 0.0)], "7 positions"),
        (joint_names("right"), [point([0.0] * 7, 0.0, [0.0])], "7 positions"),
        (joint_names("right"), [point([float("inf")] * 7, 0.0)], "not finite"),
    ],
)
def test_what_is_no_trajectory_of_the_arm_is_refused(names, points, problem):
    with pytest.raises(TrajectoryError, match=problem):
        read_trajectory(JointTrajectory(joint_names=names, points=points), "right")


def test_state_has_the_fingers_too():
    state = ArmState(positions=[0.1] * 7, velocities=[0.2] * 7, efforts=[0.3] * 7, gripper_width=0.05)
    message = joint_state("left", state, genpy.Time(3))
    assert message.name[0] == "left_panda_joint1"
    assert len(message.name) == len(message.position) == len(message.velocity) == len(message.effort) == 9
    assert sum(message.position[7:]) == pytest.approx(0.05)
    assert message.header.stamp == genpy.Time(3)
