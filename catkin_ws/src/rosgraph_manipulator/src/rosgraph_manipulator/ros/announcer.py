"""Publishes what is deployed, and how changes ended."""

from __future__ import annotations

from collections.abc import Mapping

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding, Phase

from rosgraph_manipulator.change.deployment import Outcome
from rosgraph_manipulator.configuration.configurations import Configuration


class Announcer:
    """The topics rosgraph_manipulator/active_configuration and /diagnostics."""

    def __init__(self) -> None:
        self._active = rospy.Publisher(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=10, latch=True
        )
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)

    def announce(
        self,
        configuration: Configuration,
        state: str,
        outcome: Outcome | None = None,
        phases: Mapping[str, float] | None = None,
    ) -> None:
        """Publish which configuration is active, and in which state.

        Args:
            configuration: the active one.
            state: one of metacontrol_msgs/FunctionGrounding.
            outcome: how the last change ended.
            phases: durations of the last change's phases, s.
        """
        message = ActiveConfiguration(functions=[FunctionGrounding(configuration.function, configuration.name, state)])
        message.header.stamp = rospy.Time.now()
        if outcome:
            message.tactic, message.message = outcome.tactic, outcome.message
            message.phases = [Phase(*phase) for phase in (phases or {}).items()]
        self._active.publish(message)

    def diagnose(self, ok: bool, message: str, configuration: Configuration) -> None:
        """Publish on /diagnostics whether all is well with a configuration, and why not."""
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if ok else DiagnosticStatus.ERROR,
            name="rosgraph_manipulator",
            message=message,
            values=[KeyValue("configuration", configuration.name)],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)
