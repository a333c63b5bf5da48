"""Where metacontrol_sim is, and how a command refuses."""

from __future__ import annotations

from pathlib import Path

import click
import rospkg

from metacontrol_experiments.runner import RunError

REFUSED = 2


def simulation_package() -> Path:
    """The folder of metacontrol_sim.

    Raises:
        RunError: it is not there.
    """
    try:
        return Path(rospkg.RosPack().get_path("metacontrol_sim"))
    except rospkg.ResourceNotFound as error:
        raise RunError("package metacontrol_sim not found; source the workspace's devel/setup.bash first") from error


def refused(error: Exception) -> click.exceptions.Exit:
    """Say in one line what is wrong, and return what ends the command."""
    click.echo(f"metacontrol: {' '.join(str(error).split())}", err=True)
    return click.exceptions.Exit(REFUSED)
