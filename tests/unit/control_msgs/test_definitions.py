"""The definitions are those that ROS Noetic published: nodes built with the original understand ours."""

import control_msgs.msg
import pytest

# As in code that others generated from the original, such as rosserial's headers.
PUBLISHED = {
    "FollowJointTrajectoryAction": "bc4f9b743838566551c0390c65f1a248",
    "FollowJointTrajectoryActionFeedback": "d8920dc4eae9fc107e00999cce4be641",
    "FollowJointTrajectoryActionGoal": "cff5c1d533bf2f82dd0138d57f4304bb",
    "FollowJointTrajectoryActionResult": "c4fb3b000dc9da4fd99699380efcc5d9",
    "FollowJointTrajectoryFeedback": "10817c60c2486ef6b33e97dcd87f4474",
    "FollowJointTrajectoryGoal": "69636787b6ecbde4d61d711979bc7ecb",
    "FollowJointTrajectoryResult": "493383b18409bfb604b4e26c676401d2",
    "GripperCommand": "680acaff79486f017132a7f198d40f08",
    "GripperCommandAction": "950b2a6ebe831f5d4f4ceaba3d8be01e",
    "GripperCommandActionFeedback": "653dff30c045f5e6ff3feb3409f4558d",
    "GripperCommandActionGoal": "aa581f648a35ed681db2ec0bf7a82bea",
    "GripperCommandActionResult": "143702cb2df0f163c5283cedc5efc6b6",
    "GripperCommandFeedback": "e4cbff56d3562bcf113da5a5adeef91f",
    "GripperCommandGoal": "86fd82f4ddc48a4cb6856cfa69217e43",
    "GripperCommandResult": "e4cbff56d3562bcf113da5a5adeef91f",
    "JointTolerance": "f544fe9c16cf04547e135dd6063ff5be",
}


def test_nothing_is_defined_that_was_not_published():
    assert {name for name, value in vars(control_msgs.msg).items() if hasattr(value, "_md5sum")} == set(PUBLISHED)


@pytest.mark.parametrize("name", PUBLISHED)
def test_md5_sum_is_the_published_one(name):
    assert getattr(control_msgs.msg, name)._md5sum == PUBLISHED[name]


def test_constants_of_results_are_the_published_ones():
    """The md5 sum covers constants too; this says which."""
    result = control_msgs.msg.FollowJointTrajectoryResult
    assert (result.SUCCESSFUL, result.INVALID_GOAL, result.INVALID_JOINTS) == (0, -1, -2)
    assert (result.OLD_HEADER_TIMESTAMP, result.PATH_TOLERANCE_VIOLATED, result.GOAL_TOLERANCE_VIOLATED) == (-3, -4, -5)
