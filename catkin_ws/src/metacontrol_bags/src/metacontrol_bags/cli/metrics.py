"""The command `metrics`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from metacontrol_bags.adaptation import describe_adaptation
from metacontrol_bags.cli.output import BAGS, JSON, NAMESPACE, mission, of_each, show_json, show_table
from metacontrol_bags.gaps import gaps, is_d2
from metacontrol_bags.metrics import summarise
from metacontrol_bags.side_by_side import adaptation_table, table


@click.command()
@BAGS
@NAMESPACE
@JSON
def metrics(bags: tuple[Path, ...], namespace: str | None, as_json: bool) -> None:
    """Tell how the run in each BAG went: what a meta-controller did, and of D2 the figures of summary.json."""
    found, status = of_each(bags, lambda bag: told(bag, namespace))
    if as_json:
        show_json(found)
    else:
        for entry in found:
            figures = entry["adaptation"]
            show_table(
                table({"": entry["summary"]}) if entry["summary"] else adaptation_table({"": figures}), entry["bag"]
            )
            if figures["reconfigurations"]:
                _show_reconfigurations(figures["reconfigurations"])
    raise click.exceptions.Exit(status)


def told(bag: Path, namespace: str | None = None) -> dict[str, Any]:
    """Return what a bag tells of a run, and what it lacks; `summary` is None where the mission is not D2's.

    Args:
        bag: its file.
        namespace: of the robot; that of the only one, where it is None.

    Raises:
        BagError: it holds nothing of a mission.
        MetricsError: an event of the mission says what cannot be.
    """
    found = mission(bag, namespace)
    return {
        "bag": str(bag),
        "problems": gaps(found),
        "summary": summarise(found.record) if is_d2(found.record) else None,
        "adaptation": describe_adaptation(found.record),
    }


def _show_reconfigurations(entries: list[dict[str, Any]]) -> None:
    rows = [["at", "trigger", "from", "to", "detect", "decide", "execute"]]
    for entry in entries:
        spans = (entry[key] for key in ("detect_s", "decide_s", "execute_s"))
        texts = ("-" if span is None else f"{span:.2f} s" for span in spans)
        rows.append([f"{entry['stamp_s']:.2f} s", entry["trigger"], entry["from"], entry["to"], *texts])
    show_table(rows, "reconfigurations")
