"""Node front_laser: the driver of the front laser. True ranges in, a noisy scan out."""

from __future__ import annotations

import numpy as np
import rospy
from sensor_msgs.msg import LaserScan

from metacontrol_sim.parameters import ParameterError, number, seed
from metacontrol_sim.sensors import SensorError, measure_ranges


class FrontLaserNode:
    """Publishes front/scan from simulator/front_rays."""

    def __init__(self) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        self._noise = number(rospy.get_param("~noise", 0.01), "~noise", 0.0, 1.0)
        self._rng = np.random.default_rng([seed(rospy.get_param("~seed", 0)), 3])
        self._scan = rospy.Publisher("front/scan", LaserScan, queue_size=1)
        self._rays = rospy.Subscriber("simulator/front_rays", LaserScan, self._on_rays, queue_size=1, tcp_nodelay=True)

    def _on_rays(self, rays: LaserScan) -> None:
        try:
            ranges = measure_ranges(rays.ranges, rays.range_min, rays.range_max, self._noise, self._rng)
        except SensorError as error:
            rospy.logwarn_throttle(10.0, f"simulator/front_rays refused: {error}")
            return
        rays.header.frame_id = "front_laser"
        rays.ranges = ranges.tolist()
        self._scan.publish(rays)


def main() -> int:
    """Run the node and return its exit status."""
    rospy.init_node("front_laser")
    try:
        FrontLaserNode()
    except ParameterError as error:
        rospy.logfatal(str(error))
        return 2
    rospy.spin()
    return 0
