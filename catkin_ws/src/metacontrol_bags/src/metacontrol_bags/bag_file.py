"""Streams the messages of a bag in any state: closed or not, compressed, cut off or damaged in places.

A bag of format 2.0 is a sequence of records: chunks with messages, and an index of the chunks at its end, which a
recorder writes when it closes the bag. Messages come in the order of the file. Unwanted ones are skipped, and a chunk
is decompressed while it is read. So no more than one message is in memory, however large the bag is.
"""

from __future__ import annotations

import os
import struct
from bisect import bisect_right
from collections import Counter
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from metacontrol_bags.bag_records import (
    DAMAGE,
    UINT32,
    UINT64,
    DamageError,
    decompressed,
    fields_of,
    read_data,
    read_header,
    read_uint32,
    skip,
    time_of,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path
    from types import TracebackType

_MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 5, 6, 7
"""Kinds of records."""


class BagError(ValueError):
    """A bag cannot be used; one line that names it and says what to do."""


class Connection(NamedTuple):
    """One publisher's messages on one topic; empty texts where the bag does not tell.

    Attributes:
        id: within the bag.
        type: of the messages, as PACKAGE/NAME.
        definition: of the type, as `.msg` files have it.
        md5sum: of the definition.
        publisher: name of the node.
    """

    id: int
    topic: str
    type: str
    definition: str
    md5sum: str
    publisher: str


class BagFile:
    """An open bag.

    Attributes:
        path: of the file.
        size: of the file in bytes.
        is_closed: whether the recorder finished the bag, so that it has an index.
        connections: by their ids; in a bag without an index, those met so far.
        counts: messages of each connection, likewise.
        first: stamp of the earliest message in ns; None where there is none.
        last: stamp of the latest message in ns; None where there is none.
        compressions: number of chunks by their compression: none, bz2 or lz4. Only chunks met so far.
        problems: what is wrong with the bag, each in words with a remedy. Damage is met by reading.
    """

    def __init__(self, path: Path) -> None:
        """Open a bag and read its index, if it has one.

        Raises:
            BagError: the file is missing, unreadable, empty or no bag of ROS 1.
        """
        if not os.path.isfile(path):  # False also for what can be no path
            raise BagError(f"{path}: no such bag")
        self.path = path
        self.is_closed = False
        self.connections: dict[int, Connection] = {}
        self.counts: Counter[int] = Counter()
        self.first: int | None = None
        self.last: int | None = None
        self.compressions: Counter[str] = Counter()
        self.problems: list[str] = []
        self._contents: dict[int, frozenset[int]] = {}  # connections in a chunk, by its position
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise BagError(f"{path}: {error.strerror}: check its permissions") from error
        try:
            self.size = os.fstat(self._file.fileno()).st_size
            self._begin = self._read_start()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> BagFile:
        """Return the bag itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self._file.close()

    def scan(self) -> None:
        """Count what the bag holds; quick where it has an index."""
        if not self.is_closed:
            for _ in self.messages(lambda _: False):
                pass

    def messages(self, wanted: Callable[[Connection], bool]) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield the connection, the time of recording in ns and the bytes of each wanted message.

        Read to the end once: what is met on the way goes to the attributes.
        """
        chosen = {connection.id for connection in self.connections.values() if wanted(connection)}
        reading = _Reading(self, wanted, chosen)
        if self.is_closed and not chosen:
            return
        positions = sorted(self._contents)
        place = self._begin
        while place < self.size:
            self._file.seek(place)
            try:
                if self.is_closed and not self._contents.get(place, chosen) & chosen:
                    place = self._after_chunk()
                    continue
                yield from self._record(reading)
                if self._file.tell() > self.size:
                    raise DamageError
                place = self._file.tell()
            except DAMAGE:
                left = positions[bisect_right(positions, place) :]
                self._tell_damage(place, left[0] if left else None)
                place = left[0] if left else self.size
        if reading.strangers:
            self.problems.append(f"{reading.strangers} messages are of unknown topics, whose names are lost")

    def _record(self, reading: _Reading) -> Iterator[tuple[Connection, int, bytes]]:
        """Read one record of the file, a chunk with all that is in it, and stop behind it."""
        header = read_header(self._file)
        if header[b"op"][0] == _CHUNK:
            yield from self._chunk(header, reading)
        else:
            yield from reading.take(header, self._file)

    def _chunk(self, header: dict[bytes, bytes], reading: _Reading) -> Iterator[tuple[Connection, int, bytes]]:
        compression = header[b"compression"].decode()
        stored = read_uint32(self._file)
        begin = self._file.tell()
        is_whole = 0 < stored <= self.size - begin  # the recorder fills in the size when it ends the chunk
        self.compressions[compression] += 1
        try:
            if compression != "none":
                stream = decompressed(self._file, compression, stored if is_whole else self.size - begin)
                while stream.peek(1):
                    yield from reading.take(read_header(stream), stream)
            elif is_whole:  # else its records follow as if there were no chunk
                while self._file.tell() < begin + stored:
                    yield from reading.take(read_header(self._file), self._file)
                if self._file.tell() != begin + stored:
                    raise DamageError
        except DAMAGE:
            if not is_whole:
                raise
            self.problems.append(f"the chunk at byte {begin} is damaged, and messages in it are lost: copy it again")
        if is_whole:
            self._file.seek(begin + stored)

    def _after_chunk(self) -> int:
        """Return where the chunk at this place ends."""
        self.compressions[read_header(self._file)[b"compression"].decode()] += 1
        stored = read_uint32(self._file)
        return self._file.tell() + stored

    def _read_start(self) -> int:
        """Read what a bag begins with, and its index; return where the first chunk is.

        Raises:
            BagError: the file is no bag of ROS 1, or encrypted.
        """
        path = self.path
        if not self.size:
            raise BagError(f"{path}: is empty (0 bytes): the recorder wrote nothing; record again")
        if self._file.read(len(_MAGIC)) != _MAGIC:
            raise BagError(f"{path}: not a bag of ROS 1: it does not begin with {_MAGIC.decode().strip()!r}")
        try:
            header = read_header(self._file)
            skip(self._file, read_uint32(self._file))
            index = UINT64.unpack(header[b"index_pos"])[0]
            chunks = UINT32.unpack(header[b"chunk_count"])[0]
        except DAMAGE:
            raise BagError(f"{path}: its first bytes are damaged: copy it again") from None
        if header.get(b"encryptor"):
            raise BagError(f"{path}: is encrypted: decrypt it with `rosbag decrypt`")
        begin = self._file.tell()
        if not index:
            self.problems.append("it was not closed, so its end may be missing: `rosbag reindex` gives it an index")
        elif index >= self.size and chunks:
            self.problems.append(f"it is cut off: at least {index - self.size} bytes are missing: copy it again")
        else:
            try:
                self._read_index(index, chunks)
                self.is_closed = True
            except DAMAGE:
                self.connections, self._contents = {}, {}
                self.counts.clear()
                self.first = self.last = None
                self.problems.append("its index is damaged: copy it again, or `rosbag reindex` makes another one")
        return begin

    def _read_index(self, place: int, chunks: int) -> None:
        self._file.seek(place)
        while self._file.tell() < self.size:
            header = read_header(self._file)
            if header[b"op"][0] == _CONNECTION:
                self.add(header, read_data(self._file))
            elif header[b"op"][0] == _CHUNK_INFO:
                counts = dict(struct.iter_unpack("<LL", read_data(self._file)))
                self._contents[UINT64.unpack(header[b"chunk_pos"])[0]] = frozenset(counts)
                self.counts.update(counts)
                if counts:
                    self.saw(time_of(header[b"start_time"]))
                    self.saw(time_of(header[b"end_time"]))
            else:
                raise DamageError
        if len(self._contents) != chunks or not self.counts.keys() <= self.connections.keys():
            raise DamageError

    def add(self, header: dict[bytes, bytes], data: bytes) -> Connection:
        """Keep a connection."""
        told = fields_of(data)
        number = UINT32.unpack(header[b"conn"])[0]
        texts = (
            header[b"topic"],
            *(told.get(name, b"") for name in (b"type", b"message_definition", b"md5sum", b"callerid")),
        )
        topic, *others = (text.decode(errors="replace") for text in texts)
        parts = "/".join(filter(None, topic.split("/")))
        # `rosbag record NAME` keeps a name as it was typed, also without the slash.
        self.connections[number] = Connection(number, f"/{parts}", *others)
        return self.connections[number]

    def saw(self, stamp: int) -> None:
        """Take account of a message's time of recording in ns."""
        self.first = stamp if self.first is None else min(self.first, stamp)
        self.last = stamp if self.last is None else max(self.last, stamp)

    def _tell_damage(self, place: int, following: int | None) -> None:
        if following is not None:
            self.problems.append(f"bytes {place} to {following} are damaged: copy it again")
        elif self.is_closed:
            self.problems.append(f"it is damaged from byte {place} on: copy it again")
        else:
            self.problems.append(f"its last {self.size - place} bytes can be read in part at most")


class _Reading:
    """One pass over the messages of a bag.

    Attributes:
        strangers: how many messages are of a connection that nothing describes.
    """

    def __init__(self, bag: BagFile, wanted: Callable[[Connection], bool], chosen: set[int]) -> None:
        self._bag, self._wanted, self._chosen = bag, wanted, chosen
        self.strangers = 0

    def take(self, header: dict[bytes, bytes], stream: BinaryIO) -> Iterator[tuple[Connection, int, bytes]]:
        """Read what follows a record's header; yield it if it is a wanted message."""
        bag, kind = self._bag, header[b"op"][0]
        if kind == _CONNECTION:
            connection = bag.add(header, read_data(stream))
            if self._wanted(connection):
                self._chosen.add(connection.id)
            else:  # a damaged record may have the number of a wanted one
                self._chosen.discard(connection.id)
        elif kind == _MESSAGE:
            number, stamp = UINT32.unpack(header[b"conn"])[0], time_of(header[b"time"])
            data = None
            if number in self._chosen:
                data = read_data(stream)
            else:
                skip(stream, read_uint32(stream))
            if number not in bag.connections:
                self.strangers += 1
                return
            if not bag.is_closed:
                bag.counts[number] += 1
                bag.saw(stamp)
            if data is not None:
                yield bag.connections[number], stamp, data
        else:
            skip(stream, read_uint32(stream))
