"""The graph of nodes and topics as viewers see it: what the master lists beside what the model wants. Pure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from metacontrol_bags import ownership
from metacontrol_msgs.msg import DiagnosticWords as Words
from ros_model.language.metamodel import ConnectionKind
from rosgraph_monitor.graph.names import instance, resolved
from rosgraph_monitor.graph.wiring import desired_links

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from ros_model.graph.snapshot import GraphSnapshot
    from rosgraph_monitor.diagnostics.overview import Row
    from rosgraph_monitor.graph.desired import Desired

Entries = dict[str, dict[str, Any]]

MISSING, HUNG, SILENT, DRIFTED, WRONG, ADDITIONAL, CHANGING, OK = (
    *("missing", "hung", "silent", "drifted", "wrong", "additional", "changing", "ok"),
)
"""States of a node or topic, the worst first."""

_ORDER = (MISSING, HUNG, SILENT, DRIFTED, WRONG, ADDITIONAL, CHANGING, OK)
_STATES = {
    Words.MISSING_NODE: MISSING,
    Words.WRONG_PARAMETER: DRIFTED,
    Words.MISSING_PORT: WRONG,
    Words.ADDITIONAL_PORT: WRONG,
    Words.WRONG_TYPE: WRONG,
    Words.ADDITIONAL_NODE: ADDITIONAL,
    Words.SILENT_TOPIC: SILENT,
    Words.SLOW_TOPIC: SILENT,
    Words.STUCK_TOPIC: SILENT,
}
_HUNG = ("hung", "unreachable")
_TOPICS = (Words.SILENT_TOPIC, Words.SLOW_TOPIC, Words.STUCK_TOPIC)


def graph_entries(
    snapshot: GraphSnapshot, desired: Desired | None, findings: Mapping[tuple[str, str, str], Row], namespace: str = "/"
) -> tuple[Entries, Entries]:
    """Return the entries of nodes and of topics, by their resolved names.

    A node has `state`, `why`, `seen`, `wanted`, and what it publishes, subscribes to, serves. A topic has `type`,
    `state`, `why`, and its ends: `pub`, `sub`, and `wanted_pub`, `wanted_sub` as the model has them. An action is one
    topic.

    Args:
        snapshot: what the master lists.
        desired: the desired model; None where it is not known.
        findings: what the monitor reports, by name, message and first value.
        namespace: of the robot. Nodes of robots with meta-controllers of their own are left out.
    """
    others = ownership.robots_inside(namespace, snapshot.nodes)
    shown = [name for name in snapshot.nodes if not ownership.is_of_another(name, others)]
    if namespace != "/":
        shown = [name for name in shown if name.startswith(f"{namespace.rstrip('/')}/")]
    topics = _topics(snapshot, set(shown))
    wanted, excused = _wanted(snapshot, desired, namespace, topics)
    verdicts = _verdicts(findings, namespace)
    nodes: Entries = {}
    for name in sorted({*shown, *wanted, *(n for n, (state, _) in verdicts.items() if state == MISSING)}):
        node = snapshot.nodes.get(name)
        state, why = verdicts.get(name, (OK, ""))
        if state == OK and name in excused:
            state, why = CHANGING, "its configuration is being changed"
        if node is None and state == OK:
            state, why = MISSING, "the master does not list it"
        nodes[name] = {
            "state": state,
            "why": why,
            "seen": node is not None,
            "wanted": name in wanted,
            "pub": list(node.publications) if node else [],
            "sub": list(node.subscriptions) if node else [],
            "srv": list(node.services) if node else [],
        }
    for name, topic in topics.items():
        state, why = verdicts.get(name, (OK, ""))
        topic["state"], topic["why"] = (state, why) if state == SILENT else (OK, "")
    return nodes, topics


def _topics(snapshot: GraphSnapshot, shown: set[str]) -> Entries:
    """Return topics and actions that have an end among the shown nodes; the five topics of an action are one."""
    parts = {
        f"{action}/{end}" for action in snapshot.actions for end in ("goal", "cancel", "status", "feedback", "result")
    }
    found: Entries = {}
    ends = [(t.name, t.type, t.publishers, t.subscribers) for t in snapshot.topics.values() if t.name not in parts]
    ends += [(a.name, a.type, a.clients, a.servers) for a in snapshot.actions.values()]
    for name, kind, sources, targets in ends:
        pub, sub = ([node for node in side if node in shown] for side in (sources, targets))
        if pub or sub:
            entry = {"type": kind, "pub": pub, "sub": sub, "wanted_pub": [], "wanted_sub": []}
            found[name] = entry | ({"action": True} if name in snapshot.actions else {})
    return found


def _wanted(
    snapshot: GraphSnapshot, desired: Desired | None, namespace: str, topics: Entries
) -> tuple[set[str], set[str]]:
    """Return the wanted nodes, and those that are being changed; add the wanted ends to the topics."""
    if desired is None or desired.system is None:
        return set(), set()

    def running(name: str) -> str:
        return instance(name, snapshot.nodes.keys()) or name

    wanted = {running(resolved(c.graph_name, namespace)) for c in desired.system.components}
    for link in desired_links(snapshot, desired.system, namespace):
        if link.kind is ConnectionKind.SERVICE:
            continue
        is_action = link.kind is ConnectionKind.ACTION
        sources, targets = (link.targets, link.sources) if is_action else (link.sources, link.targets)
        empty: dict[str, Any] = {"type": "", "pub": [], "sub": [], "wanted_pub": [], "wanted_sub": []}
        topic = topics.setdefault(link.name, empty | ({"action": True} if is_action else {}))
        for key, side in (("wanted_pub", sources), ("wanted_sub", targets)):
            topic[key] = sorted({*topic[key], *map(running, side)})
    excused = {running(resolved(name, namespace)) for name in desired.excused}
    return wanted, excused


def _verdicts(findings: Mapping[tuple[str, str, str], Row], namespace: str) -> dict[str, tuple[str, str]]:
    """Return the worst state of each node and topic, and why, by its resolved name."""
    found: dict[str, tuple[str, str]] = {}
    for (name, message, _), row in findings.items():
        state = _STATES.get(message)
        if state is None or name == Words.GRAPH:
            continue
        if state == MISSING and row.values.get("actual") in _HUNG:
            state = HUNG
        place = resolved(name, namespace)
        why = row.values.get("reason") or (row.text if state == DRIFTED else f"{message}: {row.text}")
        if place not in found or _ORDER.index(state) < _ORDER.index(found[place][0]):
            found[place] = state, why
    return found


def entries_of_bag(publishers: Iterable[tuple[str, str, str]], namespace: str = "/") -> tuple[Entries, Entries]:
    """Return nodes and topics as far as a bag tells: who has published what; nobody's subscriptions.

    Args:
        publishers: name of the node, topic and type of each connection in the bag.
        namespace: of the robot.
    """
    nodes: Entries = {}
    topics: Entries = {}
    for node, topic, kind in publishers:
        if not node or (namespace != "/" and not node.startswith(f"{namespace.rstrip('/')}/")):
            continue
        entry = nodes.setdefault(
            node, {"state": OK, "why": "", "seen": True, "wanted": False, "pub": [], "sub": [], "srv": []}
        )
        entry["pub"] = sorted({*entry["pub"], topic})
        found = topics.setdefault(
            topic, {"type": kind, "pub": [], "sub": [], "wanted_pub": [], "wanted_sub": [], "state": OK, "why": ""}
        )
        found["seen_only"] = True
        found["pub"] = sorted({*found["pub"], node})
    return nodes, topics


def judged(
    nodes: Entries, topics: Entries, findings: Mapping[tuple[str, str, str], Row], namespace: str = "/"
) -> tuple[Entries, Entries]:
    """Return nodes and topics of a bag with what the monitor has reported of them; those that are missing are added."""
    verdicts = _verdicts(findings, namespace)
    empty = {"seen": False, "wanted": False, "pub": [], "sub": [], "srv": []}
    missing = {
        name: {"state": MISSING, "why": "", **empty} for name, (state, _) in verdicts.items() if state == MISSING
    }
    found_nodes, found_topics = (
        {
            name: {**entry, **dict(zip(("state", "why"), verdicts.get(name, (OK, "")), strict=True))}
            for name, entry in entries.items()
        }
        for entries in ({**missing, **nodes}, topics)
    )
    return found_nodes, found_topics
