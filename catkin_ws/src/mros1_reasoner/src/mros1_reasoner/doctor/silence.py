"""Periodic topics whose silence nobody would notice, and how to have them watched. Pure.

Like the master, the monitor knows who publishes, and not whether messages arrive. It watches a topic only if the
project asks for that, because a topic that is silent may be all right: a latched one, or one of events. So what is
proposed here was seen to come regularly.
"""

from __future__ import annotations

import statistics
from itertools import pairwise
from typing import TYPE_CHECKING

from ros_model.language.metamodel import PortKind
from rosgraph_monitor.graph.names import relative, resolved
from rosgraph_monitor.health.topics import model_topics

from mros1_reasoner.doctor.complaints import Complaint, managed_nodes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ros_model.language.metamodel import RosSystem
    from ros_model.project.project import Project

    from mros1_reasoner.doctor.facts import SystemFacts

_FEWEST = 5
"""Messages from which on a topic can be called periodic."""
_LONGEST = 3.0
"""Median intervals that the longest one of a periodic topic may take: transport and busy hosts make it uneven."""
_PERIODS, _SHORTEST = 10.0, 1.0
"""The proposed limit: so many periods, and at least so many s, so that a busy host raises no alarm."""
_OF_ACTIONS = ("/goal", "/cancel", "/status", "/feedback", "/result", "/parameter_updates", "/parameter_descriptions")


def unwatched_topics(project: Project, system: SystemFacts) -> dict[str, str]:
    """Return the topics whose silence nobody would notice, by resolved name, and the node that publishes each.

    One node of the models publishes such a topic, and another one needs it. A topic of a node that variants bring
    counts only if each variant has it: the monitor would miss it while another one is deployed.
    """
    watched = {str(entry["topic"]).strip("/") for entry in project.components.values() if "topic" in entry}
    for model in (project.base, *project.variants):
        watched |= model_topics(model).keys()
    found = {}
    for topic, state in system.snapshot.topics.items():
        name = relative(topic, system.namespace)
        nodes = {relative(node, system.namespace) for node in state.publishers if node not in system.dead}
        others = {relative(node, system.namespace) for node in state.subscribers if node not in system.dead} - nodes
        node = nodes.pop() if len(nodes) == 1 else None
        if name is None or node is None or name in watched or topic.endswith(_OF_ACTIONS):
            continue
        if others & _modelled(project) and _is_always_there(project, node, name):
            found[topic] = node
    return found


def silence_complaints(project: Project, system: SystemFacts) -> Iterator[Complaint]:
    """Yield a note about each topic that has come regularly and is not watched."""
    components = {str(entry["node"]).strip("/"): name for name, entry in project.components.items() if "node" in entry}
    for topic, node in sorted(unwatched_topics(project, system).items()):
        period = period_of(system.arrivals.get(topic, ()))
        if period is None:
            continue
        limit = max(_SHORTEST, round(_PERIODS * period, 1))
        name, publisher = relative(topic, system.namespace), resolved(node, system.namespace)
        entry = f"{components.get(node, node)}: {{node: {node}, topic: {name}, max_age: {limit}}}"
        yield Complaint(
            topic,
            f"comes every {period:.2g} s, and nobody would notice its silence while {publisher} runs",
            f"if it always comes, write under `components` of metacontrol.yaml: {entry}",
            is_note=True,
        )


def period_of(arrivals: Sequence[float]) -> float | None:
    """Return the period of a topic, s, from the times at which messages came; None: it is not periodic."""
    if len(arrivals) < _FEWEST:
        return None
    intervals = [later - earlier for earlier, later in pairwise(arrivals)]
    usual = statistics.median(intervals)
    if usual <= 0.0 or max(intervals) > _LONGEST * usual:
        return None
    return statistics.fmean(intervals)


def _modelled(project: Project) -> frozenset[str]:
    base = (component.graph_name for component in project.base.components)
    return frozenset(base) | managed_nodes(project)


def _is_always_there(project: Project, node: str, topic: str) -> bool:
    """Return whether the node is one of the models and publishes the topic, whatever is deployed."""
    with_node = [variant for variant in project.variants if any(c.graph_name == node for c in variant.components)]
    if not with_node:
        return topic in _published(project.base, node)
    return len(with_node) == len(project.variants) and all(topic in _published(v, node) for v in with_node)


def _published(system: RosSystem, node: str) -> set[str]:
    return {
        name.strip("/")
        for component in system.components
        if component.graph_name == node
        for port in component.ports
        if port.kind is PortKind.PUBLISHER
        for name in (port.name, component.resolved(port.name))
    }
