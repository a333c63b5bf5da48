"""Camera images, made small enough to send. Pure."""

from __future__ import annotations

import base64
import os
from typing import TYPE_CHECKING, Any

os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(2**25))  # a few bytes may claim to be a huge image

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_WIDTH, _HEIGHT = 320, 640
"""px; a larger image is made smaller."""
_QUALITY = 70
"""Of the JPEG, 0 to 100."""
_FARTHEST = 99.0
"""Percentile of the depths that is shown as the darkest."""

_CHANNELS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4}
_TO_BGR = {
    "rgb8": cv2.COLOR_RGB2BGR,
    "rgba8": cv2.COLOR_RGBA2BGR,
    "bgra8": cv2.COLOR_BGRA2BGR,
    # OpenCV names the second row's pixels, sensor_msgs/image_encodings the first one's
    "bayer_rggb8": cv2.COLOR_BayerBG2BGR,
    "bayer_bggr8": cv2.COLOR_BayerRG2BGR,
    "bayer_gbrg8": cv2.COLOR_BayerGR2BGR,
    "bayer_grbg8": cv2.COLOR_BayerGB2BGR,
    "yuv422": cv2.COLOR_YUV2BGR_UYVY,
}
_COMPRESSED = (b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n")
"""How JPEG and PNG begin, the formats of compressed_image_transport. OpenCV has decoders for a dozen others, which
nobody needs here."""
_DEEP = {"mono16": "u2", "16UC1": "u2", "32FC1": "f4"}


def picture(message: Any) -> str:
    """Return an image as the address of a JPEG that holds it (`data:`); empty: there is none in the message.

    Args:
        message: sensor_msgs/Image, or sensor_msgs/CompressedImage.
    """
    try:
        image = _raw(message) if hasattr(message, "encoding") else _compressed(message)
    except (ValueError, cv2.error):  # it has other data than it says
        return ""
    if image is None or not image.size:
        return ""
    share = min(1.0, _WIDTH / image.shape[1], _HEIGHT / image.shape[0])
    if share < 1.0:
        size = [max(1, round(side * share)) for side in (image.shape[1], image.shape[0])]
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    written, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return f"data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode()}" if written else ""


def _compressed(message: Any) -> NDArray[Any] | None:
    data = bytes(message.data)
    if not data.startswith(_COMPRESSED):
        return None
    return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_COLOR)


def _raw(message: Any) -> NDArray[Any] | None:
    """Return the pixels in OpenCV's order; None: nobody here knows the encoding."""
    height, width, encoding = message.height, message.width, message.encoding
    data = np.frombuffer(bytes(message.data), dtype=np.uint8)
    rows = data[: height * message.step].reshape(height, message.step)
    if encoding in _DEEP:
        kind = np.dtype((">" if message.is_bigendian else "<") + _DEEP[encoding])
        return _grey(rows[:, : width * kind.itemsize].copy().view(kind), near_is_light=encoding != "mono16")
    channels = _CHANNELS.get(encoding) or (2 if encoding == "yuv422" else 1)
    if encoding not in _CHANNELS and encoding not in _TO_BGR:
        return None
    shape = (height, width, channels) if channels > 1 else (height, width)
    pixels = np.ascontiguousarray(rows[:, : width * channels]).reshape(shape)
    return cv2.cvtColor(pixels, _TO_BGR[encoding]) if encoding in _TO_BGR else pixels


def _grey(values: NDArray[Any], near_is_light: bool) -> NDArray[Any]:
    """Return values as shades, those of depths from white (near) to dark; where nothing was measured it is black."""
    known = np.isfinite(values) & (values > 0)
    if not known.any():
        return np.zeros(values.shape, dtype=np.uint8)
    span = float(np.percentile(values[known], _FARTHEST)) or 1.0
    share = np.clip(np.where(known, values, 0).astype(np.float32) / span, 0.0, 1.0)
    shades = 255.0 - 215.0 * share if near_is_light else 255.0 * share
    return np.where(known, shades, 0.0).astype(np.uint8)
