"""The command `rosmodel`: one subcommand for each step at design time."""

from __future__ import annotations

import importlib
import os
import sys
from typing import TYPE_CHECKING

import click

from ros_model.cli import BAD_INPUT
from ros_model.errors import ModelError
from ros_model.io.excerpts import caret_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

_COMMANDS = {
    "check": "ros_model.cli.check:check",
    "diff": "ros_model.cli.diff:diff",
    "format": "ros_model.cli.format:format_",
    "generate": "ros_model.cli.generate:generate",
    "init": "ros_model.cli.init:init",
    "show": "ros_model.cli.show:show",
    "variants": "ros_model.cli.variants:variants",
}
"""Command -> where it is. A command's module is imported when it is run, so that the others' imports cost nothing."""
_OFFERED = {"extract": "ros_model_extraction", "snapshot": "ros_model_extraction"}
"""Command -> the package of this project that adds it, to be named where it is not there."""
_PLUGINS = "ros_model"
"""Tag of what packages export: `<export><ros_model command="NAME" function="MODULE:FUNCTION"/></export>`."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command; what is wrong is told on standard error, with the line of the file and a caret."""
    try:
        status = command.main(args=arguments, prog_name="rosmodel", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except ModelError as error:
        for found in error.all:
            click.echo("\n".join([f"rosmodel: {found}", *caret_lines(found.position)]), err=True)
        sys.exit(BAD_INPUT)
    except (click.Abort, KeyboardInterrupt):
        sys.exit(130)
    except BrokenPipeError:  # the reader of our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    sys.exit(status if isinstance(status, int) else 0)


class _Commands(click.Group):
    """A group that imports a command when it is asked for."""

    def list_commands(self, _context: click.Context) -> list[str]:
        return sorted({**_added_commands(), **_COMMANDS})

    def get_command(self, _context: click.Context, name: str) -> click.Command | None:
        where = _COMMANDS.get(name) or _added_commands().get(name)
        if where is None and name in _OFFERED:
            raise ModelError(
                f"no command {name!r}: package {_OFFERED[name]} offers it: build it and source the workspace"
            )
        if where is None:
            return None
        module, _, function = where.partition(":")
        found: click.Command = getattr(importlib.import_module(module), function)
        return found


def _added_commands() -> dict[str, str]:
    """Return the commands that other packages export: command -> where it is."""
    from node_kit.plugins import exported  # slow to import

    exports = (attributes for _, attributes in exported(_PLUGINS))
    return {found["command"]: found["function"] for found in exports if {"command", "function"} <= found.keys()}


def _version(context: click.Context, _option: click.Parameter, asked: bool) -> None:
    if not asked or context.resilient_parsing:
        return
    import rospkg  # slow to import

    try:
        click.echo(f"rosmodel {rospkg.RosPack().get_manifest('ros_model').version}")
    except rospkg.ResourceNotFound as error:
        raise ModelError("no package ros_model: source the workspace that holds it") from error
    context.exit()


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version", is_flag=True, is_eager=True, expose_value=False, callback=_version, help="Show the version and exit."
)
def command() -> None:
    """Models of ROS systems: check, format, show, generate from them."""
