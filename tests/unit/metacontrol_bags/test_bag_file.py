"""Bags in every state: what can be read is read, and the rest is told."""

import io
import json
import struct

import pytest
import rosbag
import rospy
from metacontrol_bags.bag import BagError, read_record, salvage
from metacontrol_bags.bag_file import BagFile
from metacontrol_bags.metrics import summarise
from rosbags.rosbag1 import Reader, Writer
from std_msgs.msg import Float32, String

COMPRESSIONS = ("none", "bz2", "lz4")
CHUNK = 2000
INDEX_POSITION = b"index_pos="


def index_of(path):
    """Return where the index of a closed bag begins."""
    content = path.read_bytes()
    place = content.index(INDEX_POSITION) + len(INDEX_POSITION)
    return struct.unpack_from("<Q", content, place)[0]


def without_index(path, target):
    """Write what a recorder leaves that ended between two chunks."""
    content = bytearray(path.read_bytes()[: index_of(path)])
    place = content.index(INDEX_POSITION) + len(INDEX_POSITION)
    content[place : place + 8] = bytes(8)
    target.write_bytes(content)
    return target


def killed(messages, target, compression):
    """Leave what Debian's recorder has on the disk before it closes the bag, its last chunk unfinished."""
    recording = target.with_name("recording.bag")
    bag = rosbag.Bag(str(recording), "w", compression=compression, chunk_threshold=20_000)
    for stamp, topic, message in messages:
        bag.write(topic, message, rospy.Time.from_sec(stamp))
    bag._file.flush()
    target.write_bytes(recording.read_bytes())
    bag.close()
    return target


def numbers(path):
    """Return the bag, and stamp and value of its messages on /number."""
    with BagFile(path) as bag:
        found = list(bag.messages(lambda connection: connection.topic == "/number"))
    return bag, [(stamp, struct.unpack("<f", data)[0]) for _, stamp, data in found]


@pytest.fixture
def series(bag):
    """Return a bag of 400 numbers, each beside a text that takes room."""
    for number in range(400):
        bag.add(10.0 + number, "/number", Float32(number))
        bag.add(10.0 + number, "/text", String("x" * 50))
    return bag


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_compressed_bag_tells_the_same_as_a_plain_one(mission_bag, tmp_path, compression):
    plain = salvage(mission_bag.write(tmp_path / "plain.bag"))
    found = salvage(mission_bag.write(tmp_path / "packed.bag", compression, CHUNK))
    assert found.problems == ()
    assert summarise(found.record) == summarise(plain.record)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_messages_are_those_of_the_library(series, tmp_path, compression):
    path = series.write(tmp_path / "series.bag", compression, CHUNK)
    with Reader(path) as reader:
        expected = [(connection.topic, stamp, data) for connection, stamp, data in reader.messages()]
        first, last, count = reader.start_time, reader.end_time - 1, reader.message_count
    with BagFile(path) as bag:
        assert (bag.first, bag.last, bag.counts.total()) == (first, last, count)
        assert sorted((c.topic, stamp, data) for c, stamp, data in bag.messages(lambda _: True)) == sorted(expected)
        assert bag.problems == []


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_bag_without_index_is_read_in_full(mission_bag, tmp_path, compression):
    whole = mission_bag.write(tmp_path / "whole.bag", compression, CHUNK)
    found = salvage(without_index(whole, tmp_path / "unindexed.bag"))
    assert len(found.problems) == 1 and "rosbag reindex" in found.problems[0]
    assert summarise(found.record) == summarise(salvage(whole).record)


@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_killed_recorder_loses_the_unfinished_chunk_at_most(series, tmp_path, compression):
    bag, found = numbers(killed(series.messages, tmp_path / "series.bag.active", compression))
    assert not bag.is_closed and "was not closed" in bag.problems[0]
    lost = 400 - len(found)
    assert [value for _, value in found] == list(range(len(found)))
    assert lost == 0 if compression == "none" else lost <= 130  # that many messages go into a chunk


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("share", [0.2, 0.5, 0.95])
def test_cut_bag_gives_what_is_before_the_cut(series, tmp_path, compression, share):
    path = series.write(tmp_path / "cut.bag", compression, CHUNK)
    cut = int(index_of(path) * share)
    with Reader(path) as reader:
        (connection,) = reader.topics["/number"].connections
        ends = {place: chunk.datapos + chunk.datasize for place, chunk in reader.chunks.items()}
        before = sum(ends[entry.chunk_pos] <= cut for entry in reader.indexes[connection.id])
    path.write_bytes(path.read_bytes()[:cut])
    bag, found = numbers(path)
    assert [value for _, value in found] == list(range(len(found)))
    assert len(found) >= before > 0
    assert "is cut off" in bag.problems[0] and "copy it again" in bag.problems[0]


