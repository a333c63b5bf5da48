"""Defects that bad inputs have found, each by the smallest input that shows it."""

import io
import struct
import time
from types import SimpleNamespace as Thing

import numpy as np
import pytest
from bad_input.unconnected import NOW, unconnected
from geometry_msgs.msg import PoseWithCovarianceStamped
from helpers.campaign_tables import result
from metacontrol_bags.bag_file import BagError, BagFile
from metacontrol_bags.bag_records import DamageError, read_data
from metacontrol_experiments.campaign.matrix import CampaignError
from metacontrol_experiments.campaign.progress import from_row, row
from metacontrol_experiments.io.campaign_folder import read_table
from metacontrol_experiments.io.yardstick_runs import TraceError, read_trace
from metacontrol_experiments.mission.routes import RouteError, parse_route
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.images import read_pixels
from metacontrol_msgs.msg import LaunchedFunction
from move_base.costmap.sensors import cloud_observation
from mros1_reasoner.io.reasoners import make_reasoner
from mros1_reasoner.io.replaying import make_loop
from mros1_reasoner.replay.recording import RecordingError, Run
from node_kit.one_line import LONGEST, OneLineError
from node_kit.yaml_text import YamlError, parse_yaml
from ros_model.errors import ModelError
from ros_model.project.schema_check import violations
from ros_model_extraction.packages.catkin_package import read_package
from ros_model_extraction.packages.cmake import commands
from ros_model_extraction.packages.package_source import extract_package
from rosgraph_launcher.ros.node_messages import report_from
from rosgraph_monitor.observer import StaleInputError
from rosgraph_monitor.observers.safety import cloud_points
from sensor_msgs.msg import Image, PointCloud2, PointField


def cloud(offset: int, step: int = 12, width: int = 1, data: bytes = bytes(12)) -> PointCloud2:
    fields = [PointField(name, offset + 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
    message = PointCloud2(height=1, width=width, fields=fields, point_step=step, row_step=step * width, data=data)
    message.header.frame_id = "camera"
    return message


@pytest.mark.parametrize("bad", [cloud(2**32 - 12), cloud(4), cloud(0, width=2**31)])
def test_cloud_with_coordinates_outside_of_its_points_is_stale_input(bad):
    with pytest.raises(StaleInputError, match="malformed"):
        cloud_points(bad)


def test_empty_clouds_have_no_points():
    empty = cloud(0, step=2**32 - 1, width=0, data=b"")
    assert cloud_points(empty)[0].size == 0
    assert cloud_observation(empty, Thing(sensor_frame="")).points.shape == (0, 3)


@pytest.mark.parametrize(
    "text",
    ["a: &a {b: *a, c: *a}", "&a [[*a, *a], *a]", "&a {x: &b [*a, *b], y: [*b, *a]}"],
)
def test_yaml_in_circles_is_refused_at_once(text):
    begin = time.process_time()
    with pytest.raises(YamlError, match="nested too deep"):
        parse_yaml(text)
    assert time.process_time() - begin < 1.0


def test_whole_number_that_no_float_holds_is_refused_with_its_place():
    with pytest.raises(YamlError, match=r"^2:4: a number is too large"):
        parse_yaml(f"a: 1\nb: {'9' * 400}\n")


def test_error_is_one_short_line_whatever_it_quotes():
    text = str(OneLineError("here: " + "\n\x1b[31m" + "x" * 9000 + ": do that"))
    assert text.isprintable() and len(text) < LONGEST + 50
    assert text.startswith("here: ") and text.endswith(": do that")


def test_errors_of_readers_are_one_line():
    with pytest.raises(RouteError) as raised:
        parse_route({"routes": {"a": {"start": "\n\0" + "x" * 5000, "goal": 1}}}, "a", "file")
    assert str(raised.value).isprintable() and len(str(raised.value)) < LONGEST + 50


@pytest.mark.parametrize("attempts", [-1, 0, 3, 2**62])
def test_row_with_an_impossible_number_of_attempts_is_no_result(attempts):
    with pytest.raises(CampaignError, match="attempts"):
        from_row({**row(result()), "attempts": attempts}, "table")


def test_table_that_is_damaged_is_refused_in_one_line(tmp_path):
    path = tmp_path / "bad.parquet"
    path.write_bytes(b"PAR1" + bytes(30) + struct.pack("<I", 8) + b"PAR1")
    with pytest.raises(CampaignError) as raised:
        read_table(path)
    assert str(raised.value).isprintable()


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"x" * 100])
def test_trace_that_is_none_is_refused(tmp_path, data):
    path = tmp_path / "bad.npz"
    path.write_bytes(data)
    with pytest.raises(TraceError, match=r"bad\.npz.*delete it"):
        read_trace(path)


