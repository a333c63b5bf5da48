"""`rosrun rosgraph_manipulator release FUNCTION`: have a function released."""

from __future__ import annotations

import sys

import click
from node_kit.one_line import printable

from rosgraph_manipulator.cli.invocation import HELP, run
from rosgraph_manipulator.ros import client


@click.command(context_settings=HELP)
@click.argument("function", metavar="FUNCTION")
def release(function: str) -> None:
    """Have the manipulator stop what only FUNCTION needs, and wait for the result.

    The exit status is 0 when nothing runs for it any more, and 2 otherwise.
    """
    client.join_or_refuse("release")
    answer = client.release(function)
    click.echo(printable(answer.text))
    if not answer.done:
        sys.exit(2)


def main() -> None:
    """Run the command."""
    run(release)
