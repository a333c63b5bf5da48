"""Records, of which a bag consists: a header of named fields, and data. All functions raise one of `DAMAGE`."""

from __future__ import annotations

import bz2
import io
import os
import struct
from typing import BinaryIO

import lz4.frame

_HEADER_LIMIT, _DATA_LIMIT = 1 << 20, 1 << 30
"""Bytes: what claims to be longer is no header, no message."""

_BLOCK, _LARGE_BLOCK = 1 << 16, 1 << 20
UINT32, UINT64, _TIME = struct.Struct("<L"), struct.Struct("<Q"), struct.Struct("<LL")


class DamageError(Exception):
    """The bytes at this place are no record, or end within one."""


DAMAGE = (DamageError, OSError, EOFError, RuntimeError, ValueError, KeyError, IndexError, struct.error)
"""Also what decompression raises."""


class _Part(io.RawIOBase):
    """The next bytes of a file, as a file of their own."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._left = file, size

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        data = self._file.read(min(len(buffer), self._left))
        buffer[: len(data)] = data
        self._left -= len(data)
        return len(data)


def decompressed(file: BinaryIO, compression: str, size: int) -> io.BufferedReader:
    """Return what the next bytes of a file are when decompressed, as a stream."""
    part = io.BufferedReader(_Part(file, size), _BLOCK)
    if compression == "bz2":
        return io.BufferedReader(bz2.BZ2File(part), _BLOCK)
    if compression == "lz4":
        return io.BufferedReader(lz4.frame.LZ4FrameFile(part), _BLOCK)
    raise DamageError


def read_header(stream: BinaryIO) -> dict[bytes, bytes]:
    """Return the fields of the header of the record that comes next."""
    size = read_uint32(stream)
    if size > _HEADER_LIMIT:
        raise DamageError
    return fields_of(_exactly(stream, size))


def fields_of(data: bytes) -> dict[bytes, bytes]:
    """Return fields by their names."""
    fields, place, size = {}, 0, len(data)
    while place < size:
        length = UINT32.unpack_from(data, place)[0]
        name, sign, value = data[place + 4 : place + 4 + length].partition(b"=")
        if not sign:
            raise DamageError
        fields[name] = value
        place += 4 + length
    return fields


def read_data(stream: BinaryIO) -> bytes:
    """Return the data of a record whose header was read."""
    size = read_uint32(stream)
    if size > _DATA_LIMIT:
        raise DamageError
    return _exactly(stream, size)


def skip(stream: BinaryIO, size: int) -> None:
    """Go on behind the next bytes; in a file, maybe behind its end."""
    if isinstance(stream, io.BufferedReader) and isinstance(stream.raw, io.FileIO):
        stream.seek(size, os.SEEK_CUR)
        return
    while size:
        size -= len(_exactly(stream, min(size, _BLOCK)))


def read_uint32(stream: BinaryIO) -> int:
    """Return the number that comes next."""
    return int(UINT32.unpack(_exactly(stream, 4))[0])


def _exactly(stream: BinaryIO, size: int) -> bytes:
    """Read so many bytes. A stream takes memory for all that it is asked for, whether it is there or not."""
    parts, left = [], size
    while left:
        parts.append(stream.read(min(left, _LARGE_BLOCK)))
        if not parts[-1]:
            raise DamageError
        left -= len(parts[-1])
    return parts[0] if len(parts) == 1 else b"".join(parts)


def time_of(data: bytes) -> int:
    """Return a time in ns."""
    seconds, nanoseconds = _TIME.unpack(data)
    return int(seconds * 1_000_000_000 + nanoseconds)
