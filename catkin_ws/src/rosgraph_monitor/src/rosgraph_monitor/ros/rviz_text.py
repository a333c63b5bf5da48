"""Node rviz_text: configurations, quality levels and failed components as a text over the robot, for RViz."""

from __future__ import annotations

import threading

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags import ownership
from metacontrol_msgs.msg import ActiveConfiguration
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.connections import latest
from node_kit.ros.lifetime import Lifetime
from visualization_msgs.msg import Marker

from rosgraph_monitor.diagnostics.overview import thresholds
from rosgraph_monitor.diagnostics.status_text import StatusText

_PERIOD_S = 0.5
_CALM, _ALARM = (0.0, 0.0, 0.1), (0.8, 0.0, 0.0)
"""Colours that can be read on a map's light floor and on a costmap."""


class RvizTextNode:
    """Publishes rviz/text."""

    def __init__(self) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: one cannot be used.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        # What lies ahead of the robot stays in view.
        self._behind = parameters.number("behind", 1.5)
        self._height = parameters.number("height", 2.0)
        self._size = parameters.number("size", 0.55, low=0.01)
        self._text = StatusText()
        self._lock = threading.Lock()
        self._marker = rospy.Publisher("rviz/text", Marker, queue_size=1, latch=True)
        self._inputs = (
            rospy.Subscriber(ownership.TOPIC, DiagnosticArray, self._on_diagnostics),
            rospy.Subscriber(
                "rosgraph_manipulator/active_configuration", ActiveConfiguration, latest(self._on_configuration)
            ),
        )
        self._timer = rospy.Timer(rospy.Duration.from_sec(_PERIOD_S), lambda _event: self._publish(), reset=True)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        publisher = message._connection_header.get("callerid", "")
        message.status = ownership.own(message.status, rospy.get_namespace(), publisher)
        with self._lock:
            self._text.take_diagnostics(message)

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        limits = thresholds(rospy.get_param(rospy.get_namespace(), {}))  # they may have changed meanwhile
        with self._lock:
            self._text.take_limits(limits)
            self._text.take_configuration(message)

    def _publish(self) -> None:
        with self._lock:
            lines, alarm = self._text.lines(), self._text.alarm
        if not lines:
            return
        marker = Marker(ns="status", type=Marker.TEXT_VIEW_FACING, text="\n".join(lines), frame_locked=True)
        marker.header.frame_id = "base_link"
        marker.pose.position.x, marker.pose.position.z = -self._behind, self._height
        marker.pose.orientation.w = 1.0
        marker.scale.z = self._size
        marker.color.r, marker.color.g, marker.color.b = _ALARM if alarm else _CALM
        marker.color.a = 1.0
        self._marker.publish(marker)


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used."""
    with Lifetime("rviz_text", ParameterError) as life:
        life.start()
        RvizTextNode()
        rospy.spin()
