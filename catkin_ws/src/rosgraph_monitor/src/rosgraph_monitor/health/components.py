"""Status of components over time, from the state of nodes and topics. Pure; time is an argument."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from metacontrol_msgs.msg import DiagnosticWords as Words
from node_kit.parameters import named_entries

from rosgraph_monitor.diagnostics.status import Level, Status
from rosgraph_monitor.health.battery import BatterySpec
from rosgraph_monitor.health.topics import DEFAULT_MAX_AGE, TopicSpec, parse_spec

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping


DEFAULT_RECOVERY = 2.5
"""Wall s for which a recovery is told: the published reasoner looks at what it was told every 2 s."""


class ComponentStatus(enum.Enum):
    """Values of c_status in the vocabulary."""

    TRUE = Words.COMPONENT_TRUE
    FALSE = Words.COMPONENT_FALSE
    RECOVERED = Words.COMPONENT_RECOVERED


class NodeCondition(enum.Enum):
    """The present condition of a node. FAILED: it runs, but does not work as it should."""

    ALIVE = "alive"
    GONE = "gone"
    FAILED = "failed"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class _Seen:
    """History of a node.

    Attributes:
        absent_since: since when it is absent; None: it runs.
        ever_alive: whether it ever ran.
        failed: whether FALSE was said, and nothing since then.
        is_replaced: whether it has been reconfigured since then: what is true of its predecessor tells nothing of it.
        recovered_at: when it came back; None: not lately.
    """

    absent_since: float | None
    ever_alive: bool = False
    failed: bool = False
    is_replaced: bool = False
    recovered_at: float | None = None


@dataclass(frozen=True)
class ComponentMap:
    """Which nodes, topics and batteries stand for components.

    Attributes:
        of_node: component by name of the node, relative to the system's namespace.
        topics: what is expected of topics that stand for components, by name of the topic.
        batteries: batteries that stand for components.
        driver_statuses: component -> name of its driver's status on /diagnostics.
    """

    of_node: dict[str, str] = field(default_factory=dict)
    topics: dict[str, TopicSpec] = field(default_factory=dict)
    batteries: tuple[BatterySpec, ...] = ()
    driver_statuses: dict[str, str] = field(default_factory=dict)


def parse_components(value: Any) -> ComponentMap:
    """Return what stands for each component.

    An entry is `{node: NAME}`, `{topic: NAME, max_age: S, min_rate: HZ, stuck_after: N}` (limits as one likes),
    `{diagnostic: NAME}`, several of these in one, or `{topic: NAME, below: CHARGE, above: CHARGE}` for a battery.

    Raises:
        ValueError: the value has another shape; the message names the entry.
    """
    if not isinstance(value, dict):
        raise ValueError(f"components: must map each component to {{node: NAME}} or {{topic: NAME}}, not {value!r}")
    of_node, topics, batteries, driver_statuses = {}, {}, [], {}
    for component, entry in named_entries(value):
        settings = dict(entry) if isinstance(entry, dict) else {}
        node, topic, diagnostic = (settings.pop(key, None) for key in ("node", "topic", "diagnostic"))
        names = [name for name in (node, topic, diagnostic) if name is not None]
        if not names or not all(isinstance(name, str) and name.strip("/ ") for name in names):
            kinds = "{node: NAME}, {topic: NAME} or {diagnostic: NAME}"
            raise ValueError(f"components/{component}: must be {kinds}, not {entry!r}")
        if diagnostic:
            driver_statuses[str(component)] = diagnostic.strip().lstrip("/")
        if node:
            of_node[node.strip("/")] = str(component)
        if topic and settings.keys() & {"below", "above"}:
            batteries.append(_battery(str(component), topic, settings))
        elif topic:
            spec = parse_spec(topic, settings | {"component": str(component)}, where=f"components/{component}")
            topics[spec.name] = (
                spec
                if spec.is_watched
                else TopicSpec(
                    spec.name, spec.type, max_age=DEFAULT_MAX_AGE, component=spec.component, wall_time=spec.wall_time
                )
            )
        elif settings:
            raise ValueError(f"components/{component}: {', '.join(map(str, settings))} need a topic")
    return ComponentMap(of_node, topics, tuple(batteries), driver_statuses)


def _battery(component: str, topic: str, settings: dict[str, Any]) -> BatterySpec:
    below, above = settings.pop("below", None), settings.pop("above", None)
    above = below if above is None else above
    good = all(isinstance(v, (int, float)) and not isinstance(v, bool) and math.isfinite(v) for v in (below, above))
    if settings or not good or not 0.0 < below <= above <= 1.0:
        raise ValueError(f"components/{component}: a battery has topic, below and above, with 0 < below <= above <= 1")
    return BatterySpec(component, topic, float(below), float(above))


class ComponentTracker:
    """Follows nodes, and derives the status of their components.

    A node that ran and went has failed at once, unless somebody may restart it (it has patience then); one that never
    ran, after a grace; one that runs but does not do what it should, at once. A node that is excused (being
    reconfigured) is not judged; if it had failed before and runs afterwards, it has recovered. A recovery is told for
    a while, so that a reader that looks once in a second or two does not miss it.
    """

    def __init__(
        self, component_of: Mapping[str, str], grace: float = 10.0, recovery: float = DEFAULT_RECOVERY
    ) -> None:
        """Start with nothing known.

        Args:
            component_of: component of each node, by name of the node; others bear their node's name.
            grace: wall seconds in which an expected node may come up for the first time.
            recovery: wall seconds for which RECOVERED is told, and not yet TRUE.
        """
        self._component_of = dict(component_of)
        self._grace, self._recovery = grace, recovery
        self._seen: dict[str, _Seen] = {}
        self._waited_for: frozenset[str] = frozenset()

    @property
    def waited_for(self) -> frozenset[str]:
        """Nodes that are absent but not failed yet, as of the last update."""
        return self._waited_for

    def has_run(self, name: str) -> bool:
        """Return whether an expected node was seen alive, as of the last update."""
        return name in self._seen and self._seen[name].ever_alive

    def update(
        self,
        conditions: Mapping[str, NodeCondition],
        now: float,
        excused: Collection[str] = (),
        patience: Mapping[str, float] | None = None,
        grace: float | None = None,
    ) -> list[tuple[str, ComponentStatus]]:
        """Take in what is known of the expected nodes.

        Args:
            conditions: of each expected node; nodes that are no longer expected are forgotten.
            now: wall seconds.
            excused: nodes that are not judged now.
            patience: wall seconds by node for which its absence is no failure yet; 0 for those not given.
            grace: that of this moment, where it is not the usual one.

        Returns:
            Status of each component that is judged now.
        """
        statuses = []
        waited_for = []
        seen = {}
        for name, condition in conditions.items():
            before = self._seen.get(name, _Seen(absent_since=now))
            if name in excused:
                # The wait for a first sign of life begins when the excuse ends.
                seen[name] = _Seen(now, before.ever_alive, before.failed, is_replaced=before.failed)
                continue
            wait = (patience or {}).get(name, 0.0) if before.ever_alive else self._grace if grace is None else grace
            seen[name], status = self._judge(before, condition, now, wait)
            if status:
                statuses.append((self._component_of.get(name, name), status))
            elif condition is NodeCondition.GONE:
                waited_for.append(name)
        self._seen = seen
        self._waited_for = frozenset(waited_for)
        return statuses

    def _judge(
        self, before: _Seen, condition: NodeCondition, now: float, wait: float
    ) -> tuple[_Seen, ComponentStatus | None]:
        if condition is NodeCondition.ALIVE:
            back = now if before.failed else before.recovered_at
            is_told = back is not None and now - back <= self._recovery
            seen = _Seen(None, ever_alive=True, recovered_at=back if is_told else None)
            return seen, ComponentStatus.RECOVERED if is_told else ComponentStatus.TRUE
        if before.failed and not before.is_replaced:
            return before, ComponentStatus.FALSE
        if condition is NodeCondition.UNKNOWN:
            return before, None
        if condition is NodeCondition.FAILED:
            return _Seen(now, ever_alive=True, failed=True), ComponentStatus.FALSE
        since = now if before.absent_since is None else before.absent_since
        if now - since >= wait:
            return _Seen(since, before.ever_alive, failed=True), ComponentStatus.FALSE
        return replace(before, absent_since=since), None


def component_statuses(
    components: Iterable[tuple[str, ComponentStatus]], reasons: Mapping[str, str] | None = None
) -> list[Status]:
    """Return the statuses of components in the published form.

    Args:
        components: name and status of each.
        reasons: why a component has failed, by its name.
    """
    why = reasons or {}
    return [
        Status(
            Level.ERROR if status is ComponentStatus.FALSE else Level.OK,
            component,
            Words.COMPONENT_STATUS,
            ((component, status.value), *(((Words.REASON, why[component]),) if component in why else ())),
        )
        for component, status in components
    ]
