"""The manager `respawn`: a driver that dies is started again, as by roslaunch with `respawn="true"`."""

from __future__ import annotations

from metacontrol_experiments.managers.manager import Manager, Restart

LOOK_S = 0.1
"""s from the end of a process until it is started again: roslaunch looks at its processes so often, and waits no longer
by default (`respawn_delay`)."""
RESPAWN_S = 0.6
"""s from the end of a process until the driver publishes again: a node takes 0.5 s more from its start until it is
registered (decision 9)."""


class RespawnManager(Manager):
    """Starts dead drivers again. A driver that hangs has not died; one whose device is gone dies again."""

    def __init__(self, delay: float = RESPAWN_S) -> None:
        """Know of no dead driver.

        Args:
            delay: from the end of a process until its driver is started again, s.
        """
        self._delay = delay
        self._due: dict[str, float] = {}  # component -> when it is started again

    def ended(self, now: float, component: str) -> None:
        """See Manager.ended."""
        self._due[component] = now + self._delay

    def step(self, now: float, *, heartbeat: bool) -> list[Restart]:  # noqa: ARG002
        """See Manager.step."""
        found = [component for component, due in self._due.items() if due <= now]
        for component in found:
            del self._due[component]
        return [Restart(component) for component in found]
