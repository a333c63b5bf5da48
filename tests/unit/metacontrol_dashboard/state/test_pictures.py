"""Images of cameras become addresses that a page can show."""

import base64
import struct
import subprocess
import sys
import zlib
from types import SimpleNamespace as Thing

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_dashboard.state.pictures import picture

ORANGE = (255, 128, 0)
"""Red, green, blue."""


def image(encoding, pixels, is_bigendian=0, step=None):
    pixels = np.asarray(pixels)
    rows = pixels.reshape(pixels.shape[0], -1).view(np.uint8)
    height, width = pixels.shape[:2]
    return Thing(
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=is_bigendian,
        step=step or rows.shape[1],
        data=rows.tobytes(),
    )


def seen(message):
    """Return the picture's pixels, in red, green, blue."""
    head, _, data = picture(message).partition(",")
    assert head == "data:image/jpeg;base64"
    return cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)[:, :, ::-1].astype(int)


def whole(colour, kind=np.uint8, shape=(24, 32)):
    return np.broadcast_to(np.array(colour, kind), (*shape, len(colour))).copy()


@pytest.mark.parametrize(
    "encoding, colour",
    [
        ("rgb8", ORANGE),
        ("bgr8", ORANGE[::-1]),
        ("8UC3", ORANGE[::-1]),
        ("rgba8", (*ORANGE, 9)),
        ("bgra8", (*ORANGE[::-1], 9)),
    ],
)
def test_colours_are_those_of_the_camera(encoding, colour):
    assert np.abs(seen(image(encoding, whole(colour))) - ORANGE).max() < 12


@pytest.mark.parametrize("order", ["rggb", "bggr", "gbrg", "grbg"])
def test_mosaic_of_colours_is_dissolved(order):
    values = dict(zip("rgb", ORANGE, strict=True))
    tile = np.array([values[letter] for letter in order], np.uint8).reshape(2, 2)
    found = seen(image(f"bayer_{order}8", np.tile(tile, (12, 16))))
    assert np.abs(found[4:-4, 4:-4] - ORANGE).max() < 12


def test_brightness_and_colour_apart():
    assert seen(image("yuv422", np.tile(np.array([[[128, 90]]], np.uint8), (24, 32, 1)))) == pytest.approx(90, abs=4)


@pytest.mark.parametrize("encoding, kind", [("16UC1", "<u2"), ("32FC1", "<f4")])
def test_what_is_near_is_light_and_what_was_not_measured_black(encoding, kind):
    depths = np.full((30, 30), 4.0)
    depths[:10], depths[10:20] = 0.0, 1.0
    rows = seen(image(encoding, depths.astype(kind)))[:, 15, 0]
    assert rows[5] < 10 < rows[25] < 100 < rows[15]


def test_depth_that_is_infinite_or_no_number_was_not_measured():
    assert seen(image("32FC1", np.full((8, 8), np.inf, "<f4"))).max() < 10
    assert seen(image("32FC1", np.full((8, 8), np.nan, "<f4"))).max() < 10


def test_order_of_bytes_is_heeded():
    little = image("mono16", np.arange(64, dtype="<u2").reshape(8, 8))
    big = image("mono16", np.arange(64, dtype=">u2").reshape(8, 8), is_bigendian=1)
    assert picture(little) == picture(big)


def test_wide_image_is_made_smaller():
    assert seen(image("mono8", np.full((480, 640, 1), 7, np.uint8))).shape == (240, 320, 3)


def test_high_image_is_made_smaller():
    assert seen(image("mono8", np.full((70_000, 1, 1), 7, np.uint8))).shape == (640, 1, 3)
    assert seen(image("mono8", np.full((1280, 320, 1), 7, np.uint8))).shape == (640, 160, 3)


def test_compressed_image():
    data = cv2.imencode(".png", whole(ORANGE[::-1]))[1].tobytes()
    assert np.abs(seen(Thing(format="png", data=data)) - ORANGE).max() < 12


@pytest.mark.parametrize(("kind", "shown"), [(".png", True), (".jpg", True), (".bmp", False), (".tiff", False)])
def test_only_what_cameras_are_compressed_to_is_decoded(kind, shown):
    data = cv2.imencode(kind, whole(ORANGE[::-1]))[1].tobytes()
    assert bool(picture(Thing(format=kind, data=data))) is shown


@pytest.mark.parametrize(
    "message",
    [
        Thing(height=480, width=640, encoding="rgb8", is_bigendian=0, step=1920, data=b"short"),
        Thing(height=2, width=9, encoding="rgb8", is_bigendian=0, step=3, data=b"123456"),
        Thing(height=0, width=0, encoding="rgb8", is_bigendian=0, step=0, data=b""),
        Thing(height=1, width=1, encoding="of its own", is_bigendian=0, step=1, data=b"x"),
        Thing(format="jpeg", data=b"no image"),
        Thing(format="jpeg", data=b""),
    ],
)
def test_what_is_no_image_is_none(message):
    assert picture(message) == ""


ENCODINGS = ["mono8", "rgb8", "bgra8", "bayer_grbg8", "yuv422", "mono16", "16UC1", "32FC1", "8UC3", "odd", ""]
SIZES = st.one_of(st.integers(0, 12), st.integers(0, 2**32 - 1))


@given(SIZES, SIZES, SIZES, st.sampled_from(ENCODINGS), st.integers(0, 1), st.binary(max_size=300))
def test_no_image_raises(height, width, step, encoding, is_bigendian, data):
    message = Thing(height=height, width=width, step=step, encoding=encoding, is_bigendian=is_bigendian, data=data)
    assert isinstance(picture(message), str)


@given(st.binary(max_size=300), st.sampled_from([b"", b"\xff\xd8\xff\xe0", b"\x89PNG\r\n\x1a\n", b"GIF89a", b"BM"]))
def test_no_compressed_image_raises(data, mark):
    assert isinstance(picture(Thing(format="", data=mark + data)), str)


def test_image_that_claims_to_be_huge_is_none():
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    size = struct.pack(">IIBBBBB", 30_000, 30_000, 8, 2, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size) + chunk(b"IDAT", zlib.compress(bytes(99))) + chunk(b"IEND", b"")
    code = f"""
import resource
from types import SimpleNamespace as Thing
from metacontrol_dashboard.state.pictures import picture
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(picture(Thing(format="png", data={data!r})) == "", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert said[0] == "True" and int(said[1]) < 100_000  # kB; its pixels alone would be 2.7 GB
