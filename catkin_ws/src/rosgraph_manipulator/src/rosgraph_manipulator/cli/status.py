"""`rosrun rosgraph_manipulator status`: what runs, and how the last change went."""

from __future__ import annotations

import click

from rosgraph_manipulator.cli.invocation import HELP, print_last_change, run
from rosgraph_manipulator.ros import client


@click.command(context_settings=HELP)
def status() -> None:
    """Print what runs, and how the last change went."""
    client.join_or_refuse("status")
    active, launchers = client.active_configuration(), client.launched_functions()
    if active is None and not launchers:
        raise client.ClientError("neither manipulator nor launcher answers: start manipulator.launch")
    if active is not None:
        for grounding in active.functions:
            click.echo(f"{grounding.function}: {grounding.configuration} {grounding.state}")
        print_last_change(active)
    for name, launcher in launchers.items():
        of = "" if len(launchers) == 1 else f" of {name}"
        click.echo(f"processes{of}: {'' if launcher.functions else 'none'}".rstrip())
        for function in launcher.functions:
            click.echo(f"  {function.function}: {function.configuration or 'none'} {function.state}")
            for node in function.nodes:
                click.echo(f"    {node}{' (dead)' if node in function.dead else ''}")
            if function.message:
                click.echo(f"    {function.message}")


def main() -> None:
    """Run the command."""
    run(status)
