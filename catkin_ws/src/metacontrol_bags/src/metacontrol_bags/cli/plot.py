"""The command `plot`."""

from __future__ import annotations

from pathlib import Path

import click

from metacontrol_bags.cli.output import BAGS, mission, of_each


@click.command()
@BAGS
@click.option(
    "--format", "kind", type=click.Choice(["png", "svg"]), help="As the end of --output says; png by default."
)
@click.option("--output", type=click.Path(path_type=Path), help="File of the figure; a folder for several bags.")
def plot(bags: tuple[Path, ...], kind: str | None, output: Path | None) -> None:
    """Draw the map, the path and the quality series of the mission in each BAG, beside the bag."""
    if output is not None and len(bags) > 1 and not output.is_dir():
        raise click.UsageError(f"--output: {output} is no folder, and there are several bags: make a folder")

    def draw_bag(bag: Path) -> Path:
        record = mission(bag).record
        from metacontrol_bags.figure import draw  # matplotlib takes a while to import

        target = _target(bag, kind, output)
        draw(record, target)
        return target

    drawn, status = of_each(bags, draw_bag)
    for target in drawn:
        click.echo(target)
    raise click.exceptions.Exit(status)


def _target(bag: Path, kind: str | None, output: Path | None) -> Path:
    if output is not None and not output.is_dir():
        return output.with_suffix(f".{kind}") if kind else output
    name = f"{bag.name.removesuffix('.active').removesuffix('.bag')}.{kind or 'png'}"
    return (output or bag.parent) / name
