"""`rosmodel show`: a model for the eye."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ros_model.errors import ModelError
from ros_model.io.models import read_all
from ros_model.language.notation import type_text, value_text
from ros_model.language.packages import PackageSet
from ros_model.project.settings import FILE_NAME

if TYPE_CHECKING:
    from ros_model.language.metamodel import Component, ParameterType, Position, RosSystem, Value
    from ros_model.language.packages import Node, Package

_UNLIMITED = 100_000  # columns of what is no terminal


@click.command()
@click.option(
    "--graph",
    type=click.Path(),
    metavar="FILE.svg|png|pdf|dot",
    help="Draw into this file, with graphviz: of a .rossystem file nodes, topics, services, actions and connections, "
    "of a project (metacontrol.yaml or its folder) the functions, their designs, and what these require.",
)
@click.argument("file", type=click.Path())
def show(file: str, graph: str | None) -> None:
    """Show a .rossystem or .ros file as a tree, or draw it. A project can be drawn."""
    if graph is not None and (Path(file).name == FILE_NAME or Path(file, FILE_NAME).exists()):
        from ros_model.io.drawing import draw
        from ros_model.io.hierarchy import hierarchy
        from ros_model.io.project import load_project

        draw(hierarchy(load_project(file)), Path(graph))
        return
    model = read_all(Path(file))
    if graph is not None:
        from ros_model.io.drawing import dot, draw

        if isinstance(model, PackageSet):
            raise ModelError(f"{file}: packages have no connections to draw: give a .rossystem file")
        draw(dot(model), Path(graph))
        return
    from rich.console import Console  # slow to import, and only needed here

    tree = _packages(model, file) if isinstance(model, PackageSet) else _system(model)
    width = None if sys.stdout.isatty() else _UNLIMITED
    Console(highlight=False, width=width).print(tree)


def _system(system: RosSystem) -> Any:
    tree = _tree(f"[bold]{_plain(system.name)}[/bold]")
    stacks = {name: stack.name for stack in system.stacks for name in stack.components}
    branches = {stack.name: tree.add(f"stack [bold]{_plain(stack.name)}[/bold]") for stack in system.stacks}
    for component in system.components:
        _component(branches.get(stacks.get(component.name, ""), tree), component)
    for connection in system.connections:
        sources, targets = (", ".join(map(str, ends)) for ends in (connection.sources, connection.targets))
        tree.add(_plain(f"{connection.kind.value} {connection.name}: {sources} -> {targets}"))
    for parameter in system.parameters:
        _parameter(tree, parameter.name, parameter.type, parameter.value, parameter.position)
    return tree


def _component(tree: Any, component: Component) -> None:
    branch = tree.add(
        f"[bold]{_plain(component.graph_name)}[/bold]  {_plain(str(component.executable or ''))}".rstrip()
    )
    for port in component.ports:
        branch.add(f"{port.kind.value} [cyan]{_plain(port.name)}[/cyan]")
    for parameter in component.parameters:
        _parameter(branch, parameter.key, None, parameter.value, parameter.position)


def _packages(packages: PackageSet, file: str) -> Any:
    tree = _tree(f"[bold]{_plain(Path(file).name)}[/bold]")
    for package in packages.packages:
        _package(tree.add(f"package [bold]{_plain(package.name)}[/bold]"), package)
    return tree


def _package(tree: Any, package: Package) -> None:
    for artifact in package.artifacts:
        branch = tree.add(f"artifact [bold]{_plain(artifact.name)}[/bold]")
        for node in artifact.nodes:
            _node(branch.add(f"node [bold]{_plain(node.name)}[/bold]"), node)
    for spec in package.specs:
        parts = "".join(
            f"; {part}: {', '.join(f'{field.type} {field.name}' for field in fields) or 'nothing'}"
            for part, fields in spec.parts
        )
        tree.add(f"{spec.kind.value} [cyan]{_plain(spec.name)}[/cyan]{_plain(parts)}")
    for name in (*package.dependencies, *package.external_dependencies):
        tree.add(f"depends on {_plain(name)}")


def _node(tree: Any, node: Node) -> None:
    for port in node.ports:
        tree.add(f"{port.kind.value} [cyan]{_plain(port.name)}[/cyan]  {_plain(port.type)}".rstrip())
    for parameter in node.parameters:
        _parameter(tree, parameter.name, parameter.type, parameter.value, parameter.position)


def _parameter(tree: Any, name: str, declared: ParameterType | None, value: Value | None, position: Position) -> None:
    text = f"  {type_text(declared, position)}" if declared else ""
    if value is not None:
        text += f" = {value_text(value, position)}"
    tree.add(f"parameter [green]{_plain(name)}[/green]{_plain(text)}")


def _tree(text: str) -> Any:
    from rich.tree import Tree

    return Tree(text)


def _plain(text: str) -> str:
    """Return text as it is: not as markup, and without what would command a terminal."""
    from rich.markup import escape

    return escape("".join(mark if mark.isprintable() else "\N{REPLACEMENT CHARACTER}" for mark in text))
