"""The command `rosmodel`: one subcommand for each step at design time."""

from __future__ import annotations

import importlib
import os
import sys
from typing import TYPE_CHECKING

import click

from ros_model.cli import BAD_INPUT
from ros_model.errors import ModelError, printable
from ros_model.io.excerpts import caret_lines

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from node_kit.plugins import Plugin, PluginError

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
_OFFERED = {"doctor": "mros1_reasoner", "extract": "ros_model_extraction", "snapshot": "ros_model_extraction"}
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
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        click.echo(printable(f"rosmodel: {where}{error.strerror or error}: check the path"), err=True)
        sys.exit(BAD_INPUT)
    sys.exit(status if isinstance(status, int) else 0)


class _Commands(click.Group):
    """A group that imports a command when it is asked for."""

    def list_commands(self, _context: click.Context) -> list[str]:
        return sorted({*_added_commands(), *_COMMANDS})

    def get_command(self, _context: click.Context, name: str) -> click.Command | None:
        if name in _COMMANDS:
            module, _, function = _COMMANDS[name].partition(":")
            ours: click.Command = getattr(importlib.import_module(module), function)
            return ours
        plugin = _added_commands().get(name)
        if plugin is None and name in _OFFERED:
            raise ModelError(
                f"no command {name!r}: package {_OFFERED[name]} offers it: build it and source the workspace"
            )
        return _loaded(plugin) if plugin else None


def _added_commands() -> Mapping[str, Plugin]:
    """Return the commands that other packages export, by name."""
    from node_kit.plugins import find  # slow to import

    return find(_PLUGINS, "command")


def _loaded(plugin: Plugin) -> click.Command:
    """Return a plug-in's command; where it can't be loaded, one that says why, so that the others' help is shown."""
    from node_kit.plugins import PluginError

    try:
        found = plugin.load()
        if not isinstance(found, click.Command):
            raise plugin.error("is no command", "decorate it with click.command")
    except PluginError as error:
        return _broken(plugin.name, error)
    return found


def _broken(name: str, error: PluginError) -> click.Command:
    def fail() -> None:
        raise ModelError(str(error)) from error

    takes_all = {"ignore_unknown_options": True, "allow_extra_args": True}
    return click.Command(
        name, callback=fail, short_help="(can't be loaded)", add_help_option=False, context_settings=takes_all
    )


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
