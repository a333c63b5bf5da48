"""The command `explain`."""

from __future__ import annotations

from pathlib import Path

import click
from metacontrol_bags.decision_tables import render

from mros1_reasoner.cli.output import ERRORS, NAMESPACE, console, refuse
from mros1_reasoner.io.reasoner_bag import read_decisions


@click.command()
@click.argument("bag", type=click.Path(path_type=Path), required=False)
@click.option("--topic", default="mros1_reasoner/decision", show_default=True, help="Of a running reasoner.")
@click.option("--wait", default=0.5, show_default=True, help="For a decision of a running reasoner, s.")
@click.option("--last", type=click.IntRange(min=1), metavar="N", help="Only the last N decisions of a BAG.")
@NAMESPACE
def explain(bag: Path | None, topic: str, wait: float, last: int | None, namespace: str | None) -> None:
    """Explain all decisions in a BAG, or the last decision of the running reasoner if no BAG is given."""
    out = console()
    if bag is None and last is not None:
        refuse("explain", ValueError("--last is for a bag, a running reasoner offers one decision: record its topic"))
    if bag is None:
        from mros1_reasoner.ros.decisions import last_decision  # the only part that needs ROS

        try:
            decision = last_decision(topic, wait)
        except ERRORS as error:
            refuse("explain", error)
        out.print(render(decision) if decision else "no decision yet")
        return
    try:
        decisions = read_decisions(bag, namespace)
    except ERRORS as error:
        refuse("explain", error)
    for decision in decisions[-(last or 0) :]:
        out.print(render(decision))
    if not decisions:
        out.print(f"{bag}: holds no decisions")
