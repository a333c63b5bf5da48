"""What all commands share: their arguments, their errors and the lines about the last change."""

from __future__ import annotations

import sys

import click
from metacontrol_msgs.msg import ActiveConfiguration
from node_kit.one_line import printable
from node_kit.plugins import PluginError
from ros_model.errors import ModelError

from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.io.launch_files import LaunchFileError
from rosgraph_manipulator.ros.client import ClientError

HELP = {"help_option_names": ["-h", "--help"]}
REMAPPING = ":="  # in arguments for ROS, such as `__ns:=/robot`

ERRORS = (ClientError, ConfigurationError, LaunchFileError, ModelError, PluginError)


def run(command: click.Command) -> None:
    """Run a command, without the arguments that are for ROS; where it is refused, exit with status 2 and one line."""
    arguments = [argument for argument in sys.argv[1:] if REMAPPING not in argument]
    try:
        command.main(arguments, prog_name=command.name)
    except ERRORS as error:
        click.echo(printable(" ".join(str(error).split())), err=True)
        sys.exit(2)


def print_last_change(active: ActiveConfiguration | None) -> None:
    """Print how the last change went, and how long its phases took."""
    if active is None:
        return
    if active.message:
        click.echo(printable(f"  {active.message}"))
    for phase in active.phases:
        click.echo(printable(f"  {phase.name:<9} {phase.duration:.3f} s"))
