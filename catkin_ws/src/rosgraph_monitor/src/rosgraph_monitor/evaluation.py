"""One evaluation of the monitor: snapshot, liveness and desired system in, statuses out. Pure; time is an argument."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ros_model.language.metamodel import PortKind

from rosgraph_monitor.diagnostics.status import Status, graph_ok, graph_problem
from rosgraph_monitor.graph.comparison import NOT_REGISTERED, Scope, compare, running_nodes, wrong_topic_types
from rosgraph_monitor.graph.findings import Finding, MissingNode, finding_statuses
from rosgraph_monitor.graph.names import instance, instances, relative, resolved
from rosgraph_monitor.graph.settling import Look, Settling
from rosgraph_monitor.health.components import (
    DEFAULT_RECOVERY,
    ComponentStatus,
    ComponentTracker,
    NodeCondition,
    component_statuses,
)
from rosgraph_monitor.health.liveness import Life
from rosgraph_monitor.health.topics import TopicVerdict, verdict_statuses

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from ros_model.graph.snapshot import GraphSnapshot
    from ros_model.language.metamodel import RosSystem

    from rosgraph_monitor.graph.desired import Desired

_CONDITION = {Life.ALIVE: NodeCondition.ALIVE, Life.UNKNOWN: NodeCondition.UNKNOWN}
_ENDED = "ended", "ended: it has unregistered from the master"
_SHORTEST_GRACE = 3.0
"""Wall s in which what the monitor has never seen may come up in a system that started long ago."""


@dataclass(frozen=True)
class Patience:
    """How long the monitor waits, in wall s, before it reports something that may still change.

    Attributes:
        startup: in which an expected node may come up after the start of the system, complete its interfaces and set
            its parameters, and in which the monitor itself may learn what is deployed.
        restart: in which the manipulator may announce that it restarts a variant's node, before that node's death is
            reported. Deaths of the base's nodes are reported at once.
        ports: for which a difference in interfaces must last: nodes connect one after the other.
        recovery: for which a component that works again is RECOVERED, so that slow readers see it.
    """

    startup: float = 10.0
    restart: float = 1.0
    ports: float = 1.0
    recovery: float = DEFAULT_RECOVERY

    def grace(self, head_start: float) -> float:
        """Return for how long nodes may come up, and topics bring a first message, s from the monitor's own start.

        Args:
            head_start: for how long the system had run then, wall s. A monitor that takes another's place does not wait
                long for what was there before.
        """
        return max(self.startup - head_start, min(self.startup, _SHORTEST_GRACE))


class GraphEvaluator:
    """Evaluates the graph, and remembers earlier evaluations."""

    def __init__(
        self,
        component_of: Mapping[str, str],
        *,
        scope: Scope | None = None,
        patience: Patience = Patience(),
    ) -> None:
        """Start with nothing known.

        Args:
            component_of: component by name of the node (relative to the namespace).
            scope: what is compared; the usual, in the root namespace, if None.
            patience: what is waited for.
        """
        self._component_of = dict(component_of)
        self._scope = scope or Scope()
        self._patience = patience
        self._tracker = ComponentTracker(component_of, patience.startup, patience.recovery)
        self._settling = Settling(patience.startup, patience.ports)
        self._gone: dict[str, tuple[str, str]] = {}  # how each node that is missing has gone
        self._missing: dict[str, tuple[str, str]] = {}  # the same of the nodes that were told to be missing last
        self._publisher: dict[str, str] = {}
        self._reasons: dict[str, str] = {}  # why each component that has failed has done so
        self._last: tuple[tuple[Any, ...], Look] | None = None

    def evaluate(
        self,
        snapshot: GraphSnapshot,
        lives: Mapping[tuple[str, str], Life],
        desired: Desired,
        now: float,
        *,
        topics: Sequence[TopicVerdict] = (),
        others: Mapping[str, NodeCondition] | None = None,
        reasons: Mapping[str, str] | None = None,
        is_fresh: bool = True,
        grace: float | None = None,
        problem: str = "",
    ) -> list[Status]:
        """Judge the graph.

        Args:
            snapshot: what the master lists.
            lives: what is known of each node, by name and address.
            desired: what should run.
            now: wall seconds.
            topics: what is wrong with topics.
            others: conditions of components that other things than nodes and topics tell, by name of the component.
            reasons: why such a component has failed, by its name.
            is_fresh: whether the snapshot is newer than what is known of the nodes. Else a node that seems dead may
                have unregistered since, so that the next evaluation says that it has ended.
            grace: wall s in which expected nodes may come up, where it is not the usual time (see `Patience.grace`).
            problem: why a part of the snapshot is older than the rest; empty if all is well.

        Returns:
            The statuses of components, then the findings, or "running OK" where there are none.
        """
        life = {name: lives.get((name, node.uri), Life.UNKNOWN) for name, node in snapshot.nodes.items()}
        dead = {name: (known.name.lower(), known.value) for name, known in life.items() if known not in _CONDITION}
        running = self._instances(desired, life.keys() - dead.keys())
        gone = self._instances(desired, dead.keys())
        conditions = self._conditions(life, desired, running)
        self._add_others(conditions, others or {})
        owners = {node: name for name, node in (*gone.items(), *running.items())}
        self._add_topics(conditions, snapshot, life, topics, owners)
        for idle in desired.idle_nodes:
            conditions.pop(idle, None)
        components = self._tracker.update(
            conditions,
            now,
            excused=desired.excused,
            patience=dict.fromkeys(desired.variant_nodes, self._patience.restart),
            grace=grace,
        )
        failed = [name for name, status in components if status is ComponentStatus.FALSE]
        ways = {name: dead[node] for name, node in gone.items()}
        found = {name: self._why(name, conditions, ways, topics, reasons or {}, is_fresh) for name in failed}
        self._reasons = {name: why for name in failed if (why := found[name] or self._reasons.get(name))}
        statuses = component_statuses(components, self._reasons)
        troubles = [f"desired model: {desired.problem}"] * bool(desired.problem) + [problem] * bool(problem)
        statuses.extend(map(graph_problem, troubles))
        unheard = {name: node for name, node in running.items() if life[node] is Life.UNKNOWN}
        findings = self._findings(snapshot, dead | self._still_missing(unheard), desired, now, is_fresh)
        problems = [*finding_statuses(findings, desired.configurations_of), *verdict_statuses(topics)]
        statuses.extend(problems)
        if desired.system is not None and not problems and not troubles:
            statuses.append(graph_ok())
        return statuses

    def excused_topics(self, snapshot: GraphSnapshot, desired: Desired, topics: Iterable[str]) -> frozenset[str]:
        """Return the topics that only nodes publish that are under reconfiguration or whose functions are idle."""
        quiet = desired.excused | desired.idle_nodes
        if not (quiet or desired.idle_topics):
            return frozenset()
        components = (*(desired.system.components if desired.system else ()), *desired.idle)
        modelled: dict[str, set[str]] = {}
        for component in components:
            for port in component.ports:
                if port.kind is PortKind.PUBLISHER:
                    modelled.setdefault(port.name.strip("/"), set()).add(component.graph_name)
        expected = (*(component.graph_name for component in components), *quiet)
        names = {resolved(name, self._scope.namespace): name for name in expected}
        found = set()
        for topic in topics:
            publishers = self._publishers(snapshot, topic)
            owners = {node: names[name] for name, node in instances(names, publishers).items()}
            nodes = {owners.get(node) or self._relative(node) for node in publishers} | modelled.get(topic, set())
            if nodes <= quiet if nodes else topic in desired.idle_topics:
                found.add(topic)
        return frozenset(found)

    def _findings(
        self,
        snapshot: GraphSnapshot,
        dead: dict[str, tuple[str, str]],
        desired: Desired,
        now: float,
        is_fresh: bool,
    ) -> list[Finding]:
        if desired.system is None:
            return [*wrong_topic_types(snapshot, self._scope.topic_types, self._scope.namespace)]
        excused = desired.excused | self._tracker.waited_for
        look = self._look(snapshot, desired.system, dead, excused, desired.idle_nodes)
        findings = [self._worded(finding, is_fresh) for finding in self._settling.told(look, now)]
        self._missing = {one.node: (one.state, one.reason) for one in findings if isinstance(one, MissingNode)}
        return findings

    def _still_missing(self, unheard: Mapping[str, str]) -> dict[str, tuple[str, str]]:
        """Return how nodes have gone in whose place others are registered that were not heard yet: they may die, too.

        `unheard` has the nodes that were not heard by the names of those that are expected.
        """
        return {node: self._missing[name] for name, node in unheard.items() if name in self._missing}

    def _look(
        self,
        snapshot: GraphSnapshot,
        system: RosSystem,
        dead: dict[str, tuple[str, str]],
        excused: frozenset[str],
        idle: frozenset[str],
    ) -> Look:
        """Compare the graph if something has changed since the last time: mostly, nothing has."""
        if self._last is not None:
            (last_snapshot, last_system, *last), look = self._last
            if last_snapshot is snapshot and last_system is system and last == [dead, excused]:
                return look
        findings = compare(snapshot, system, dead=dead, excused=excused, idle=idle, scope=self._scope)
        running = running_nodes(snapshot, system, dead.keys(), self._scope.namespace)
        processes = {name: node.uri for name, node in running.items()}
        look = Look(findings, processes, frozenset(processes) - excused, system)
        self._last = (snapshot, system, dead, excused), look
        return look

    def _worded(self, finding: Finding, is_fresh: bool) -> Finding:
        """Return the finding with the reason: the node has ended, has died, or never came."""
        if not isinstance(finding, MissingNode):
            return finding
        return MissingNode(finding.node, *self._how_gone(finding.node, (finding.state, finding.reason), is_fresh))

    def _how_gone(self, node: str, found: tuple[str, str], is_fresh: bool) -> tuple[str, str]:
        """Return state and reason of a node that is missing, given those that the graph alone tells."""
        if found == NOT_REGISTERED and self._tracker.has_run(node):
            return self._gone.get(node, _ENDED)
        if found != NOT_REGISTERED and is_fresh:
            self._gone[node] = found
        return found

    def _why(
        self,
        component: str,
        conditions: Mapping[str, NodeCondition],
        ways: Mapping[str, tuple[str, str]],
        topics: Sequence[TopicVerdict],
        reasons: Mapping[str, str],
        is_fresh: bool,
    ) -> str:
        """Return why a component has failed, without figures that change all the time; empty: as before."""
        key = self._key_of(component)
        if conditions.get(key) is NodeCondition.GONE:
            _, reason = self._how_gone(key, ways.get(key, NOT_REGISTERED), is_fresh)
            return reason if key == component else f"node {key}: {reason}"
        if conditions.get(key) is not NodeCondition.FAILED:
            return ""
        owners = ((verdict, verdict.spec.component or self._publisher.get(verdict.spec.name)) for verdict in topics)
        bad = (verdict for verdict, owner in owners if verdict.message and owner in (component, key))
        told = [f"{verdict.message} {verdict.spec.name} ({_limit(verdict)})" for verdict in bad]
        return "; ".join([*told, *([reasons[component]] if component in reasons else [])])

    def _instances(self, desired: Desired, nodes: Collection[str]) -> dict[str, str]:
        """Return which of the nodes stand for which expected ones, by the names of the latter.

        Settings may call a node by the beginning of the anonymous name that the model has.
        """
        names = {resolved(name, self._scope.namespace): name for name in self._modelled(desired)}
        found = {names[name]: node for name, node in instances(names, nodes).items()}
        for name in self._component_of.keys() - names.values():
            if node := instance(resolved(name, self._scope.namespace), nodes):
                found[name] = node
        return found

    @staticmethod
    def _modelled(desired: Desired) -> list[str]:
        return [component.graph_name for component in (desired.system.components if desired.system else ())]

    def _conditions(
        self, life: Mapping[str, Life], desired: Desired, running: Mapping[str, str]
    ) -> dict[str, NodeCondition]:
        conditions = {}
        for name in dict.fromkeys((*self._modelled(desired), *self._component_of)):
            condition = self._condition(life[running[name]]) if name in running else NodeCondition.GONE
            conditions[name] = condition
            if condition is NodeCondition.ALIVE:
                self._gone.pop(name, None)
        return conditions

    def _add_others(self, conditions: dict[str, NodeCondition], others: Mapping[str, NodeCondition]) -> None:
        """Add components that have no node. One that has has failed if either says so."""
        for component, condition in others.items():
            key = self._key_of(component)
            is_worse = condition is NodeCondition.FAILED and conditions.get(key) is not NodeCondition.GONE
            if key not in conditions or is_worse:
                conditions[key] = condition

    def _key_of(self, component: str) -> str:
        """Return the node of a component, or the component itself where it has none."""
        return next((node for node, name in self._component_of.items() if name == component), component)

    def _add_topics(
        self,
        conditions: dict[str, NodeCondition],
        snapshot: GraphSnapshot,
        life: Mapping[str, Life],
        topics: Sequence[TopicVerdict],
        owners: Mapping[str, str],
    ) -> None:
        """Mark the component of a bad topic as failed: the component that is named, else that of the publisher.

        `owners` has the names of the nodes that are expected, by those of the nodes that stand for them.
        """
        for verdict in topics:
            topic, component = verdict.spec.name, verdict.spec.component
            nodes = self._publishers(snapshot, topic)
            if len(nodes) == 1:
                self._publisher[topic] = owners.get(nodes[0]) or self._relative(nodes[0])
            if component:
                key = self._key_of(component)
                conditions.setdefault(key, NodeCondition.ALIVE if verdict.heard else NodeCondition.UNKNOWN)
            elif topic in self._publisher:
                key = self._publisher[topic]
                conditions.setdefault(key, self._condition(life.get(resolved(key, self._scope.namespace))))
            else:
                continue
            if verdict.message and conditions[key] in (NodeCondition.ALIVE, NodeCondition.UNKNOWN):
                conditions[key] = NodeCondition.FAILED

    def _condition(self, known: Life | None) -> NodeCondition:
        return NodeCondition.GONE if known is None else _CONDITION.get(known, NodeCondition.GONE)

    def _publishers(self, snapshot: GraphSnapshot, topic: str) -> tuple[str, ...]:
        state = snapshot.topics.get(resolved(topic, self._scope.namespace))
        return state.publishers if state else ()

    def _relative(self, node: str) -> str:
        return relative(node, self._scope.namespace) or node


def _limit(verdict: TopicVerdict) -> str:
    """Return the limit that a topic breaks."""
    return "no message yet" if verdict.actual == "none" else verdict.expected
