"""ROS messages of the work cell. No rospy: these are plain conversions."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from sensor_msgs.msg import CameraInfo, Image
from simulator_msgs.msg import ArmState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from pybullet_simulator.world.cell import BLOCK_SIZE, TABLE_SIZE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import genpy
    from numpy.typing import NDArray

    from pybullet_simulator.physics.arm import Arm
    from pybullet_simulator.robot.manipulator import MastCamera
    from pybullet_simulator.world.cell import BodyPose, Vector3

OPTICAL = "camera_optical_frame"
_WOOD, _TABLE, _OBSTACLE = (0.8, 0.6, 0.35), (0.5, 0.5, 0.55), (0.75, 0.15, 0.15)
_ENCODINGS = {1: "32FC1", 3: "32FC3"}


class ImageError(ValueError):
    """An image is not what it should be; the message says why."""


def float_image(pixels: NDArray[np.float32], now: genpy.Time) -> Image:
    """Return an image of floats: 32FC3 of (height, width, 3), 32FC1 of (height, width)."""
    channels = 3 if pixels.ndim == 3 else 1
    data = np.ascontiguousarray(pixels, dtype=np.float32)
    return _image(data.tobytes(), data.shape[:2], _ENCODINGS[channels], 4 * channels, now)


def colour_image(pixels: NDArray[np.uint8], now: genpy.Time) -> Image:
    """Return an image of (height, width, 3) bytes, rgb8."""
    return _image(np.ascontiguousarray(pixels).tobytes(), pixels.shape[:2], "rgb8", 3, now)


def read_floats(message: Image, channels: int) -> NDArray[np.float32]:
    """Return the pixels of an image of floats.

    Raises:
        ImageError: another encoding, or data of another length than the size asks for.
    """
    if message.encoding != _ENCODINGS[channels]:
        raise ImageError(f"the image is encoded as {message.encoding!r}, expected {_ENCODINGS[channels]!r}")
    row = 4 * channels * message.width
    if message.step != row or len(message.data) != row * message.height:
        raise ImageError(
            f"an image of {message.width} x {message.height} pixels has {len(message.data)} bytes and step "
            f"{message.step}; expected {row * message.height} and {row}"
        )
    kind = ">f4" if message.is_bigendian else "<f4"
    shape = (message.height, message.width, 3) if channels == 3 else (message.height, message.width)
    return np.frombuffer(message.data, dtype=kind).reshape(shape).astype(np.float32, copy=False)


def camera_info(camera: MastCamera, now: genpy.Time) -> CameraInfo:
    """Return the calibration of a camera without distortion."""
    message = CameraInfo(height=camera.height, width=camera.width, distortion_model="plumb_bob", D=[0.0] * 5)
    message.header.stamp, message.header.frame_id = now, OPTICAL
    focal, (x, y) = camera.focal_length, camera.principal_point
    message.K = [focal, 0.0, x, 0.0, focal, y, 0.0, 0.0, 1.0]
    message.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    message.P = [focal, 0.0, x, 0.0, 0.0, focal, y, 0.0, 0.0, 0.0, 1.0, 0.0]
    return message


def arm_state(arm: Arm, now: genpy.Time) -> ArmState:
    """Return what an arm's controller measures."""
    return ArmState(
        stamp=now,
        positions=arm.positions.tolist(),
        velocities=arm.velocities.tolist(),
        efforts=arm.efforts.tolist(),
        gripper_width=arm.gripper_width,
        is_holding=arm.is_holding,
        contact_force=arm.contact_force,
    )


def block_poses(blocks: Mapping[str, BodyPose], now: genpy.Time) -> PoseArray:
    """Return the true poses of the blocks, in the order of their names."""
    message = PoseArray(poses=[_pose(*blocks[name]) for name in sorted(blocks)])
    message.header.stamp, message.header.frame_id = now, "map"
    return message


def cell_markers(
    blocks: Mapping[str, BodyPose], obstacles: Iterable[tuple[str, Vector3, Vector3]], now: genpy.Time
) -> MarkerArray:
    """Return table, blocks and obstacles as boxes, after one marker that deletes all earlier ones.

    Args:
        blocks: their poses.
        obstacles: name, centre and size of each, m.
        now: stamp.
    """
    upright = (0.0, 0.0, 0.0, 1.0)
    markers = [Marker(action=Marker.DELETEALL)]
    markers.append(_box("table", ((0.0, 0.0, TABLE_SIZE[2] / 2.0), upright), TABLE_SIZE, _TABLE, now))
    markers += [_box(name, pose, BLOCK_SIZE, _WOOD, now) for name, pose in sorted(blocks.items())]
    markers += [_box(name, (centre, upright), size, _OBSTACLE, now) for name, centre, size in obstacles]
    return MarkerArray(markers)


def _box(name: str, pose: BodyPose, size: Vector3, colour: Vector3, now: genpy.Time) -> Marker:
    marker = Marker(ns=name, type=Marker.CUBE, pose=_pose(*pose), color=ColorRGBA(*colour, 1.0))
    marker.header.stamp, marker.header.frame_id = now, "map"
    marker.scale.x, marker.scale.y, marker.scale.z = size
    return marker


def _pose(position: Vector3, quaternion: tuple[float, float, float, float]) -> Pose:
    return Pose(Point(*position), Quaternion(*quaternion))


def _image(data: bytes, shape: tuple[int, ...], encoding: str, pixel: int, now: genpy.Time) -> Image:
    message = Image(height=shape[0], width=shape[1], encoding=encoding, data=data)
    message.header.stamp, message.header.frame_id = now, OPTICAL
    message.is_bigendian = int(sys.byteorder == "big")
    message.step = pixel * shape[1]
    return message
