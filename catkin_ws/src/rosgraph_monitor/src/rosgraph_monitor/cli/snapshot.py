"""`rosrun rosgraph_monitor snapshot`: what the master lists, for people or as JSON. It is no node itself."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

import rosgraph
from ros_model.io.master import SnapshotError, take_snapshot

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ros_model.graph.snapshot import GraphSnapshot


def main() -> None:
    """Print a snapshot; exit with status 2 and one line where there is none to be had."""
    parser = argparse.ArgumentParser(prog="snapshot", description="What runs, as the ROS master lists it.")
    parser.add_argument("--json", action="store_true", help="everything, with types and parameters, as JSON")
    parser.add_argument(
        "--timeout", type=float, default=5.0, metavar="S", help="patience with the master (%(default)s)"
    )
    options = parser.parse_args()
    try:
        snapshot = take_snapshot(rosgraph.get_master_uri(), options.timeout)
    except SnapshotError as error:
        sys.stderr.write(f"snapshot: {error}: start roscore or set ROS_MASTER_URI\n")
        sys.exit(2)
    if options.json:
        sys.stdout.write(json.dumps(snapshot.as_dict(), indent=1, default=str) + "\n")
    else:
        sys.stdout.writelines(f"{line}\n" for line in lines(snapshot))


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
