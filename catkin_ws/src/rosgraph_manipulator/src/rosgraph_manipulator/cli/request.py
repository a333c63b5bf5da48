"""`rosrun rosgraph_manipulator request NAME`: have a configuration deployed."""

from __future__ import annotations

import sys

import click
from metacontrol_msgs.msg import ReconfigurationResult
from node_kit.one_line import printable

from rosgraph_manipulator.cli.invocation import HELP, print_last_change, run
from rosgraph_manipulator.ros import client


@click.command(context_settings=HELP)
@click.argument("name", metavar="NAME")
@click.option("--restart", metavar="NODE", multiple=True, help="Restart this node of NAME even if it does not differ.")
def request(name: str, restart: tuple[str, ...]) -> None:
    """Have the manipulator deploy configuration NAME, and wait for the result.

    The exit status is 0 when it runs, 1 when the former one was restored, and 2 otherwise.
    """
    client.join_or_refuse("request")
    answer = client.request(name, restart)
    click.echo(printable(answer.text))
    if not answer.done:
        sys.exit(1 if answer.result == ReconfigurationResult.FAILED else 2)
    print_last_change(client.active_configuration())


def main() -> None:
    """Run the command."""
    run(request)
