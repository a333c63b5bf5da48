"""`rosrun rosgraph_manipulator status`: what runs, how the last change went, and which components have failed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import click
from metacontrol_msgs.msg import ActiveConfiguration, LaunchedFunction
from node_kit.one_line import printable

from rosgraph_manipulator.cli.invocation import HELP, print_last_change, run
from rosgraph_manipulator.ros import client


@click.command(context_settings=HELP)
def status() -> None:
    """Print what runs, how the last change went, and which components have failed."""
    client.join_or_refuse("status")
    monitor = client.MonitorListener()
    active, launchers = client.active_configuration(), client.launched_functions()
    if active is None and not launchers:
        raise client.ClientError("neither manipulator nor launcher answers: start manipulator.launch")
    if active is not None:
        for line in function_lines(active, client.failures()):
            click.echo(printable(line))
        print_last_change(active)
    for name, launcher in launchers.items():
        of = "" if len(launchers) == 1 else f" of {name}"
        lines = process_lines(launcher.functions)
        click.echo(printable("\n".join([f"processes{of}:{'' if lines else ' none'}", *lines])))
    for line in failure_lines(monitor.failed()):
        click.echo(printable(line))


def function_lines(active: ActiveConfiguration, failures: Mapping[str, str]) -> list[str]:
    """Return what is deployed for each function, in lines, and why nothing is for one that has failed.

    Args:
        active: what the manipulator has told; where its message has the reason, that is left out.
        failures: why nothing runs for a function, by its name.
    """
    states = {grounding.function: f"{grounding.configuration} {grounding.state}" for grounding in active.functions}
    released = {function: "released after it had failed" for function in sorted(failures) if function not in states}
    lines = []
    for function, state in (states | released).items():
        reason = failures.get(function, "")
        is_told = active.message and (active.message in reason or reason in active.message)
        lines += [f"{function}: {state}", *([f"  {reason}"] if reason and not is_told else [])]
    return lines


def failure_lines(failed: Mapping[str, str]) -> list[str]:
    """Return the components that have failed, in lines, each with the reason where it is known."""
    lines = [f"  {name}{f': {reason}' if reason else ''}" for name, reason in sorted(failed.items())]
    return ["failed components:", *lines] if lines else []


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
