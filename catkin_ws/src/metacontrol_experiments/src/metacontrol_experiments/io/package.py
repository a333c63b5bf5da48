"""Where metacontrol_sim is."""

from __future__ import annotations

from pathlib import Path

import rospkg

from metacontrol_experiments.ros.runner import RunError


def simulation_package() -> Path:
    """The folder of metacontrol_sim.

    Raises:
        RunError: it is not there.
    """
    try:
        return Path(rospkg.RosPack().get_path("metacontrol_sim"))
    except rospkg.ResourceNotFound as error:
        raise RunError("package metacontrol_sim not found; source the workspace's devel/setup.bash first") from error
