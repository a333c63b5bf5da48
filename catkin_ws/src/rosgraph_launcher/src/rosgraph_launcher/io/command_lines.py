"""Turns the description of a node into the words and the environment that roslaunch would start it with."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import rosgraph
import roslaunch.core
import roslaunch.node_args
import rospkg

from rosgraph_launcher.description import NodeDescription

EXPLAINED = (roslaunch.core.RLException, roslaunch.node_args.NodeParamsException, rospkg.ResourceNotFound, OSError)
"""Errors of roslaunch whose message says what is wrong."""


class CommandLineError(Exception):
    """No command can be made of a description; the message names the node and says why, in one line."""


def command_line(node: NodeDescription) -> tuple[list[str], int]:
    """Return the command line that starts a node, without `__log:=`, and the number of words of its launch-prefix.

    Raises:
        CommandLineError: there is no such package, executable or command of the launch-prefix.
    """
    prefix = node.launch_prefix or ""
    with _refusing(node):
        words = roslaunch.node_args.create_local_process_args(_roslaunch_node(node), roslaunch.core.local_machine())
        bare = roslaunch.node_args._launch_prefix_args(_roslaunch_node(node)) if prefix else []
        if bare and shutil.which(bare[0]) is None:
            raise CommandLineError(
                f"node {node.name}: no command '{bare[0]}', which its launch-prefix names: install it, or correct the "
                "launch-prefix"
            )
        return list(words), len(bare)


def process_environment(node: NodeDescription, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the whole environment of a node's process.

    Raises:
        CommandLineError: it can't be made.
    """
    with _refusing(node):
        return dict(
            roslaunch.core.setup_env(
                _roslaunch_node(node), roslaunch.core.local_machine(), rosgraph.get_master_uri(), env=dict(environment)
            )
        )


def reason(error: BaseException, explained: tuple[type[BaseException], ...] = EXPLAINED) -> str:
    """Return what is wrong, in one line with the remedy.

    Args:
        error: what roslaunch has raised.
        explained: errors whose message says enough. Any other one is named by its class, too.
    """
    text = " ".join(str(error).split())
    if isinstance(error, explained) and text:
        return text
    return f"{type(error).__name__}: {text or 'no reason given'}: correct the launch file"


@contextmanager
def _refusing(node: NodeDescription) -> Iterator[None]:
    """Turn whatever the body raises into a CommandLineError: none of it may end the node that starts others."""
    try:
        yield
    except CommandLineError:
        raise
    except (Exception, SystemExit) as error:
        raise CommandLineError(f"node {node.name}: {reason(error)}") from error


def _roslaunch_node(node: NodeDescription) -> Any:
    return roslaunch.core.Node(
        node.package,
        node.executable,
        name=node.name.rpartition("/")[2],
        namespace=node.namespace,
        args=node.args,
        remap_args=list(node.remaps),
        env_args=list(node.environment),
        output=node.output,
        cwd=node.cwd,
        launch_prefix=node.launch_prefix,
    )
