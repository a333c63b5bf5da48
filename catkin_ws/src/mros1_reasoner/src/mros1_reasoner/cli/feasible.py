"""The command `feasible`."""

from __future__ import annotations

import click

from mros1_reasoner.cli.output import ERRORS, refuse
from mros1_reasoner.planning.pddl import problem


@click.command()
@click.argument("function", required=False, default="")
@click.option("--pddl", is_flag=True, help="As a problem in PDDL, for a planner.")
@click.option("--node", default="reasoner", show_default=True, help="Name of the running reasoner.")
@click.option("--wait", default=3.0, show_default=True, help="For the running reasoner, s.")
def feasible(function: str, pddl: bool, node: str, wait: float) -> None:
    """Tell by which designs each function could be fulfilled now, the most useful first; FUNCTION: only of this one."""
    from mros1_reasoner.ros.feasibility import feasible_now  # the only part that needs ROS

    try:
        found = feasible_now(node, function, wait)
    except ERRORS as error:
        refuse("feasible", error)
    if pddl:
        click.echo(problem(found), nl=False)
        return
    for name, designs in found.items():
        click.echo(f"{name}: {', '.join(designs) or 'no design can be deployed'}")
