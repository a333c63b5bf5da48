"""Images of the robot's camera, taken when they are wanted: the camera works only while somebody listens."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import rospy
from node_kit.ros.patience import Patience
from pybullet_simulator.robot.manipulator import MAST_CAMERA
from sensor_msgs.msg import CameraInfo, Image

from metacontrol_manipulation.perception.camera import Camera, CameraError, mounted
from metacontrol_manipulation.ros.errors import RobotError

if TYPE_CHECKING:
    from numpy.typing import NDArray

LARGE = 1 << 23
"""Bytes to receive at once: an image is larger than what rospy receives otherwise, and would come late."""
_CHANNELS = {"rgb8": 3, "bgr8": 3, "mono8": 1}
_POSE = mounted(MAST_CAMERA.x, MAST_CAMERA.y, MAST_CAMERA.z, MAST_CAMERA.pitch)


def camera_of(info: CameraInfo) -> Camera:
    """Return the camera that a camera_info describes.

    Raises:
        CameraError: it describes none.
    """
    return Camera.from_info(info.width, info.height, info.K, _POSE)


def read_pixels(image: Image) -> NDArray[np.uint8]:
    """Return the pixels of an image of 8 bits: (height, width, 3) in RGB, or (height, width) of a grey one.

    Raises:
        RobotError: it is of another kind, or not whole.
    """
    channels = _CHANNELS.get(image.encoding)
    if channels is None:
        raise RobotError(
            f"images are {image.encoding or 'without encoding'}: their driver has to send {', '.join(_CHANNELS)}"
        )
    row = image.width * channels
    if not (image.width and image.height) or image.step < row or len(image.data) < image.height * image.step:
        raise RobotError(f"an image of {image.width} x {image.height} has {len(image.data)} bytes: see its driver")
    rows = np.frombuffer(image.data, np.uint8, image.height * image.step).reshape(image.height, image.step)[:, :row]
    if channels == 1:
        return rows
    pixels = rows.reshape(image.height, image.width, channels)
    return pixels[..., ::-1] if image.encoding == "bgr8" else pixels


def take_image(topic: str, patience: float) -> tuple[Image, Camera]:
    """Return the next image of a topic, and the camera that took it.

    Args:
        topic: of sensor_msgs/Image.
        patience: s of ROS time.

    Raises:
        RobotError: the image does not come in time, or the camera is none.
    """
    since, time_left = rospy.Time.now(), Patience(patience)
    news = threading.Condition()
    images: list[Image] = []
    infos: list[CameraInfo] = []

    def keep(message: Any, kept: list[Any]) -> None:
        if message.header.stamp >= since:
            with news:
                kept.append(message)
                news.notify_all()

    inputs = (
        rospy.Subscriber("camera/camera_info", CameraInfo, keep, infos, queue_size=1),
        rospy.Subscriber(topic, Image, keep, images, queue_size=1, buff_size=LARGE),
    )
    try:
        with news:
            while not (images and infos):
                if rospy.is_shutdown() or time_left.is_over():
                    missing = "camera/camera_info" if images else topic
                    raise RobotError(f"nothing comes on {missing} for {patience:g} s: see whether its driver runs")
                news.wait(0.1)
        return images[0], camera_of(infos[0])
    except CameraError as error:
        raise RobotError(str(error)) from error
    finally:
        for subscriber in inputs:
            subscriber.unregister()
