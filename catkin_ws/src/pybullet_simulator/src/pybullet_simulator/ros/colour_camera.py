"""Node of the mast camera: the driver of an RGB-D camera whose exposure and gain can be changed while it runs."""

from __future__ import annotations

import numpy as np
import rospy
from dynamic_reconfigure.server import Server
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from node_kit.ros.reconfigure_server import Strict
from sensor_msgs.msg import CameraInfo, Image

from pybullet_simulator.cfg import ColourCameraConfig
from pybullet_simulator.io.fault_signals import listen
from pybullet_simulator.messages.cell import ImageError, camera_info, colour_image, read_floats
from pybullet_simulator.robot.colour_camera import CameraSettings, take
from pybullet_simulator.robot.faults import Outlet
from pybullet_simulator.robot.manipulator import MAST_CAMERA
from pybullet_simulator.ros.device import DeviceError, check_device

_LARGE = 1 << 23
"""Bytes; rospy's default buffer would read an image in many parts."""


class _Server(Strict, Server):
    """dynamic_reconfigure's, which refuses what it does not have."""


class ColourCameraNode:
    """Publishes camera/image_raw, camera/camera_info and camera/depth/image_raw, while somebody listens."""

    def __init__(self) -> None:
        """Read the parameters and connect.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._rng = np.random.default_rng([parameters.whole("seed", 0, low=0), 22])
        self._settings = CameraSettings(0.002, 1.0)
        self._outlet = Outlet()
        listen(self._outlet)
        self._image = rospy.Publisher("camera/image_raw", Image, queue_size=1, tcp_nodelay=True)
        self._info = rospy.Publisher("camera/camera_info", CameraInfo, queue_size=1)
        self._depth = rospy.Publisher("camera/depth/image_raw", Image, queue_size=1, tcp_nodelay=True)
        self._server = _Server(ColourCameraConfig, self._on_settings)
        self._inputs = (
            rospy.Subscriber("simulator/image", Image, self._on_light, queue_size=1, buff_size=_LARGE),
            rospy.Subscriber("simulator/depth", Image, self._on_depth, queue_size=1, buff_size=_LARGE),
        )

    def _on_settings(self, config: ColourCameraConfig, _level: int) -> ColourCameraConfig:
        self._settings = CameraSettings(config["exposure"], config["gain"])
        return config

    def _on_light(self, message: Image) -> None:
        if not self._image.get_num_connections():
            return
        try:
            light = read_floats(message, 3)
        except ImageError as error:
            rospy.logwarn_throttle(10.0, f"simulator/image refused: {error}")
            return
        image = colour_image(take(light, self._settings, self._rng), message.header.stamp)
        self._image.publish(self._outlet.pass_on(image))
        self._info.publish(camera_info(MAST_CAMERA, message.header.stamp))

    def _on_depth(self, message: Image) -> None:
        if self._depth.get_num_connections():
            self._depth.publish(self._outlet.pass_on(message))
            self._info.publish(camera_info(MAST_CAMERA, message.header.stamp))


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used."""
    with Lifetime("camera", ParameterError, DeviceError) as life:
        life.start()
        check_device()
        ColourCameraNode()
        rospy.spin()
