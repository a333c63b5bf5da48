"""The command `decisions`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from metacontrol_bags.bag import BagError, salvage
from metacontrol_bags.cli.output import (
    BAGS,
    JSON,
    NAMESPACE,
    console,
    of_each,
    robot_of,
    show_json,
    tell_problems,
)
from metacontrol_bags.decision_tables import render
from metacontrol_bags.printable import printable

_TOPIC, _EVENTS = "/mros1_reasoner/decision", "/mission/event"


@click.command()
@BAGS
@NAMESPACE
@JSON
def decisions(bags: tuple[Path, ...], namespace: str | None, as_json: bool) -> None:
    """Tell why each adaptation in each BAG was made: causes, candidates, choice and result."""
    found, status = of_each(bags, lambda bag: _told(bag, namespace))
    if as_json:
        show_json([{key: value for key, value in entry.items() if key != "since"} for entry in found])
        raise click.exceptions.Exit(status)
    out = console()
    for entry in found:
        if len(bags) > 1:
            out.rule(printable(entry["bag"]), align="left")
        for decision in entry["decisions"]:
            out.print(render(decision, entry["since"]))
        if not entry["decisions"]:
            out.print("no decisions")
    raise click.exceptions.Exit(status)


def _told(bag: Path, namespace: str | None) -> dict[str, Any]:
    """Return the decisions of a bag, each as its last message has it."""
    found = salvage(bag, (_TOPIC, _EVENTS), robot_of(bag, namespace))
    last = {decision.id: decision for decision in found.record.decisions}
    if not last and not found.record.events:
        lost = f" ({'; '.join(found.problems)})" if found.problems else ""
        raise BagError(f"{bag}: tells of no decisions{lost}: record {_TOPIC}")
    tell_problems(bag, found.problems)
    return {
        "bag": str(bag),
        "problems": found.problems,
        "since": found.record.start_stamp,
        "decisions": list(last.values()),
    }
