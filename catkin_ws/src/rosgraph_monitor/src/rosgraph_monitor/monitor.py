"""One evaluation of the monitor: snapshot, liveness and desired system in, statuses out. Pure; time is an argument."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rosgraph_monitor.comparison import DEFAULT_IGNORED, compare, finding_statuses, resolved
from rosgraph_monitor.components import ComponentTracker, NodeCondition, component_statuses
from rosgraph_monitor.liveness import Life
from rosgraph_monitor.status import Status, graph_ok, graph_problem

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from ros_model.snapshot import GraphSnapshot

    from rosgraph_monitor.desired import Desired

_CONDITION = {Life.ALIVE: NodeCondition.ALIVE, Life.UNKNOWN: NodeCondition.UNKNOWN}


class GraphMonitor:
    """Judges the graph, evaluation after evaluation."""

    def __init__(
        self,
        component_of: Mapping[str, str],
        *,
        ignored: Iterable[str] = DEFAULT_IGNORED,
        namespace: str = "/",
        startup_grace: float = 10.0,
        restart_patience: float = 1.0,
    ) -> None:
        """Start with nothing known.

        Args:
            component_of: component by name of the node (relative to the namespace).
            ignored: patterns of names of nodes that may run beside the model.
            namespace: where the system lives.
            startup_grace: wall seconds in which an expected node may come up for the first time.
            restart_patience: wall seconds in which the manipulator may announce that it restarts a variant's node,
                before that node's death is reported. Deaths of the base's nodes are reported at once.
        """
        self._component_of = dict(component_of)
        self._ignored = tuple(ignored)
        self._namespace = namespace
        self._patience = restart_patience
        self._tracker = ComponentTracker(component_of, startup_grace)

    def evaluate(
        self, snapshot: GraphSnapshot, lives: Mapping[tuple[str, str], Life], desired: Desired, now: float
    ) -> list[Status]:
        """Judge the graph.

        Args:
            snapshot: what the master lists.
            lives: what is known of each node, by name and address.
            desired: what should run.
            now: wall seconds.

        Returns:
            The statuses of components, then the findings, or "running OK" where there are none.
        """
        life = {name: lives.get((name, node.uri), Life.UNKNOWN) for name, node in snapshot.nodes.items()}
        dead = {name: known.value for name, known in life.items() if known not in _CONDITION}
        components = self._tracker.update(
            self._conditions(life, desired),
            now,
            excused=desired.excused,
            patience=dict.fromkeys(desired.variant_nodes, self._patience),
        )
        statuses = component_statuses(components)
        if desired.problem:
            statuses.append(graph_problem(f"desired model: {desired.problem}"))
        if desired.system is not None:
            findings = compare(
                snapshot,
                desired.system,
                dead=dead,
                excused=desired.excused | self._tracker.waited_for,
                ignored=(*self._ignored, *self._component_of),
                namespace=self._namespace,
            )
            statuses.extend(finding_statuses(findings))
            if not findings and not desired.problem:
                statuses.append(graph_ok())
        return statuses

    def _conditions(self, life: Mapping[str, Life], desired: Desired) -> dict[str, NodeCondition]:
        expected = dict.fromkeys(
            component.graph_name for component in (desired.system.components if desired.system else ())
        )
        expected |= dict.fromkeys(self._component_of)
        conditions = {}
        for name in expected:
            known = life.get(resolved(name, self._namespace))
            conditions[name] = NodeCondition.GONE if known is None else _CONDITION.get(known, NodeCondition.GONE)
        return conditions
