"""Takes two waits out of `rospy.init_node`.

rospy asks only every 0.1 s whether the master has registered the node, which takes some milliseconds. It also looks
through all installed packages for a logging configuration, even if it then finds one where it looks first.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from types import SimpleNamespace

import rospkg
import rospy.impl.init

POLL_PERIOD = 0.001  # s, wall
LOG_CONFIGURATION = "ROS_PYTHON_LOG_CONFIG_FILE"


@contextlib.contextmanager
def quick_start() -> Iterator[None]:
    """Let `rospy.init_node` in the body start without these waits."""
    module, set_before = rospy.impl.init, os.environ.get(LOG_CONFIGURATION)
    found = set_before or _log_configuration()
    usual = module.time
    module.time = SimpleNamespace(**{**vars(time), "sleep": lambda seconds: time.sleep(min(seconds, POLL_PERIOD))})
    if found:
        os.environ[LOG_CONFIGURATION] = found
    try:
        yield
    finally:
        module.time = usual
        if found and not set_before:
            del os.environ[LOG_CONFIGURATION]


def _log_configuration() -> str:
    """Return the logging configuration that rospy prefers to that of the package rosgraph; empty: there is none."""
    for folder in (os.path.join(rospkg.get_ros_home(), "config"), rospkg.get_etc_ros_dir()):
        for name in ("python_logging.conf", "python_logging.yaml"):
            path = os.path.join(folder, name)
            if os.path.isfile(path):
                return path
    return ""
