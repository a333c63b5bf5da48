"""`rosrun rosgraph_manipulator status`: what runs, and how the last change went."""

from __future__ import annotations

from collections.abc import Iterable

import click
from metacontrol_msgs.msg import LaunchedFunction

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
        lines = process_lines(launcher.functions)
        click.echo("\n".join([f"processes{of}:{'' if lines else ' none'}", *lines]))


def process_lines(functions: Iterable[LaunchedFunction]) -> list[str]:
    """Return what a launcher runs, in lines; a function that was released runs nothing."""
    lines = []
    for function in functions:
        if not (function.configuration or function.nodes):
            continue
        lines.append(f"  {function.function}: {function.configuration or 'none'} {function.state}")
        lines += [f"    {node}{' (dead)' if node in function.dead else ''}" for node in function.nodes]
        lines += [f"    {function.message}"] if function.message else []
    return lines


def main() -> None:
    """Run the command."""
    run(status)
