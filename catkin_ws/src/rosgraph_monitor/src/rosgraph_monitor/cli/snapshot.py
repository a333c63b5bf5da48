"""`rosrun rosgraph_monitor snapshot`: what the master lists, for people or as JSON. It is no node itself."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import click
import rosgraph
from node_kit.io.xml_rpc import CallError
from node_kit.one_line import one_line
from ros_model.io.master import take_snapshot

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ros_model.graph.snapshot import GraphSnapshot


@click.command("snapshot")
@click.option("--json", "as_json", is_flag=True, help="Everything, with types and parameters, as JSON.")
@click.option(
    "--timeout", type=float, default=5.0, show_default=True, metavar="S", help="How long to wait for the master."
)
def main(as_json: bool, timeout: float) -> None:
    """Print what runs, as the ROS master lists it; exit with status 2 and one line if the master can't be asked."""
    try:
        snapshot = take_snapshot(rosgraph.get_master_uri(), timeout)
    except CallError as error:
        click.echo(f"snapshot: {error}: start roscore or set ROS_MASTER_URI", err=True)
        sys.exit(2)
    if as_json:
        click.echo(json.dumps(snapshot.as_dict(), indent=1, default=str))
    else:
        for line in lines(snapshot):
            click.echo(one_line(line))


def lines(snapshot: GraphSnapshot) -> Iterator[str]:
    """Yield a line for each node and each of its ends."""
    for node in snapshot.nodes.values():
        yield f"{node.name} {node.uri}"
        yield from _ends("publishes", node.publications, {t.name: t.type for t in snapshot.topics.values()})
        yield from _ends("subscribes", node.subscriptions, {t.name: t.type for t in snapshot.topics.values()})
        yield from _ends("serves", node.services, {})
        yield from _ends("acts", node.action_servers, {a.name: a.type for a in snapshot.actions.values()})
        yield from _ends("asks", node.action_clients, {a.name: a.type for a in snapshot.actions.values()})


def _ends(word: str, names: Iterable[str], types: dict[str, str]) -> Iterator[str]:
    return (f"  {word} {name} {types.get(name, '')}".rstrip() for name in names)
