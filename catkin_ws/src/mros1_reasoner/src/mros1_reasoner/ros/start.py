"""Starts the node reasoner. Pellet's process comes first: it needs longer to be ready than all the rest.

So this imports little. The node's name and parameters are looked up as rospy does it later.
"""

from __future__ import annotations

import os
import sys

import rosgraph
from node_kit.io.xml_rpc import CallError, Client, DeniedError

from mros1_reasoner.knowledge.reasoner import ReasonerError
from mros1_reasoner.pellet.process import PelletReasoner

NAME = "reasoner"  # of the node, and of its parameter
_PELLET = "pellet"  # the default of the parameter; `io.reasoners` has all values, but imports more


def main() -> None:
    """Run the node; exit status 2 when it can't start."""
    early = start_pellet(sys.argv, dict(os.environ))
    _import_genpy_without_numpy()
    from mros1_reasoner.ros.reasoner import run

    run(early)


def start_pellet(arguments: list[str], environment: dict[str, str]) -> PelletReasoner | None:
    """Start Pellet if the node will use it. If it is not sure, or fails, return None: then the node does the rest."""
    try:
        return PelletReasoner() if _named(arguments, environment) == _PELLET else None
    except (CallError, ReasonerError, OSError, ValueError):
        return None


def _import_genpy_without_numpy() -> None:
    """Import genpy as where there is no numpy. It would import that only to know the names of its types.

    That saves 12 MB, and 0.05 s until the node is ready. Others may import numpy afterwards.
    """
    if "numpy" in sys.modules:
        return
    sys.modules["numpy"] = None  # type: ignore[assignment]
    try:
        import genpy  # noqa: F401
    finally:
        del sys.modules["numpy"]


def _named(arguments: list[str], environment: dict[str, str]) -> str:
    """Return the parameter that names the reasoner: of the command line, else of the parameter server.

    Raises:
        CallError, ValueError: the server can't be asked.
    """
    for argument in arguments:
        if argument.startswith(f"_{NAME}:="):
            return argument.partition(":=")[2]
    given = rosgraph.names.load_mappings(arguments)
    namespace = rosgraph.names.get_ros_namespace(environment, arguments)
    name = rosgraph.names.ns_join(namespace, given.get("__name", NAME))
    with Client(rosgraph.get_master_uri(environment, arguments), name) as master:
        try:
            return str(master.call("getParam", rosgraph.names.ns_join(name, NAME)))
        except DeniedError:
            return _PELLET
