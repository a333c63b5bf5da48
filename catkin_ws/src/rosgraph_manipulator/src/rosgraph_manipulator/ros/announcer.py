"""Publishes what is deployed, and how changes ended."""

from __future__ import annotations

from collections.abc import Mapping

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_bags import ownership
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding, Phase

from rosgraph_manipulator.change.deployment import Outcome
from rosgraph_manipulator.configuration.configurations import Configuration


class Announcer:
    """The topics rosgraph_manipulator/active_configuration and /diagnostics."""

    def __init__(self) -> None:
        self._groundings: dict[str, FunctionGrounding] = {}
        self._active = rospy.Publisher(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=10, latch=True
        )
        self._diagnostics = rospy.Publisher(ownership.TOPIC, DiagnosticArray, queue_size=10)

    def begin(self, states: Mapping[Configuration, str]) -> None:
        """Publish what runs and what is being deployed when the manipulator starts, all functions at once.

        Also where that is nothing: others may still have what an earlier manipulator has told.

        Args:
            states: one of metacontrol_msgs/FunctionGrounding for each configuration.
        """
        for configuration, state in states.items():
            self._groundings[configuration.function] = FunctionGrounding(
                configuration.function, configuration.name, state
            )
        self._publish(None, None)

    def announce(
        self,
        configuration: Configuration,
        state: str,
        outcome: Outcome | None = None,
        phases: Mapping[str, float] | None = None,
    ) -> None:
        """Publish which configuration is active for its function, and in which state, beside all other functions.

        Args:
            configuration: the active one.
            state: one of metacontrol_msgs/FunctionGrounding.
            outcome: how the last change ended.
            phases: durations of the last change's phases, s.
        """
        grounding = FunctionGrounding(configuration.function, configuration.name, state)
        self._groundings[configuration.function] = grounding
        self._publish(outcome, phases)

    def announce_release(self, function: str, outcome: Outcome, phases: Mapping[str, float]) -> None:
        """Publish that nothing runs for a function any more."""
        self._groundings.pop(function, None)
        self._publish(outcome, phases)

    def _publish(self, outcome: Outcome | None, phases: Mapping[str, float] | None) -> None:
        message = ActiveConfiguration(functions=list(self._groundings.values()))
        message.header.stamp = rospy.Time.now()
        if outcome:
            message.tactic, message.message = outcome.tactic, outcome.message
            message.phases = [Phase(*phase) for phase in (phases or {}).items()]
        self._active.publish(message)

    def diagnose(self, ok: bool, message: str, configuration: str) -> None:
        """Publish on /diagnostics whether all is well with a configuration or a function, and why not."""
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if ok else DiagnosticStatus.ERROR,
            name="rosgraph_manipulator",
            message=message,
            hardware_id=ownership.hardware_id_of(rospy.get_namespace()),
            values=[KeyValue("configuration", configuration)],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)
