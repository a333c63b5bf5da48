"""Whether the monitor tells of drivers that are dead or hang. The times are those that rosgraph_monitor documents.

Two things put an alarm off. A monitor that is not there, or hangs, can tell nothing. One that has just begun gives time
to a driver that it has not seen alive, and tells of it only where the master answers.

Nothing else does. The monitor knows of the other drivers by its own connections, also while the master is silent. Its
clock goes on evenly where others stand or jump. Drivers belong to no function, so no change of one excuses them.

What is told of a driver is not taken back before it works again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from metacontrol_msgs.msg import DiagnosticWords as Words
from rosgraph_monitor.diagnostics.status import Level

from simulated.monitor import MonitorPart
from simulated.world import World

DEAD = 1.0
"""s. Deaths of drivers are "reported at once" (`~restart_patience`): the connection to the process closes, and the next
one is refused. It takes longer where the monitor is not connected yet, since it or the process has just begun or gone
on: a poll (0.5 s, `~rate`), a look at the connections (0.05 s, `_SWEEP` of io/node_connections.py), the wait for a poll
that tells whether the node has unregistered (0.15 s, `_FRESH` of ros/monitor.py), and a rest after an evaluation
(0.2 s, `_LONGEST_REST`). That is 0.9 s; here, with looks each 0.25 s, 0.8 s."""
HUNG = 1.0 + 3.0 + DEAD
"""s. `~probe_period` until a node is asked, and `~probe_deadline` until it counts as hung."""
STARTUP, LEAST = 10.0, 3.0
"""s. `~startup_grace`, from the start of the system, for a driver that the monitor has not seen alive; and how much of
it is left, at least, to a monitor that begins later."""


class Alarms:
    """Looks at the drivers of a world, and at what the monitor has published."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._drivers = {node: component.graph_name for node, component in world.system.base_nodes.items()}
        self._monitor: MonitorPart | None = None
        self._began = math.inf  # when the present monitor knew the graph
        self._seen: set[str] = set()  # drivers that it must have seen alive
        self._told: tuple[MonitorPart | None, frozenset[str]] = None, frozenset()  # which drivers are missing, by whom

    def missing(self) -> Iterator[str]:
        """Yield which drivers do not work, and should have been told by now."""
        world = self._world
        now, monitor = world.kernel.now, world.monitor
        if monitor is not self._monitor:
            self._monitor, self._began, self._seen = monitor, math.inf, set()
        if monitor is None or monitor.process.frozen:
            return
        awake = monitor.process.awake_since
        informed = max(awake, world.host.silent_until)  # since then the master answers it
        if now - informed >= DEAD:
            self._began = min(self._began, informed)
        for node, name in self._drivers.items():
            process = world.host.registered.get(node)
            since = process.since if process else 0.0
            if process and process.answers:
                if now - max(informed, since) >= DEAD:
                    self._seen.add(node)
                continue
            hangs = process is not None and process.alive
            due = max(since, awake) + (HUNG if hangs else DEAD)
            if node not in self._seen:
                due = max(due, informed + DEAD, self._began + max(STARTUP - monitor.head_start, LEAST) + DEAD)
            if now >= due and (untold := self._untold(monitor, name)):
                how = "hangs" if hangs else "is dead"
                yield f"driver {node} {how} since {since:.2f}, and the monitor does not tell: {untold}"

    def withdrawn(self) -> Iterator[str]:
        """Yield which drivers are told no more to be missing, though they have not worked lately."""
        now, monitor = self._world.kernel.now, self._world.monitor
        names = {status.name for status in monitor.told if status.message == Words.MISSING_NODE} if monitor else set()
        missing = frozenset(node for node, name in self._drivers.items() if name in names)
        (before, earlier), self._told = self._told, (monitor, missing)
        if monitor is None or monitor is not before or now - monitor.process.awake_since < DEAD:
            return
        for node in sorted(earlier - missing):
            process = self._world.host.registered.get(node)
            worked = now if process and process.answers else process.since if process else 0.0
            if now - worked >= DEAD:
                yield f"driver {node} does not work since {worked:.2f}, and is told no more to be missing"

    def _untold(self, monitor: MonitorPart, name: str) -> str:
        """Return what the monitor should have published last of a driver that does not work, and has not."""
        component = self._world.system.components.get(name, name)
        told = {(status.message, status.name): status for status in monitor.told if status.level == Level.ERROR}
        wanted = ((Words.COMPONENT_STATUS, component), (Words.MISSING_NODE, name))
        return ", ".join(f"{message} of {one}" for message, one in wanted if (message, one) not in told)
