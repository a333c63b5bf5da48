"""Errors of objectives: goals that their action server aborts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from std_msgs.msg import Bool

from rosgraph_monitor.observer import Observer, Topics

if TYPE_CHECKING:
    from collections.abc import Mapping

OUTPUT = "obj_error"
MESSAGE = "Objective error"
_FAILED = frozenset({GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.LOST})


class ObjectiveErrorObserver(Observer):
    """Publishes true on `obj_error` when the newest goal of an action fails, and false when another goal is on its way.

    It ignores goals that had failed before its first message from the action.
    """

    defaults: Mapping[str, Any] = {"actions": ["move_base"]}

    def __init__(self, name: str = "ObjectiveErrorObserver") -> None:
        super().__init__(name, 5.0)
        self._newest: dict[str, tuple[str, bool, str]] = {}
        self._old: dict[str, frozenset[str]] = {}
        self._told: bool | None = None

    @property
    def topics(self) -> Topics:
        """Status of each action."""
        return [(f"{action}/status", GoalStatusArray) for action in self.settings["actions"]]

    @property
    def outputs(self) -> Topics:
        """Whether a goal has failed."""
        return [(OUTPUT, Bool)]

    def receive(self, topic: str, msg: Any, now: float) -> None:  # noqa: ARG002 - interface
        """Take the status of an action's goals."""
        action = topic.removesuffix("/status")
        if action not in self._old:
            self._old[action] = frozenset(s.goal_id.id for s in msg.status_list if s.status in _FAILED)
        newest = max(msg.status_list, key=lambda status: status.goal_id.stamp, default=None)
        if newest is None:
            return
        failed = newest.status in _FAILED and newest.goal_id.id not in self._old[action]
        self._newest[action] = (newest.goal_id.id, failed, newest.text)

    def reset(self) -> None:
        """Forget all goals."""
        self._newest.clear()
        self._old.clear()
        self._told = None

    def take_outputs(self) -> list[tuple[str, Any]]:
        """Return whether a goal has failed, if that has changed."""
        failed = any(failed for _, failed, _ in self._newest.values())
        if failed == bool(self._told):
            return []
        self._told = failed
        return [(OUTPUT, Bool(failed))]

    def generate_diagnostics(self, now: float) -> list[DiagnosticStatus]:  # noqa: ARG002 - interface
        """Return the state of the newest goal of each action."""
        return [
            DiagnosticStatus(
                level=DiagnosticStatus.ERROR if failed else DiagnosticStatus.OK,
                name=action,
                message=MESSAGE if failed else "no objective error",
                values=[KeyValue("goal", goal), KeyValue("text", text)],
            )
            for action, (goal, failed, text) in self._newest.items()
        ]
