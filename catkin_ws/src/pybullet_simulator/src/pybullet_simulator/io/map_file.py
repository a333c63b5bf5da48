"""Maps as map_server has them: a YAML file that names an image and says where it lies and what its shades mean."""

from __future__ import annotations

import io
import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from node_kit.io.input_files import InputFileError, read_bytes
from node_kit.one_line import OneLineError
from PIL.BmpImagePlugin import BmpImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.PpmImagePlugin import PpmImageFile

from pybullet_simulator.world.grid import FREE, OCCUPIED, UNKNOWN, Grid

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

MODES = ("trinary", "scale", "raw")
MAX_EXTENT = 2000.0
"""m; a larger map has its resolution in another unit."""
MAX_CELLS = 20_000_000
"""Maps of buildings have up to 4,000 x 4,000 cells; this many take most of 1 s and 500 MB."""
MAX_SIDE = 40_000
"""Cells along an edge: MAX_EXTENT at 0.05 m. Walls are sought row by row."""
MAX_IMAGE_SIZE = 8 * MAX_CELLS
"""Bytes of the largest image: four channels of 16 bits a cell."""

_READERS = (PngImageFile, PpmImageFile, BmpImageFile, JpegImageFile)
_HEADER_SIZE = 1_000_000
"""Bytes in which an image has to tell its size; Pillow reads comments byte by byte."""
_PIXELS_AT_ONCE = 65_536
"""That are made cells of: as numbers of 4 bytes, all pixels would take many times their memory."""


class MapError(OneLineError, ValueError):
    """A map that cannot be used; the message names the file, the key and the remedy."""


def read_map(content: dict[str, Any], path: Path) -> Grid:
    """Return the grid of a map.

    Args:
        content: what the YAML file holds.
        path: of the YAML file; the image's name is relative to its folder.

    Raises:
        MapError: a key is missing or wrong, or the image cannot be read.
    """
    resolution = _number(content.get("resolution"), f"{path}: resolution", "m per cell")
    if resolution <= 0.0:
        raise MapError(f"{path}: resolution: is {resolution:g}; give m per cell, more than 0")
    x, y, yaw = _origin(content.get("origin"), path)
    occupied = _share(content.get("occupied_thresh"), f"{path}: occupied_thresh")
    free = _share(content.get("free_thresh"), f"{path}: free_thresh")
    if free > occupied:
        raise MapError(f"{path}: free_thresh: {free:g} is above occupied_thresh {occupied:g}; swap them")
    negate = content.get("negate", 0)
    if negate not in (0, 1):
        raise MapError(f"{path}: negate: is {negate!r}; give 0 or 1")
    mode = content.get("mode", "trinary")
    if mode not in MODES:
        raise MapError(f"{path}: mode: is {mode!r}; give one of {', '.join(MODES)}")
    image = _image(content.get("image"), path)
    if max(image.shape[:2]) * resolution > MAX_EXTENT:
        raise MapError(
            f"{path}: resolution: {resolution:g} makes {image.shape[1]} x {image.shape[0]} pixels too large "
            f"(limit: {MAX_EXTENT:g} m); is it in m per cell?"
        )
    pixels = image.reshape(1, -1, *image.shape[2:])
    cells = np.empty(pixels.shape[1], dtype=np.int8)
    for begin in range(0, len(cells), _PIXELS_AT_ONCE):
        part = slice(begin, begin + _PIXELS_AT_ONCE)
        shades, opaque = _shades(pixels[:, part], mode)
        cells[part] = _cells(255.0 - shades if negate else shades, opaque, mode, free, occupied)[0]
    rows = cells.reshape(image.shape[:2])[::-1]  # an image's first row is its top
    return Grid(np.ascontiguousarray(rows), resolution, x, y, yaw)


def _cells(
    shades: NDArray[np.float32], opaque: NDArray[np.bool_], mode: str, free: float, occupied: float
) -> NDArray[np.int8]:
    """Return cell values by map_server's rules; shades are 0 (black) to 255."""
    if mode == "raw":
        return np.where(shades <= OCCUPIED, shades, UNKNOWN).astype(np.int8)
    darkness = (255.0 - shades) / 255.0
    between = np.full(shades.shape, UNKNOWN, dtype=np.int8)
    if mode == "scale":
        share = np.clip((darkness - free) / max(occupied - free, 1e-9), 0.0, 1.0)
        between = np.where(opaque, 1.0 + 98.0 * share, UNKNOWN).astype(np.int8)
    return np.where(darkness > occupied, OCCUPIED, np.where(darkness < free, FREE, between)).astype(np.int8)


def _shades(image: NDArray[Any], mode: str) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return mean of the channels, 0 to 255, and which pixels are opaque."""
    pixels = image.astype(np.float32)
    if image.dtype == np.uint16:
        pixels /= 257.0
    if pixels.ndim == 2:
        pixels = pixels[:, :, np.newaxis]
    opaque = np.ones(pixels.shape[:2], dtype=bool)
    if pixels.shape[2] in (2, 4):
        opaque = pixels[:, :, -1] >= 255.0
        if mode != "trinary":  # in that mode map_server counts transparency as a colour
            pixels = pixels[:, :, :-1]
    channels = pixels.shape[2]
    total = pixels[:, :, 0].copy()
    for channel in range(1, channels):  # takes half the time of `mean`
        total += pixels[:, :, channel]
    return total / channels, opaque


def _image(name: Any, path: Path) -> NDArray[Any]:
    if not isinstance(name, str) or not name:
        raise MapError(f"{path}: image: is {name!r}; give the name of an image file")
    file = path.parent / name
    try:
        data = read_bytes(file, MAX_IMAGE_SIZE)
    except InputFileError as error:
        raise MapError(f"{path}: image: {error}") from error
    size = _size(data)
    if size and (size[0] * size[1] > MAX_CELLS or max(size) > MAX_SIDE):
        raise MapError(
            f"{path}: image: {file} has {size[0]} x {size[1]} pixels "
            f"(limits: {MAX_CELLS:,}, {MAX_SIDE:,} along an edge); crop it, or give a coarser one"
        )
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED) if size else None
    except cv2.error:
        image = None
    if image is None or image.dtype not in (np.uint8, np.uint16) or image.shape[1::-1] != size:
        raise MapError(f"{path}: image: {file} is no image that can be read; give a PGM, PNG, BMP or JPEG file")
    return image


def _size(data: bytes) -> tuple[int, int] | None:
    """Return width and height as an image's header tells them, None where it is none that is known."""
    for reader in _READERS:
        with suppress(Exception):  # whatever Pillow raises, it is no image of this kind
            return reader(io.BytesIO(data[:_HEADER_SIZE])).size
    return None


def _origin(value: Any, path: Path) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise MapError(f"{path}: origin: is {value!r}; give [x, y, yaw] in m, m, rad")
    x, y, yaw = (_number(number, f"{path}: origin", "m, m, rad") for number in value)
    return x, y, yaw


def _share(value: Any, where: str) -> float:
    number = _number(value, where, "from 0 to 1")
    if not 0.0 <= number <= 1.0:
        raise MapError(f"{where}: is {number:g}; give a number from 0 to 1")
    return number


def _number(value: Any, where: str, unit: str) -> float:
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not good:
        raise MapError(f"{where}: is {value!r}; give a finite number ({unit})")
    return float(value)
