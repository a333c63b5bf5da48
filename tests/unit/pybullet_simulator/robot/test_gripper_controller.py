"""The controller of a gripper tells whether the fingers have arrived, or hold something."""

import math

import pytest
from pybullet_simulator.robot.gripper_controller import MAX_FORCE, GripperController, GripperError
from pybullet_simulator.robot.manipulator import MAX_WIDTH


def run(controller, width, narrowest=0.0, speed=0.1):
    """Move fingers at 50 Hz from a width until the command ends; return its outcome."""
    now = 0.0
    while now < 5.0:
        outcome = controller.update(now, width)
        if outcome:
            return outcome
        step = max(-speed * 0.02, min(speed * 0.02, controller.width - width))
        width = max(narrowest, width + step)
        now += 0.02
    raise AssertionError("the command did not end")


def test_fingers_arrive():
    controller = GripperController()
    controller.command(0.01, 20.0, 0.0)
    outcome = run(controller, MAX_WIDTH)
    assert outcome.reached
    assert outcome.width == pytest.approx(0.01, abs=0.002)
    assert controller.force == 20.0


def test_fingers_that_hold_something_stall_and_keep_their_force():
    controller = GripperController()
    controller.command(0.0, 0.0, 0.0)
    outcome = run(controller, MAX_WIDTH, narrowest=0.05)
    assert outcome.stalled
    assert outcome.width == pytest.approx(0.05)
    assert controller.width == 0.0
    assert controller.force > 0.0


def test_without_a_command_fingers_stay():
    controller = GripperController()
    assert controller.update(0.0, 0.03) is None
    assert controller.width == 0.03


def test_each_command_ends_once():
    controller = GripperController()
    controller.command(0.03, 0.0, 0.0)
    assert controller.update(0.0, 0.03).reached
    assert controller.update(0.02, 0.03) is None


@pytest.mark.parametrize(
    ("width", "force"),
    [(-0.01, 0.0), (0.2, 0.0), (math.nan, 0.0), (0.01, MAX_FORCE + 1), (0.01, -1.0), (0.01, math.inf)],
)
def test_command_out_of_range_is_refused(width, force):
    with pytest.raises(GripperError):
        GripperController().command(width, force, 0.0)


def test_command_ends_though_the_clock_is_set_back():
    gripper = GripperController()
    gripper.command(0.04, 0.0, 1000.0)
    assert gripper.update(1000.0, 0.06) is None
    assert gripper.update(1.0, 0.06) is None
    assert gripper.update(1.5, 0.06).stalled
