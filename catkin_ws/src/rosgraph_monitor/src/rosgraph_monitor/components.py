"""Status of components: what the liveness of nodes means for them, over time. Pure; time is an argument."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rosgraph_monitor.status import COMPONENT_STATUS, Level, Status

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping


class ComponentStatus(enum.Enum):
    """Values of c_status in the vocabulary."""

    TRUE = "TRUE"
    FALSE = "FALSE"
    RECOVERED = "RECOVERED"


class NodeCondition(enum.Enum):
    """What is known of a node at this moment."""

    ALIVE = "alive"
    GONE = "gone"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class _Seen:
    """History of a node: absent since when (None: it runs), whether it ever ran, whether FALSE was said."""

    absent_since: float | None
    ever_alive: bool = False
    failed: bool = False


def parse_mapping(value: Any) -> dict[str, str]:
    """Return the component of each node, from `{component: {node: NAME}}`.

    Raises:
        ValueError: the value has another shape; the message names the entry.
    """
    if not isinstance(value, dict):
        raise ValueError(f"components: must map each component to {{node: NAME}}, not {value!r}")
    mapping = {}
    for component, entry in value.items():
        match entry:
            case {"node": str(node)} if node.strip("/"):
                mapping[node.strip("/")] = str(component)
            case _:
                raise ValueError(f"components/{component}: must be {{node: NAME}}, not {entry!r}")
    return mapping


class ComponentTracker:
    """Follows nodes, and says what becomes of their components.

    A node that ran and went has failed at once, unless somebody may restart it (it has patience then); one that never
    ran, after a grace. A node that is excused (being reconfigured) is not judged; if it had failed before and runs
    afterwards, it has recovered.
    """

    def __init__(self, component_of: Mapping[str, str], grace: float = 10.0) -> None:
        """Start with nothing known.

        Args:
            component_of: component of each node, by name of the node; others bear their node's name.
            grace: wall seconds in which an expected node may come up for the first time.
        """
        self._component_of = dict(component_of)
        self._grace = grace
        self._seen: dict[str, _Seen] = {}
        self._waited_for: frozenset[str] = frozenset()

    @property
    def waited_for(self) -> frozenset[str]:
        """Nodes that are absent but not failed yet, as of the last update."""
        return self._waited_for

    def update(
        self,
        conditions: Mapping[str, NodeCondition],
        now: float,
        excused: Collection[str] = (),
        patience: Mapping[str, float] | None = None,
    ) -> list[tuple[str, ComponentStatus]]:
        """Take in what is known of the expected nodes.

        Args:
            conditions: of each expected node; nodes that are no longer expected are forgotten.
            now: wall seconds.
            excused: nodes that are not judged now.
            patience: wall seconds by node for which its absence is no failure yet; 0 for those not given.

        Returns:
            Status of each component that is judged now. RECOVERED appears once per return.
        """
        statuses = []
        waited_for = []
        seen = {}
        for name, condition in conditions.items():
            before = self._seen.get(name, _Seen(absent_since=now))
            if name in excused:
                # The wait for a first sign of life begins when the excuse ends.
                seen[name] = _Seen(now, before.ever_alive, before.failed)
                continue
            seen[name], status = self._judge(before, condition, now, (patience or {}).get(name, 0.0))
            if status:
                statuses.append((self._component_of.get(name, name), status))
            elif condition is NodeCondition.GONE:
                waited_for.append(name)
        self._seen = seen
        self._waited_for = frozenset(waited_for)
        return statuses

    def _judge(
        self, before: _Seen, condition: NodeCondition, now: float, patience: float
    ) -> tuple[_Seen, ComponentStatus | None]:
        if condition is NodeCondition.ALIVE:
            status = ComponentStatus.RECOVERED if before.failed else ComponentStatus.TRUE
            return _Seen(None, ever_alive=True), status
        if before.failed:
            return before, ComponentStatus.FALSE
        if condition is NodeCondition.UNKNOWN:
            return before, None
        since = now if before.absent_since is None else before.absent_since
        failed = now - since >= (patience if before.ever_alive else self._grace)
        return _Seen(since, before.ever_alive, failed), ComponentStatus.FALSE if failed else None


def component_statuses(components: Iterable[tuple[str, ComponentStatus]]) -> list[Status]:
    """Return the components' statuses in the published form."""
    return [
        Status(
            Level.ERROR if status is ComponentStatus.FALSE else Level.OK,
            component,
            COMPONENT_STATUS,
            ((component, status.value),),
        )
        for component, status in components
    ]
