"""Devices that go wrong while their driver runs on."""

import genpy
import pytest
from pybullet_simulator.robot.faults import JUMP_S, Fault, Outlet
from sensor_msgs.msg import LaserScan


def scan(seconds):
    message = LaserScan()
    message.header.stamp = genpy.Time.from_sec(seconds)
    return message


def sent(outlet, *seconds):
    return [outlet.pass_on(scan(second)).header.stamp.to_sec() for second in seconds]


def test_device_without_a_fault_is_passed_on():
    assert sent(Outlet(), 1.0, 1.1, 1.2) == pytest.approx([1.0, 1.1, 1.2])


def test_device_that_repeats_itself_sends_its_last_message():
    outlet = Outlet()
    sent(outlet, 1.0)
    outlet.fault = Fault.REPEAT
    assert sent(outlet, 1.1, 1.2) == pytest.approx([1.0, 1.0])
    outlet.fault = None
    assert sent(outlet, 1.3) == pytest.approx([1.3])


def test_every_other_stamp_jumps():
    outlet = Outlet()
    outlet.fault = Fault.JUMP
    assert sent(outlet, 1.0, 1.1, 1.2) == pytest.approx([1.0 + JUMP_S, 1.1, 1.2 + JUMP_S])
