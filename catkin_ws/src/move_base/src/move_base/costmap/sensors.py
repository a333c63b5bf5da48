"""Checked conversion of sensor messages to observations; the messages are duck-typed, so no ROS is imported."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from move_base.parameters.parameters import ObservationSource

FLOAT32 = 7
"""`sensor_msgs/PointField.FLOAT32`."""

MAX_RAYS = 20_000
"""A scan with more rays than this is refused: they would take longer than a control period."""

MAX_POINTS = 4_000_000
"""A cloud with more points than this is refused."""


class SensorError(ValueError):
    """A sensor message can't be used; the message says why."""


@dataclass(frozen=True)
class Observation:
    """What a sensor saw at one moment.

    Attributes:
        source: the configured source.
        frame: the sensor's frame.
        stamp: time of the measurement, s.
        points: end points of the rays in the sensor's frame (N, 3), m.
        hits: whether each ray ended at an obstacle (N,).
        ordered: whether the rays are in the order of their angle, as in a scan.
    """

    source: ObservationSource
    frame: str
    stamp: float
    points: NDArray[np.float32]
    hits: NDArray[np.bool_]
    ordered: bool


def scan_observation(message: Any, source: ObservationSource) -> Observation:
    """Convert a sensor_msgs/LaserScan.

    Rays without a return (infinite, or beyond range_max) clear up to the source's raytrace_range if `inf_is_valid`;
    other readings outside the scan's limits are dropped.

    Raises:
        SensorError: empty, too many rays, or limits that are not finite or make no sense.
    """
    if len(message.ranges) > MAX_RAYS:
        raise SensorError(f"the scan has {len(message.ranges)} ranges, more than {MAX_RAYS}")
    ranges = np.asarray(message.ranges, dtype=np.float32)
    limits = (message.angle_min, message.angle_increment, message.range_min, message.range_max)
    if ranges.size == 0:
        raise SensorError("the scan has no ranges")
    if not all(math.isfinite(value) for value in limits) or message.angle_increment == 0.0:
        raise SensorError("the scan's angle or range limits are not finite, or its angle_increment is 0")
    if ranges.size * abs(message.angle_increment) > 2.0 * math.pi + 0.1:
        raise SensorError("the scan covers more than a full turn")
    hits = (ranges >= message.range_min) & (ranges <= message.range_max)
    used = hits
    if source.inf_is_valid:
        missed = ranges > message.range_max
        used = hits | missed
        ranges = np.where(missed, np.float32(source.raytrace_range), ranges)
    angles = np.float32(message.angle_min) + np.arange(ranges.size, dtype=np.float32) * np.float32(
        message.angle_increment
    )
    ranges, angles = ranges[used], angles[used]
    points = np.zeros((ranges.size, 3), dtype=np.float32)
    points[:, 0] = ranges * np.cos(angles)
    points[:, 1] = ranges * np.sin(angles)
    return Observation(source, _frame(message, source), message.header.stamp.to_sec(), points, hits[used], True)


def cloud_observation(message: Any, source: ObservationSource) -> Observation:
    """Convert a sensor_msgs/PointCloud2 with 32-bit x, y, z; points that are not finite are dropped.

    Raises:
        SensorError: fields are missing, or the data are shorter than announced.
    """
    offsets = {field.name: field.offset for field in message.fields if field.datatype == FLOAT32}
    missing = [name for name in ("x", "y", "z") if name not in offsets]
    if missing:
        raise SensorError(f"the cloud has no 32-bit field {', '.join(missing)}")
    count = message.width * message.height
    if count > MAX_POINTS:
        raise SensorError(f"the cloud announces {count} points, more than {MAX_POINTS}")
    if message.point_step < max(offsets[name] for name in "xyz") + 4:
        raise SensorError(f"the cloud's point_step {message.point_step} is too small for its fields")
    row_step = message.row_step or message.point_step * message.width
    if row_step < message.point_step * message.width or len(message.data) < row_step * message.height:
        raise SensorError(f"the cloud announces {count} points, its data hold {len(message.data)} bytes")
    # A point of no cloud may have any size: numpy's limit is 31 bits.
    points = _points(message, [offsets[name] for name in "xyz"], row_step) if count else np.empty((0, 3), np.float32)
    finite = np.isfinite(points)
    if not finite.all():
        points = points[finite.all(axis=1)]
    return Observation(
        source,
        _frame(message, source),
        message.header.stamp.to_sec(),
        points,
        np.ones(len(points), dtype=np.bool_),
        False,
    )


def _points(message: Any, offsets: list[int], row_step: int) -> NDArray[np.float32]:
    """Return the points of a sensor_msgs/PointCloud2 (N, 3), by the offsets of x, y and z in a point's bytes."""
    width, height = message.width, message.height
    kind = (">" if message.is_bigendian else "<") + "f4"
    packed = offsets == [0, 4, 8] and message.point_step == 12 and row_step == 12 * width
    if packed and np.dtype(kind).isnative:
        return np.frombuffer(message.data, dtype=np.float32, count=3 * width * height).reshape(-1, 3)
    layout = np.dtype(
        {"names": ["x", "y", "z"], "formats": [kind] * 3, "offsets": offsets, "itemsize": message.point_step}
    )
    raw = np.ndarray((height, width), dtype=layout, buffer=message.data, strides=(row_step, message.point_step))
    return np.stack([raw[name].ravel() for name in "xyz"], axis=1).astype(np.float32, copy=False)


def points_observation(message: Any, source: ObservationSource) -> Observation:
    """Convert a sensor_msgs/PointCloud; points that are not finite are dropped.

    Raises:
        SensorError: it has too many points, or no frame.
    """
    if len(message.points) > MAX_POINTS:
        raise SensorError(f"the cloud has {len(message.points)} points, more than {MAX_POINTS}")
    points = np.array([(point.x, point.y, point.z) for point in message.points], dtype=np.float32).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    hits = np.ones(len(points), dtype=np.bool_)
    return Observation(source, _frame(message, source), message.header.stamp.to_sec(), points, hits, False)


def _frame(message: Any, source: ObservationSource) -> str:
    frame: str = (source.sensor_frame or message.header.frame_id).removeprefix("/")
    if not frame:
        raise SensorError("the message has no frame_id")
    return frame
