"""What the commands share: the console, an option, and the refusal of bad input."""

from __future__ import annotations

import sys
from typing import NoReturn

import click
from node_kit.parameters import ParameterError
from rich.console import Console
from ros_model.errors import ModelError

from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.replay.recording import RecordingError

ERRORS = (RecordingError, ParameterError, KnowledgeBaseError, ModelError, ReasonerError, ValueError, OSError)
"""Errors that are told in one line."""

NAMESPACE = click.option("--namespace", help="Of the reasoner, where the bag holds several.")

_REFUSED = 2  # exit status
_WIDTH = 150  # characters, where the output is no terminal


def console() -> Console:
    """Return the console; for a file or a pipe, it is as wide as a table needs."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH)


def refuse(command: str, error: Exception) -> NoReturn:
    """Say in one line what is wrong, and end with status 2."""
    click.echo(f"{command}: {' '.join(str(error).split())}", err=True)
    sys.exit(_REFUSED)
