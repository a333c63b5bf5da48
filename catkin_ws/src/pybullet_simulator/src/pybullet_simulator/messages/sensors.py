"""ROS messages of lasers and the depth camera. No rospy, and no PyBullet: the drivers use these too."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
from sensor_msgs.msg import Image, LaserScan, PointCloud2, PointField

from pybullet_simulator.robot.laser_and_camera import SensorError

if TYPE_CHECKING:
    import genpy
    from numpy.typing import NDArray

    from pybullet_simulator.robot.robot import DepthCamera, Laser


def laser_scan(laser: Laser, ranges: NDArray[np.float32], now: genpy.Time, period: float = 0.1) -> LaserScan:
    """Return a scan of a laser that turns once in `period` s."""
    message = LaserScan()
    message.header.stamp = now
    message.header.frame_id = laser.mount.frame
    message.angle_min, message.angle_max = laser.angle_min, -laser.angle_min
    message.angle_increment = laser.angle_increment
    message.scan_time = period
    message.range_min, message.range_max = laser.range_min, laser.range_max
    message.ranges = ranges.tolist()
    return message


def depth_image(camera: DepthCamera, depth: NDArray[np.float32], now: genpy.Time) -> Image:
    """Return a depth image, 32FC1 in m."""
    message = Image()
    message.header.stamp = now
    message.header.frame_id = camera.mount.frame
    message.height, message.width = depth.shape
    message.encoding = "32FC1"
    message.is_bigendian = int(sys.byteorder == "big")
    message.step = 4 * camera.width
    message.data = np.ascontiguousarray(depth, dtype=np.float32).tobytes()
    return message


def read_depth(message: Image) -> NDArray[np.float32]:
    """Return the (height, width) depths in m of a 32FC1 image.

    Raises:
        SensorError: another encoding, or data of another length than the size asks for.
    """
    if message.encoding != "32FC1":
        raise SensorError(f"depth image is encoded as {message.encoding!r}, expected '32FC1'")
    row = 4 * message.width
    if message.step != row or len(message.data) != row * message.height:
        raise SensorError(
            f"depth image of {message.width} x {message.height} pixels has {len(message.data)} bytes, "
            f"step {message.step}; expected {row * message.height} and {row}"
        )
    kind = ">f4" if message.is_bigendian else "<f4"
    depth = np.frombuffer(message.data, dtype=kind).reshape(message.height, message.width)
    return depth.astype(np.float32, copy=False)


def point_cloud(points: NDArray[np.float32], frame: str, now: genpy.Time) -> PointCloud2:
    """Return (n, 3) points in m as a cloud of x, y, z."""
    message = PointCloud2()
    message.header.stamp = now
    message.header.frame_id = frame
    message.height, message.width = 1, points.shape[0]
    message.fields = [PointField(name, 4 * i, PointField.FLOAT32, 1) for i, name in enumerate("xyz")]
    message.is_bigendian = sys.byteorder == "big"
    message.point_step, message.row_step = 12, 12 * points.shape[0]
    message.is_dense = True
    message.data = np.ascontiguousarray(points, dtype=np.float32).tobytes()
    return message
