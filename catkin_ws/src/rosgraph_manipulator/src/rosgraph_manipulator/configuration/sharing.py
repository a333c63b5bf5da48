"""Functions that run side by side: which nodes they share, and whether their configurations agree."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from rosgraph_launcher.description import SystemDescription

from rosgraph_manipulator.configuration.difference import read_by_nodes, same_value


def seen_by(
    running: SystemDescription, wanted: SystemDescription, others: Mapping[str, SystemDescription]
) -> SystemDescription:
    """Return what runs, as a change of one function sees it.

    It sees nodes of other functions that the wanted configuration has, too: they need not be started. It does not see
    nodes that another function needs and the wanted configuration lacks: they must not be stopped.

    Args:
        running: what runs for the function that changes.
        wanted: its configuration to deploy.
        others: what runs for each other function, by its name.
    """
    shared = {name: node for system in others.values() for name, node in system.nodes.items()}
    own = {name: node for name, node in running.nodes.items() if name in wanted.nodes or name not in shared}
    found = {name: node for name, node in shared.items() if name in wanted.nodes and name not in own}
    return SystemDescription({**own, **found}, running.parameters)


def disagreement(
    function: str,
    wanted: SystemDescription,
    others: Mapping[str, SystemDescription],
    yielding: Collection[str] = (),
) -> str:
    """Return why a configuration can't run beside other functions, with the remedy; empty where it can.

    A node or a parameter of two functions must be the same in both. Expected quality levels are an exception: no node
    reads them.

    Args:
        function: the function that changes.
        wanted: its configuration to deploy.
        others: what runs for each other function, by its name.
        yielding: those among them whose parameters may be overwritten, because their nodes have read them.
    """
    parameters = read_by_nodes(wanted)
    for other, system in others.items():
        for name, node in system.nodes.items():
            mine = wanted.nodes.get(name)
            if mine is None or not node.package:  # nothing is known of a node without package
                continue
            difference = mine.differs_in(node)
            if difference:
                return (
                    f"node {name} belongs to {function} and {other}, which runs, and differs in "
                    f"{', '.join(difference)}: make it the same in both, or give it another name in one"
                )
        for name, value in () if other in yielding else read_by_nodes(system).items():
            if name in parameters and not same_value(parameters[name], value):
                return (
                    f"parameter {name} is {parameters[name]!r} for {function} and {value!r} for {other}, which runs: "
                    "make it the same in both"
                )
    return ""
