"""The command `metrics`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from metacontrol_bags.cli.output import BAGS, JSON, mission, of_each, show_json, show_table
from metacontrol_bags.gaps import gaps
from metacontrol_bags.metrics import summarise
from metacontrol_bags.side_by_side import table


@click.command()
@BAGS
@JSON
def metrics(bags: tuple[Path, ...], as_json: bool) -> None:
    """Tell how the mission in each BAG went: the figures of summary.json."""
    found, status = of_each(bags, told)
    if as_json:
        show_json(found)
    else:
        for entry in found:
            show_table(table({"": entry["summary"]}), entry["bag"])
            if entry["summary"]["reconfigurations"]:
                _show_reconfigurations(entry["summary"]["reconfigurations"])
    raise click.exceptions.Exit(status)


def told(bag: Path) -> dict[str, Any]:
    """Return the summary of a mission's bag, and what it lacks.

    Raises:
        BagError: it holds nothing of a mission.
        MetricsError: an event of the mission says what cannot be.
    """
    found = mission(bag)
    return {"bag": str(bag), "problems": gaps(found), "summary": summarise(found.record)}


def _show_reconfigurations(entries: list[dict[str, Any]]) -> None:
    rows = [["at", "trigger", "from", "to", "detect", "decide", "execute"]]
    for entry in entries:
        spans = (entry[key] for key in ("detect_s", "decide_s", "execute_s"))
        texts = ("-" if span is None else f"{span:.2f} s" for span in spans)
        rows.append([f"{entry['stamp_s']:.2f} s", entry["trigger"], entry["from"], entry["to"], *texts])
    show_table(rows, "reconfigurations")