@pytest.mark.parametrize("compression", COMPRESSIONS)
@pytest.mark.parametrize("is_indexed", [True, False])
def test_damage_costs_no_more_than_its_chunk(series, tmp_path, compression, is_indexed):
    path = series.write(tmp_path / "damaged.bag", compression, CHUNK)
    middle = index_of(path) // 2
    with Reader(path) as reader:
        place = min(chunk.datapos for chunk in reader.chunks.values() if chunk.datapos > middle)
    if not is_indexed:
        path = without_index(path, tmp_path / "unindexed.bag")
    content = bytearray(path.read_bytes())
    content[place + 20 : place + 50] = b"\xff" * 30
    path.write_bytes(content)
    bag, found = numbers(path)
    assert 300 < len(found) <= 400
    assert found[-1][1] == 399
    assert sum(f"chunk at byte {place} is damaged" in problem for problem in bag.problems) == 1


def test_damaged_index_does_not_matter(series, tmp_path):
    path = series.write(tmp_path / "damaged.bag", chunk_bytes=CHUNK)
    content = bytearray(path.read_bytes())
    content[index_of(path) + 40 :] = b"\xff" * (len(content) - index_of(path) - 40)
    path.write_bytes(content)
    bag, found = numbers(path)
    assert len(found) == 400
    assert "index is damaged" in bag.problems[0]


def test_every_cut_and_every_changed_byte_is_survived(bag, tmp_path):
    for number in range(6):
        bag.add(1.0 + number, "/mission/event", String("x"))
    content = bag.write(tmp_path / "whole.bag", chunk_bytes=100).read_bytes()
    path = tmp_path / "bad.bag"
    places = [*range(0, len(content), 11)]
    spoilt = [content[:place] for place in places]
    spoilt += [content[:place] + bytes([content[place] ^ 0xFF]) + content[place + 1 :] for place in places]
    for data in spoilt:
        path.write_bytes(data)
        try:
            salvage(path)
        except BagError as error:
            assert str(path) in str(error) and len(str(error).splitlines()) == 1


def test_jumbled_bag_is_told_in_the_order_of_time(mission_bag, tmp_path):
    ordered = summarise(read_record(mission_bag.write(tmp_path / "ordered.bag")))
    path = tmp_path / "jumbled.bag"
    with Writer(path) as writer:
        connections = {}
        for stamp, topic, message in reversed(mission_bag.messages):
            name = message._type.replace("/", "/msg/")
            options = {"msgdef": message._full_text, "md5sum": message._md5sum}
            connection = connections.get(topic) or writer.add_connection(topic, name, **options)
            connections[topic] = connection
            buffer = io.BytesIO()
            message.serialize(buffer)
            writer.write(connection, round(stamp * 1e9), buffer.getvalue())
    assert summarise(read_record(path)) == ordered


def test_empty_file_and_bag_without_messages_are_told_apart(tmp_path):
    (tmp_path / "nothing.bag").touch()
    with pytest.raises(BagError, match=r"nothing\.bag: is empty \(0 bytes\)"):
        salvage(tmp_path / "nothing.bag")
    with Writer(tmp_path / "silent.bag"):
        pass
    found = salvage(tmp_path / "silent.bag")
    assert (found.topics, found.problems) == (frozenset(), ())


@pytest.mark.parametrize("content", [b"SQLite format 3\0", b"\x89MCAP0\r\n", b"#ROSBAG V1.2\n", b"\0" * 100])
def test_file_of_another_format_is_refused(tmp_path, content):
    (tmp_path / "other.bag").write_bytes(content)
    with pytest.raises(BagError, match=r"other\.bag: not a bag of ROS 1"):
        salvage(tmp_path / "other.bag")


def test_messages_without_definition_cost_only_their_topic(mission_bag, tmp_path):
    path = mission_bag.write(tmp_path / "whole.bag")
    with Reader(path) as reader, Writer(tmp_path / "foreign.bag") as writer:
        for connection in reader.connections:
            foreign = connection.topic == "/mros1_reasoner/decision"
            name = "strange_msgs/msg/Strange" if foreign else connection.msgtype
            copy = writer.add_connection(
                connection.topic, name, msgdef="" if foreign else connection.msgdef.data, md5sum="0" * 32
            )
            for _, stamp, data in reader.messages([connection]):
                writer.write(copy, stamp, data)
    found = salvage(tmp_path / "foreign.bag")
    assert found.record.decisions == ()
    assert found.record.events == salvage(path).record.events
    (problem,) = found.problems
    assert problem == (
        "2 messages on /mros1_reasoner/decision are of the type strange_msgs/Strange, which the bag does not define"
    )
    with pytest.raises(BagError, match="strange_msgs"):
        read_record(tmp_path / "foreign.bag")


def test_topic_of_another_type_is_left_out(mission_bag, tmp_path):
    mission_bag.add(12.0, "/rosgraph_manipulator/active_configuration", String("text"))
    plain = String("not a map")
    mission_bag.add(12.0, "/move_base/result", plain)
    mission_bag.messages = [m for m in mission_bag.messages if m[2] is plain or m[1] != "/move_base/result"]
    found = salvage(mission_bag.write(tmp_path / "mixed.bag"))
    assert any("/move_base/result do not fit" in problem for problem in found.problems)
    assert json.dumps(summarise(found.record))
