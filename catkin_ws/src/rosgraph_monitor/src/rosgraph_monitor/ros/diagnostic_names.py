"""ROS shell of the names for the aggregator: publishes each diagnostic again under a name of its own."""

from __future__ import annotations

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from node_kit.ros.lifetime import Lifetime

from rosgraph_monitor.diagnostics.aggregator_names import unique_name


def main() -> None:
    """Run the node."""
    with Lifetime("diagnostic_names") as life:
        life.start()
        publisher = rospy.Publisher("diagnostics_named", DiagnosticArray, queue_size=50)

        def pass_on(msg: DiagnosticArray) -> None:
            for status in msg.status:
                status.name = unique_name(status)
            publisher.publish(msg)

        rospy.Subscriber("/diagnostics", DiagnosticArray, pass_on, queue_size=50)
        rospy.spin()
