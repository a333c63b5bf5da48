"""Node camera: the driver of the depth camera. Depth images in, a point cloud out."""

from __future__ import annotations

import math
import threading

import numpy as np
import rospy
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from sensor_msgs.msg import Image, PointCloud2
from std_msgs.msg import Float32

from pybullet_simulator.io.fault_signals import listen
from pybullet_simulator.messages.sensors import point_cloud, read_depth
from pybullet_simulator.robot.faults import Outlet
from pybullet_simulator.robot.laser_and_camera import DEPTH_NOISE, DepthProjector, SensorError, measure_depth
from pybullet_simulator.ros.device import DeviceError, check_device


class CameraNode(rospy.SubscribeListener):
    """Publishes camera/depth/points; takes simulator/depth, which is costly to render, only while somebody listens."""

    def __init__(self) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        super().__init__()
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._field_of_view = math.radians(parameters.number("field_of_view", 60.0, low=1.0, high=170.0))
        self._range_min = parameters.number("range_min", 0.05, low=0.0, high=99.0)
        self._range_max = parameters.number("range_max", 8.0, low=self._range_min + 0.1, high=100.0)
        self._noise = parameters.number("noise", DEPTH_NOISE, low=0.0, high=1.0)
        self._rng = np.random.default_rng([parameters.whole("seed", 0, low=0), 8])
        self._light = 1.0
        self._projector: DepthProjector | None = None
        self._depth: rospy.Subscriber | None = None
        self._outlet = Outlet()
        listen(self._outlet)
        self._lock = threading.Lock()
        with self._lock:  # a listener may come before the publisher is assigned
            self._points = rospy.Publisher("camera/depth/points", PointCloud2, subscriber_listener=self, queue_size=1)
        self._follow_listeners()
        self._lamp = rospy.Subscriber("simulator/light", Float32, self._on_light, queue_size=1)

    def peer_subscribe(self, _topic: str, _publish: object, _peer_publish: object) -> None:
        """Start to take images: somebody wants points (called by rospy)."""
        self._follow_listeners()

    def peer_unsubscribe(self, _topic: str, _num_peers: int) -> None:
        """Stop to take images when the last listener is gone (called by rospy)."""
        self._follow_listeners()

    def _follow_listeners(self) -> None:
        """Take images while there are listeners; see LaserNode."""
        with self._lock:
            is_heard = self._points.impl.has_connections()
            if is_heard and self._depth is None:
                self._depth = rospy.Subscriber(
                    "simulator/depth", Image, self._on_depth, queue_size=1, buff_size=1 << 20, tcp_nodelay=True
                )
            elif not is_heard and self._depth is not None:
                self._depth.unregister()
                self._depth = None

    def _on_light(self, light: Float32) -> None:
        if math.isfinite(light.data):
            self._light = light.data

    def _on_depth(self, image: Image) -> None:
        try:
            depth = read_depth(image)
            if self._projector is None or self._projector.shape != depth.shape:
                self._projector = DepthProjector(image.width, image.height, self._field_of_view)
            depth = measure_depth(depth, self._light, self._noise, self._rng)
            points = self._projector.points(depth, self._range_min, self._range_max)
        except SensorError as error:
            rospy.logwarn_throttle(10.0, f"simulator/depth refused: {error}")
            return
        self._points.publish(self._outlet.pass_on(point_cloud(points, "camera_link", image.header.stamp)))


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used."""
    with Lifetime("camera", ParameterError, DeviceError) as life:
        life.start()
        check_device()
        CameraNode()
        rospy.spin()
