"""The command `explain`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
from metacontrol_bags.decision import Decision
from metacontrol_bags.decision_tables import render

from mros1_reasoner.cli.output import ERRORS, NAMESPACE, console, refuse
from mros1_reasoner.io.reasoner_bag import read_decisions


@click.command()
@click.argument("bag", type=click.Path(path_type=Path), required=False)
@click.option("--topic", default="mros1_reasoner/decision", show_default=True, help="Of a running reasoner.")
@click.option("--wait", default=0.5, show_default=True, help="For a decision of a running reasoner, s.")
@click.option("--last", type=click.IntRange(min=1), metavar="N", help="The last N decisions, the oldest first.")
@NAMESPACE
def explain(bag: Path | None, topic: str, wait: float, last: int | None, namespace: str | None) -> None:
    """Explain all decisions in a BAG, or the last decision of the running reasoner if no BAG is given."""
    try:
        decisions = _running(topic, wait, last) if bag is None else read_decisions(bag, namespace)
    except ERRORS as error:
        refuse("explain", error)
    out = console()
    for decision in decisions[-(last or 0) :]:
        out.print(render(decision))
    if not decisions:
        out.print("no decision yet" if bag is None else f"{bag}: holds no decisions")


def _running(topic: str, wait: float, last: int | None) -> Sequence[Decision]:
    """Return the last decision of the running reasoner, or the last ones."""
    from mros1_reasoner.ros.decisions import last_decision, last_decisions  # the only part that needs ROS

    if last is not None:
        return last_decisions(topic, last, wait)
    decision = last_decision(topic, wait)
    return [decision] if decision else []
