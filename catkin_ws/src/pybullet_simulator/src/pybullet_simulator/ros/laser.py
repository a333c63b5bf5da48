"""Nodes front_laser and rear_laser: drivers of the lasers. True ranges in, a noisy scan out."""

from __future__ import annotations

import threading

import numpy as np
import rospy
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from sensor_msgs.msg import LaserScan

from pybullet_simulator.io.fault_signals import listen
from pybullet_simulator.robot.faults import Outlet
from pybullet_simulator.robot.laser_and_camera import LASER_NOISE, SensorError, measure_ranges
from pybullet_simulator.ros.device import DeviceError, check_device

SIDES = {"front": 3, "rear": 7}
"""Sides of the robot with a laser, and the stream of random numbers of each."""


class LaserNode(rospy.SubscribeListener):
    """Publishes SIDE/scan from simulator/SIDE_rays, which are cast only while somebody listens."""

    def __init__(self, side: str) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        super().__init__()
        self._frame = f"{side}_laser"
        self._raw = f"simulator/{side}_rays"
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._noise = parameters.number("noise", LASER_NOISE, low=0.0, high=1.0)
        self._rng = np.random.default_rng([parameters.whole("seed", 0, low=0), SIDES[side]])
        self._rays: rospy.Subscriber | None = None
        self._outlet = Outlet()
        listen(self._outlet)
        self._lock = threading.Lock()
        with self._lock:  # a listener may come before the publisher is assigned
            self._scan = rospy.Publisher(
                f"{side}/scan", LaserScan, subscriber_listener=self, queue_size=1, tcp_nodelay=True
            )
        self._follow_listeners()

    def peer_subscribe(self, _topic: str, _publish: object, _peer_publish: object) -> None:
        """Start to take rays: somebody wants scans (called by rospy)."""
        self._follow_listeners()

    def peer_unsubscribe(self, _topic: str, _num_peers: int) -> None:
        """Stop to take rays when the last listener is gone (called by rospy)."""
        self._follow_listeners()

    def _follow_listeners(self) -> None:
        """Take rays while there are listeners.

        rospy tells of them late, and not always in order, so the number that it passes may be an old one. The
        connections are looked at without rospy's lock: rospy may hold it while it waits for the one here.
        """
        with self._lock:
            is_heard = self._scan.impl.has_connections()
            if is_heard and self._rays is None:
                self._rays = rospy.Subscriber(self._raw, LaserScan, self._on_rays, queue_size=1, tcp_nodelay=True)
            elif not is_heard and self._rays is not None:
                self._rays.unregister()
                self._rays = None

    def _on_rays(self, rays: LaserScan) -> None:
        try:
            ranges = measure_ranges(rays.ranges, rays.range_min, rays.range_max, self._noise, self._rng)
        except SensorError as error:
            rospy.logwarn_throttle(10.0, f"{self._raw} refused: {error}")
            return
        rays.header.frame_id = self._frame
        rays.ranges = ranges.tolist()
        self._scan.publish(self._outlet.pass_on(rays))


def main(side: str) -> None:
    """Run the node of one side; exit status 2 when a parameter cannot be used."""
    with Lifetime(f"{side}_laser", ParameterError, DeviceError) as life:
        life.start()
        check_device()
        LaserNode(side)
        rospy.spin()
