"""The command `compare`."""

from __future__ import annotations

from pathlib import Path

import click

from metacontrol_bags.cli.metrics import told
from metacontrol_bags.cli.output import BAGS, JSON, NAMESPACE, of_each, show_json, show_table
from metacontrol_bags.printable import printable
from metacontrol_bags.side_by_side import adaptation_table, markdown, short_names, table


@click.command()
@BAGS
@click.option("--markdown", "as_markdown", is_flag=True, help="Print a Markdown table.")
@NAMESPACE
@JSON
def compare(bags: tuple[Path, ...], as_markdown: bool, namespace: str | None, as_json: bool) -> None:
    """Show the figures of several runs side by side, a column for each BAG."""
    found, status = of_each(bags, lambda bag: told(bag, namespace))
    if as_json:
        show_json(found)
    elif found:
        names = short_names([Path(entry["bag"]) for entry in found])
        if all(entry["summary"] for entry in found):
            rows = table({name: entry["summary"] for name, entry in zip(names, found, strict=True)})
        else:
            rows = adaptation_table({name: entry["adaptation"] for name, entry in zip(names, found, strict=True)})
        if as_markdown:
            click.echo(markdown([[printable(text) for text in row] for row in rows]))
        else:
            show_table(rows)
    raise click.exceptions.Exit(status)
