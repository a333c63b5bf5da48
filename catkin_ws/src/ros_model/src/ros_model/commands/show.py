"""`rosmodel show`: a model for the eye."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ros_model.reader import read_system

if TYPE_CHECKING:
    from ros_model.metamodel import RosSystem


@click.command()
@click.argument("file")
def show(file: str) -> None:
    """Show a .rossystem file as a tree."""
    from rich.console import Console  # slow to import, and only needed here

    Console(highlight=False).print(_tree(read_system(file)))


def _tree(system: RosSystem) -> object:
    from rich.markup import escape
    from rich.tree import Tree

    tree = Tree(f"[bold]{escape(system.name)}[/bold]")
    for component in system.components:
        branch = tree.add(f"[bold]{escape(component.graph_name)}[/bold]  {escape(str(component.executable or ''))}")
        for port in component.ports:
            branch.add(f"{port.kind.value} [cyan]{escape(port.name)}[/cyan]")
        for parameter in component.parameters:
            branch.add(f"parameter [green]{escape(parameter.key)}[/green] = {escape(repr(parameter.value))}")
    for connection in system.connections:
        sources = ", ".join(map(str, connection.sources))
        targets = ", ".join(map(str, connection.targets))
        tree.add(escape(f"{connection.kind.value} {connection.name}: {sources} -> {targets}"))
    for setting in system.parameters:
        tree.add(f"parameter [green]{escape(setting.name)}[/green] = {escape(repr(setting.value))}")
    return tree