def test_trace_that_would_fill_the_memory_is_refused(tmp_path):
    path = tmp_path / "bad.npz"
    np.savez_compressed(path, risk=np.zeros(20_000_000))
    with pytest.raises(TraceError, match="holds more than"):
        read_trace(path)


def test_bag_without_a_count_of_its_chunks_is_refused(tmp_path):
    fields = b"".join(struct.pack("<L", len(f)) + f for f in (b"op=\x03", b"index_pos=" + bytes(7) + b"\x01"))
    path = tmp_path / "bad.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + struct.pack("<L", len(fields)) + fields + struct.pack("<L", 0))
    with pytest.raises(BagError, match="damaged"):
        BagFile(path)


@pytest.mark.parametrize(
    ("schema", "wanted"),
    [
        ({"type": "integer"}, "a whole number"),
        ({"anyOf": [{"type": "integer"}, {"type": "array", "title": "a list of x"}]}, "a whole number or a list of x"),
        ({"const": 1}, "another value"),
    ],
)
def test_value_that_a_schema_has_no_title_for_is_told_by_its_type(schema, wanted):
    (found,) = violations("x", schema)
    assert found.message == f"is 'x', must be {wanted}"


def test_package_xml_with_an_odd_format_is_refused(tmp_path):
    (tmp_path / "package.xml").write_text('<package format="x"><name>a</name></package>')
    with pytest.raises(ModelError, match=r"package\.xml:1:1: it can't be read"):
        read_package(tmp_path)


_ROUNDS = "foreach(a 1 2 3 4 5 6 7 8 9)\n" * 12
_WORDS = "set(w 1;2;3;4;5;6;7;8)\n" + "set(w ${w};${w})\n" * 10


@pytest.mark.parametrize(
    "text",
    [
        f"{_ROUNDS}set(x y)\n",
        "foreach(a 1 2)\nset(b c)\n" * 8000,
        "foreach(a RANGE 9999)\nendforeach()\n" * 9000,
        f"{_WORDS}{_ROUNDS}add_library(b ${{w}} ${{w}})\n",
        f"set(w {'x' * 9000})\n{_ROUNDS}list(APPEND b ${{w}})\n",
        f"{_ROUNDS}file(GLOB b {'*.c ' * 100})\n",
        f"{_WORDS}{_ROUNDS}cmake_parse_arguments(b ${{w}} ${{w}} ${{w}} ${{w}})\n",
        "function(f)\nforeach(a ${ARGN})\nf(${ARGN} ${ARGN})\nendforeach()\nendfunction()\nf(1 2 3)\n",
        "#[[\n" * 30_000,
    ],
    ids=["rounds", "loops", "empty loops", "words", "appended", "globs", "keywords", "calls", "comments"],
)
def test_text_of_cmake_that_asks_for_much_work_is_read_in_time(tmp_path, text):
    begin = time.process_time()
    assert len(list(commands(text, tmp_path))) < 20_000
    assert time.process_time() - begin < 5.0


@pytest.mark.parametrize("pattern", [".", "./", "a/" * 3000, "**a", "*" * 50_000])
def test_glob_of_cmake_that_pathlib_can_not_use_finds_nothing(tmp_path, pattern):
    (command, _) = commands(f"file(GLOB files {pattern})\nadd_library(x ${{files}})\n", tmp_path)
    assert command.name == "file"


def test_class_that_a_file_declares_and_makes_again_and_again_is_read_in_time(tmp_path):
    lines = (
        "#include <ros/ros.h>",
        "#include <std_msgs/String.h>",
        "struct Node {",
        '  explicit Node(ros::NodeHandle nh) : nh_(nh) { pub_ = nh_.advertise<std_msgs::String>("out", 1); }',
        "  ros::NodeHandle nh_; ros::Publisher pub_;",
        "};",
        'int main() { Node n(ros::NodeHandle("~")); ros::spin(); }',
    )
    (tmp_path / "node.cpp").write_text("\n".join(lines) * 250)
    (tmp_path / "CMakeLists.txt").write_text("project(mill)\nadd_executable(node node.cpp)\n")
    (tmp_path / "package.xml").write_text(
        "<package><name>mill</name><version>1.0.0</version><description>x</description>"
        "<maintainer email='a@example.org'>a</maintainer><license>x</license></package>"
    )
    begin = time.process_time()
    model = extract_package(tmp_path).model()
    assert [port.name for port in model.packages[0].artifacts[0].nodes[0].ports] == ["~out"]
    assert time.process_time() - begin < 10.0


def test_report_with_an_unknown_state_is_refused_and_the_others_are_kept():
    from metacontrol_msgs.msg import LaunchedFunctions
    from rosgraph_launcher.hosts import HostLauncher
    from rosgraph_manipulator.ros.launcher_reports import LauncherReports, _Known

    with pytest.raises(ValueError, match="state 'ODD'"):
        report_from(LaunchedFunction(function="f", state="ODD"))
    with unconnected() as ros:
        reports = LauncherReports(1.0, 1.0)
        reports._known["/other"] = _Known(HostLauncher("/other", ()), is_here=True)
        for state in ("STABLE", "ODD"):
            message = LaunchedFunctions(functions=[LaunchedFunction(function="f", configuration="a", state=state)])
            message._connection_header = {"callerid": "/other"}
            reports._take(message)
        assert reports.reports()["f"].state == "STABLE"
        assert "left out" in ros.said[0]


