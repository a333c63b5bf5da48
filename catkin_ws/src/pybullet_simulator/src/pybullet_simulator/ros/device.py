"""The device behind a driver: it may be unplugged."""

from __future__ import annotations

import rospy

UNPLUGGED = "unplugged"
"""Name of the private parameter that says so; it holds for drivers that are started from then on."""


class DeviceError(RuntimeError):
    """There is no device; the message says where that is set."""


def check_device() -> None:
    """Check that the device of this node is there.

    Raises:
        DeviceError: it is unplugged.
    """
    if rospy.get_param(f"~{UNPLUGGED}", False):
        name = rospy.resolve_name(f"~{UNPLUGGED}")
        raise DeviceError(f"its device is unplugged: delete parameter {name} to plug it in again")
