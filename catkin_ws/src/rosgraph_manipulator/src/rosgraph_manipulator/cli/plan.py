"""`rosrun rosgraph_manipulator plan A B`: what a change would do."""

from __future__ import annotations

import click
from ros_model.io.files import resolve
from rosgraph_launcher.description import SystemDescription

from rosgraph_manipulator.change.tactics import NoRunningNodes, load_tactics, plan_change
from rosgraph_manipulator.cli.invocation import HELP, run
from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.configuration.difference import compare
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.launch_files import read_launch_file, read_model
from rosgraph_manipulator.ros.client import ClientError, join, manipulator_parameters
from rosgraph_manipulator.ros.reconfigure_client import ReconfigureClient


@click.command(context_settings=HELP)
@click.argument("a", metavar="A")
@click.argument("b", metavar="B")
@click.option("--config", help="YAML file with the configurations; by default, the running manipulator's are taken.")
def plan(a: str, b: str, config: str | None) -> None:
    """Print how configuration A would be changed into B.

    A and B are names of configurations, launch files or .rossystem files. An empty text stands for nothing.
    """
    online = join("plan")
    running, wanted = (_system(name, config, online) for name in (a, b))
    nodes = ReconfigureClient() if online else NoRunningNodes()
    found, problems = plan_change(running, wanted, nodes, load_tactics())
    for problem in problems:
        click.echo(problem)
    if not online and compare(running, wanted).parameters:
        click.echo("no ROS master: nodes are not asked what they take by dynamic_reconfigure")
    for name, node in wanted.nodes.items():
        if node.machine:
            click.echo(f"node {name} is for host {node.machine}: a rosgraph_launcher must run there")
    for number, way in enumerate(found):
        click.echo(f"{'' if number == 0 else 'else '}{way}")


def _system(name: str, config: str | None, online: bool) -> SystemDescription:
    if not name:
        return SystemDescription()
    if name.endswith(".rossystem"):
        return read_model(resolve(name)).system
    if name.endswith(".launch"):
        return read_launch_file(resolve(name)).system
    if config is not None:
        options = options_from(read_file(config))
    elif online:
        options = options_from(manipulator_parameters())
    else:
        raise ClientError(f"{name}: no ROS master knows the configurations: start the manipulator or give --config")
    configuration = options.configurations.get(name)
    if configuration is None:
        raise ClientError(f"unknown configuration '{name}'; known are: {', '.join(sorted(options.configurations))}")
    if configuration.problem:
        raise ConfigurationError(configuration.problem)
    return read_launch_file(configuration.launch_file, configuration.args).system


def main() -> None:
    """Run the command."""
    run(plan)
