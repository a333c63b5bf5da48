"""The command `metacontrol view`: recorded runs as a page."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path

import click
from metacontrol_bags.bag_file import BagError
from node_kit.io.output_files import write_file

from metacontrol_dashboard.io import bags
from metacontrol_dashboard.io.page import PageError, page_files, standalone
from metacontrol_dashboard.io.server import Access, Content, Run, Server, ServerError, is_loopback

_REFUSED = 2  # exit status
_BAGS = ("*.bag", "*.bag.active")


@click.command()
@click.argument("paths", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="BAG...")
@click.option("--namespace", help="Of the robot, where a bag holds several.")
@click.option(
    "--export", type=click.Path(path_type=Path, dir_okay=False), help="Write the run as one HTML file instead."
)
@click.option("--address", default="localhost", show_default=True, help="To listen on.")
@click.option("--port", default=8091, show_default=True, help="To listen on; where it is taken, another one.")
def view(paths: tuple[Path, ...], namespace: str | None, export: Path | None, address: str, port: int) -> None:
    """Show each BAG, or all bags in a folder, as a page: play it, jump to decisions, try other limits, without ROS.

    Exit status: 2 where a bag can't be read, or the page was not built.
    """
    try:
        if export is not None:
            _export(paths, namespace, export)
            return
        files = page_files()
        runs = {name: partial(_open, path, namespace) for name, path in found_bags(paths).items()}
        server = Server(Content(files, runs=runs), Access(address, port, control=False))
        server.start()
    except (*bags.UNFIT, PageError, ServerError) as error:
        click.echo(f"view: {' '.join(str(error).split())}", err=True)
        sys.exit(_REFUSED)
    click.echo(f"{server.url} shows {len(runs)} run{'s' if len(runs) > 1 else ''}; Ctrl-C ends it")
    if not is_loopback(address):
        click.echo("view: whoever reaches this address can look at them", err=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        server.close()


def found_bags(paths: tuple[Path, ...]) -> dict[str, Path]:
    """Return the bags that paths name, by names for people; of a folder, all in it and below.

    Raises:
        BagError: there is none, or a path does not exist.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += sorted(bag for pattern in _BAGS for bag in path.rglob(pattern))
        elif path.is_file():
            found.append(path)
        else:
            raise BagError(f"{path}: no such bag or folder")
    if not found:
        raise BagError(f"{', '.join(map(str, paths))}: no bag in it: record one, e.g. with `metacontrol run`")
    names: dict[str, Path] = {}
    for path in dict.fromkeys(bag.resolve() for bag in found):
        parts = [part for part in path.with_suffix("").parts if part not in ("/", "mission")]
        length = 1
        while (name := "-".join(parts[-length:])) in names and length < len(parts):
            length += 1
        names[name if name not in names else f"{name}-{len(names)}"] = path
    return names


def _open(path: Path, namespace: str | None) -> Run:
    """Read a bag.

    Raises:
        BagError: it can't be read.
    """
    recording = bags.read_run(path, namespace)
    data = json.dumps(recording.as_dict(), allow_nan=False, separators=(",", ":")).encode()
    export: Callable[[], str] = partial(standalone, recording)
    return Run(data, export, lambda limits: bags.replay(path, limits, namespace))


def _export(paths: tuple[Path, ...], namespace: str | None, target: Path) -> None:
    """Write one run as an HTML file.

    Raises:
        BagError, PageError, OSError: that fails.
    """
    found = found_bags(paths)
    if len(found) > 1:
        raise BagError(f"--export writes one run, and there are {len(found)}: name one bag")
    [path] = found.values()
    write_file(target, standalone(bags.read_run(path, namespace)))
    click.echo(str(target))
