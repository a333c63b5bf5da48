"""`rosmodel snapshot`: models of the system that runs now."""

from __future__ import annotations

import datetime
import os
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import click
from ros_model.cli.ranges import timeout_option
from ros_model.errors import ModelError
from ros_model.language.packages import OBSERVED

if TYPE_CHECKING:
    from ros_model.language.library import Library

    from ros_model_extraction.running.graph import Models

_MASTER = "http://localhost:11311"


@click.command()
@click.option("-o", "--output", default=".", metavar="FOLDER", help="Where the two files go; made if it is missing.")
@click.option("--master", metavar="URI", help=f"Address of the ROS master; else $ROS_MASTER_URI, else {_MASTER}.")
@click.option("--name", default="snapshot", show_default=True, help="Name of the system and of the files.")
@timeout_option("Patience with the master and each node.")
@click.option("--all", "everything", is_flag=True, help="Leave nothing out: /rosout, ~get_loggers, ...")
def snapshot(output: str, master: str | None, name: str, timeout: float, everything: bool) -> None:
    """Write NAME.ros and NAME.rossystem of the running system.

    Nodes, topics, services, actions, parameters and connections are those that the master lists. What can't be known,
    and what is left out, is said in comments at the top of the files. Models from source that are in the FOLDER tell
    which name in the code a remapping is for: run `rosmodel extract` first.
    """
    from ros_model.io.models import read_sources  # imported when asked for

    from ros_model_extraction.io.output import write_models

    uri = _checked_address(master or os.environ.get("ROS_MASTER_URI") or _MASTER)
    sources, unread = read_sources(Path(output))
    for error in unread:
        click.echo(f"rosmodel: {error}: names are not looked up there", err=True)
    models = _models(uri, name, timeout, everything, sources)
    nodes = len(models.system.components)
    for path in write_models(models, output, name):
        click.echo(f"wrote {path}")
    click.echo(f"{nodes} node{'s' * (nodes != 1)}, {len(models.system.connections)} connections")


def _checked_address(uri: str) -> str:
    try:
        parts = urlsplit(uri)
        is_address = parts.scheme == "http" and bool(parts.hostname) and parts.port != 0
    except ValueError:  # a port that is none
        is_address = False
    if not is_address:
        raise ModelError(f"{uri!r} is no address of a ROS master: give one like {_MASTER} with --master")
    return uri


def _models(uri: str, name: str, timeout: float, everything: bool, sources: Library) -> Models:
    from node_kit.io.xml_rpc import CallError, GoneError
    from ros_model.io.master import take_snapshot

    from ros_model_extraction.io.live_nodes import ask_nodes
    from ros_model_extraction.running.graph import models_of

    try:
        graph = take_snapshot(uri, timeout)
    except GoneError as error:
        raise ModelError(f"ROS master {uri} can't be reached: start the system, or set --master") from error
    except CallError as error:
        raise ModelError(f"{error}: start the system, or set --master") from error
    stamp = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    title = f"The running system of the ROS master {uri}, {stamp}. {OBSERVED}"
    return models_of(graph, ask_nodes(graph, uri, timeout), name, [title], everything=everything, sources=sources)