@pytest.mark.parametrize("height", [0, 1])
def test_image_without_pixels_is_refused(height):
    with pytest.raises(RobotError):
        read_pixels(Image(height=height, width=1 - height, encoding="rgb8", step=3, data=b""))


@pytest.mark.parametrize(("variance", "x"), [(-1.0, 0.0), (float("nan"), 0.0), (0.01, float("inf"))])
def test_pose_of_the_cell_that_makes_no_sense_is_left_out(variance, x):
    import rospy
    from metacontrol_manipulation.ros.places import BaseOdometry, GivenCell
    from nav_msgs.msg import Odometry

    with unconnected() as ros:
        odometry, stamp = BaseOdometry(), rospy.Time.from_sec(NOW)
        base = Odometry()
        base.header.stamp, base.pose.pose.orientation.w = stamp, 1.0
        odometry._on_odometry(base)
        cell = GivenCell(odometry, 0.0)
        pose = PoseWithCovarianceStamped()
        pose.header.stamp, pose.pose.pose.orientation.w, pose.pose.pose.position.x = stamp, 1.0, x
        pose.pose.covariance[0] = variance
        cell._on_pose(pose)
        assert not cell._is_good()
        assert "ignored" in ros.said[0]


def test_joints_without_fingers_are_left_out():
    import threading

    from metacontrol_manipulation.ros.robot import RosRobot
    from pybullet_simulator.messages.arms import joint_names
    from sensor_msgs.msg import JointState

    robot = object.__new__(RosRobot)
    robot._news, robot._joints, robot._widths, robot._arms = threading.Condition(), {}, {}, {"left": None}
    names = joint_names("left")
    robot._on_joints(JointState(name=names, position=[0.0] * len(names)))
    assert robot.joints == {}


def test_driver_of_an_arm_takes_the_last_moment_that_a_stamp_can_tell():
    import rospy
    from pybullet_simulator.ros.arm import ArmNode
    from simulator_msgs.msg import ArmState

    with unconnected():
        node = ArmNode()
        node._on_state(ArmState(stamp=rospy.Time(2**32 - 1, 999_999_999), positions=[0.0] * 7))
        assert node._state is not None
        before = node._state
        node._on_state(ArmState(stamp=rospy.Time(2**32, 1), positions=[0.0] * 7))
        assert node._state is before


def test_transform_whose_stamp_tf2_cannot_hold_is_left_out_and_the_others_are_kept():
    import rospy
    from geometry_msgs.msg import TransformStamped
    from move_base.ros.frames import TfTransformer
    from tf2_msgs.msg import TFMessage

    def transform(child, stamp):
        made = TransformStamped(child_frame_id=child)
        made.header.frame_id, made.header.stamp, made.transform.rotation.w = "map", stamp, 1.0
        return made

    with unconnected() as ros:
        frames = TfTransformer()
        late = [rospy.Time(2**32, 5), rospy.Time(2**32 - 1, 999_999_999), rospy.Time(2**31 - 1, 999_999_999)]
        message = TFMessage([*(transform("late", stamp) for stamp in late), transform("base", rospy.Time(1))])
        message._connection_header = {"callerid": "/other"}
        for subscriber in ros.listening("/tf"):
            subscriber.give(message)
        assert frames.lookup("map", "base", None) is not None
        assert frames.lookup("map", "late", None) is None
        assert frames.lookup("map", "base", 2.0**32 + 3.0) is None
        assert frames.lookup("map", "base", 2.0**31) is None
        assert "are stamped" in ros.said[0]


def test_record_that_claims_to_be_large_takes_no_memory_before_it_is_there():
    class Stream(io.BytesIO):
        def read(self, size=-1):
            assert 0 <= size <= 1 << 20
            return super().read(size)

    with pytest.raises(DamageError):
        read_data(Stream(struct.pack("<L", 1 << 29) + bytes(5)))
    data = bytes(range(256)) * 9000
    assert read_data(Stream(struct.pack("<L", len(data)) + data)) == data
    assert read_data(Stream(struct.pack("<L", 0))) == b""


@pytest.mark.parametrize("files", [{"a\0b.owl": ""}, {f"{'x' * 300}.owl": ""}, {"a.owl": "\ud800"}])
def test_recorded_ontology_that_no_file_can_hold_is_told(files):
    with pytest.raises(RecordingError, match=r"^the recorded ontology '"):
        make_loop(Run("reasoner", files=files), make_reasoner("rules"))
