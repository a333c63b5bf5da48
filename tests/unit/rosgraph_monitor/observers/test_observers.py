"""Observers without ROS: messages and time in, statuses out."""

import enum
import io
import math

import numpy as np
import pytest
import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from ros_model.language.metamodel import Component, Connection, ConnectionKind, RosParameter, RosSystem
from rosgraph_monitor.observer import Observer, StaleInputError, TopicObserver
from rosgraph_monitor.observers.cpu import CpuLoadQualityObserver
from rosgraph_monitor.observers.energy import EnergyQualityObserver
from rosgraph_monitor.observers.frames import StaticFrames, rotation_translation
from rosgraph_monitor.observers.light import LightObserver
from rosgraph_monitor.observers.localization import LocalizationQualityObserver
from rosgraph_monitor.observers.objective import ObjectiveErrorObserver
from rosgraph_monitor.observers.safety import (
    CLOUD,
    ODOMETRY,
    REAR_SCAN,
    SCAN,
    STATIC_FRAMES,
    SafetyQualityObserver,
    cloud_points,
    navigation_sensor,
    scan_points,
)
from sensor_msgs.msg import Illuminance, LaserScan, PointCloud2, PointField
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage


class PublishedObserver(TopicObserver):
    """As users of the published monitor write them."""

    def __init__(self, name):
        topics = [("/speed", Float32), ("/accel", Float32)]
        super().__init__(name, 10, topics)

    def calculate_attr(self, msgs):
        status_msg = DiagnosticStatus()
        status_msg.level = DiagnosticStatus.OK
        status_msg.name = self._id
        status_msg.values.append(KeyValue("comfort", str(msgs[0].data + msgs[1].data)))
        status_msg.message = "QA status"
        return status_msg


def published(speed=1.0, accel=2.0, at=0.0):
    observer = PublishedObserver("ComfortQualityObserver")
    observer.receive("/speed", Float32(speed), at)
    observer.receive("/accel", Float32(accel), at)
    return observer


def test_published_observer_runs_unchanged():
    (status,) = published().evaluate(0.5)
    assert (status.message, status.values[0].key, status.values[0].value) == ("QA status", "comfort", "3.0")
    assert status.hardware_id == "ComfortQualityObserver"


@pytest.mark.parametrize(("now", "speed", "reason"), [(1.5, 1.0, "1.5 s old"), (0.5, math.nan, "not a finite")])
def test_old_input_and_bad_values_are_stale(now, speed, reason):
    observer = published(speed)
    observer.evaluate(0.1)
    (status,) = observer.evaluate(now)
    assert (status.message, status.level) == ("QA stale", DiagnosticStatus.STALE)
    assert status.values[0].key == "comfort"
    assert reason in status.values[0].value


class ScanAge(TopicObserver):
    """The age of a scan's data as its level, in s."""

    qa_name = "scan_age"

    def calculate_attr(self, msgs):
        return self.qa_status(self.age(msgs[0]))


@pytest.mark.parametrize(("stamp", "told"), [(99.5, "1.0"), (0.0, "sensor_msgs/LaserScan has no stamp")])
def test_age_of_a_message_is_by_its_stamp_and_the_time_of_the_evaluation(stamp, told):
    observer = ScanAge("ScanAge", 5.0, [("scan", LaserScan)])
    scan = LaserScan()
    scan.header.stamp = rospy.Time.from_sec(stamp)
    observer.receive("scan", scan, 100.0)
    (status,) = observer.evaluate(100.5)
    assert told in status.values[0].value
    assert observer.now() == 100.5


def test_missing_input_is_stale_under_the_name_of_the_observer():
    (status,) = PublishedObserver("ComfortQualityObserver").evaluate(0.0)
    assert status.values[0].key == "comfort"
    assert "no message on /speed" in status.values[0].value


def test_reset_forgets_messages_from_the_future():
    observer = published(at=100.0)
    observer.reset()
    assert observer.evaluate(1.0)[0].message == "QA stale"


def test_energy():
    observer = EnergyQualityObserver()
    observer.receive("power_load", Float32(5.0), 10.0)
    assert float(observer.evaluate(12.0)[0].values[0].value) == 1.0
    assert observer.evaluate(13.5)[0].message == "QA stale"
    observer.receive("power_load", Float32(math.inf), 14.0)
    assert observer.evaluate(14.0)[0].message == "QA stale"


@pytest.mark.parametrize(
    ("measured", "told"), [(75.0, 0.25), (0.0, 0.0), (60000.0, 200.0), (-1.0, None), (math.nan, None)]
)
def test_light_is_a_share_of_that_of_a_well_lit_place(measured, told):
    observer = LightObserver()
    observer.receive("illuminance", Illuminance(illuminance=measured), 1.0)
    (status,) = observer.evaluate(1.5)
    assert (float(status.values[0].value) if status.message == "QA status" else None) == told
    assert status.values[0].key == "light"
    assert observer.evaluate(2.5)[0].message == "QA stale"


def test_light_sensor_of_another_robot():
    observer = LightObserver()
    observer.configure({"topic": "mast/photometer", "well_lit": 1000.0})
    assert observer.topics == [("mast/photometer", Illuminance)]
    observer.receive("mast/photometer", Illuminance(illuminance=500.0), 1.0)
    assert float(observer.evaluate(1.0)[0].values[0].value) == 0.5
    observer.configure({"well_lit": 0.0})
    assert "give the lx" in observer.evaluate(1.0)[0].values[0].value


def odometry(vx=0.0, vy=0.0):
    msg = Odometry()
    msg.twist.twist.linear.x, msg.twist.twist.linear.y = vx, vy
    return msg


def scan(**ranges_by_degree):
    msg = LaserScan(angle_min=math.radians(-135), angle_max=math.radians(135), angle_increment=math.radians(1))
    msg.range_min, msg.range_max = 0.05, 10.0
    msg.header.frame_id = "front_laser"
    msg.ranges = [10.0] * 271
    for degree, distance in ranges_by_degree.items():
        msg.ranges[int(degree.replace("_", "").replace("m", "-")) + 135] = distance
    return msg


def frames(child="camera_link", x=0.0, z=0.0, yaw=0.0):
    stamped = TransformStamped()
    stamped.header.frame_id, stamped.child_frame_id = "base_link", child
    stamped.transform.translation.x, stamped.transform.translation.z = x, z
    stamped.transform.rotation.z, stamped.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    return TFMessage([stamped])


def cloud(points):
    data = np.asarray(points, dtype="<f4")
    fields = [PointField(axis, 4 * i, PointField.FLOAT32, 1) for i, axis in enumerate("xyz")]
    msg = PointCloud2(height=1, width=len(data), fields=fields, point_step=12, data=data.tobytes())
    msg.header.frame_id = "camera_link"
    return msg


def following(sensor):
    observer = SafetyQualityObserver()
    source = {SCAN: "scan", REAR_SCAN: "rear_scan", CLOUD: "point_cloud"}[sensor]
    parameter = RosParameter("local_costmap/obstacles_layer/observation_sources", value=source)
    observer.follow(RosSystem("s", components=(Component("move_base", parameters=(parameter,)),)))
    return observer


def risk(observer, now=1.0):
    (status,) = observer.evaluate(now)
    assert status.message == "QA status", status
    return float(status.values[0].value)


def fed(observer, vx, vy, *others):
    observer.receive(ODOMETRY, odometry(vx, vy), 1.0)
    for topic, msg in others:
        observer.receive(topic, msg, 1.0)
    return observer


def test_safety_counts_the_obstacle_ahead():
    observer = fed(following(SCAN), 0.4, 0.0, (SCAN, scan(_0=0.25)))
    assert risk(observer) == pytest.approx(0.75)
    assert [(topic, msg.data) for topic, msg in observer.take_outputs()] == [("d_obstacle", pytest.approx(0.25))]


def test_safety_ignores_what_lies_behind_the_motion():
    assert risk(fed(following(SCAN), 0.0, 0.4, (SCAN, scan(m91=0.25, m45=0.25)))) == 0.0


def test_robot_at_rest_is_no_risk():
    assert risk(fed(following(SCAN), 0.0, 0.0, (SCAN, scan(_0=0.1)))) == 0.0


def test_nothing_seen_is_no_risk_and_the_distance_stays_finite():
    observer = fed(following(SCAN), 0.4, 0.0, (SCAN, scan()))
    assert risk(observer) == 0.0
    assert observer.take_outputs()[0][1].data == 10.0


def test_laser_may_look_elsewhere():
    observer = fed(following(SCAN), -0.4, 0.0, (SCAN, scan(_0=0.5)))
    assert risk(observer) == 0.0
    observer.receive(STATIC_FRAMES, frames("front_laser", yaw=math.pi), 0.0)
    assert risk(observer) == pytest.approx(0.5)


def rear_scan(**ranges_by_degree):
    msg = scan(**ranges_by_degree)
    msg.header.frame_id = "rear_laser"
    return msg


def test_rear_laser_sees_what_is_behind_a_robot_that_drives_backwards():
    mount = (STATIC_FRAMES, frames("rear_laser", x=-0.4, yaw=math.pi))
    observer = fed(following(REAR_SCAN), -0.4, 0.0, (REAR_SCAN, rear_scan(_0=0.25, m120=0.1)), mount)
    assert risk(observer) == pytest.approx(0.75)
    assert dict(observer.topics).keys() >= {REAR_SCAN} and SCAN not in dict(observer.topics)
    observer.receive(ODOMETRY, odometry(0.4), 1.0)
    assert risk(observer) == pytest.approx(0.9)  # ahead, it sees the return 60 degrees to a side
    observer.receive(ODOMETRY, odometry(-0.4), 2.0)
    (status,) = observer.evaluate(2.0)
    assert status.message == "QA stale" and "rear/scan" in status.values[0].value


def test_rear_laser_of_another_robot_has_a_topic_of_its_own_and_needs_its_place():
    observer = SafetyQualityObserver()
    observer.configure({"rear_scan_topic": "aft/beam", "base_frame": "hull"})
    wired = Connection("/aft/beam", ConnectionKind.TOPIC, (), ())
    observer.follow(RosSystem("ferry", connections=(wired,)))
    fed(observer, -0.4, 0.0, ("aft/beam", rear_scan(_0=0.25)))
    assert "no fixed transform from rear_laser to hull" in observer.evaluate(1.0)[0].values[0].value
    mount = frames("rear_laser", yaw=math.pi)
    mount.transforms[0].header.frame_id = "hull"
    observer.receive(STATIC_FRAMES, mount, 1.0)
    assert risk(observer) == pytest.approx(0.75)


def test_distance_may_be_measured_from_the_centre():
    observer = fed(following(SCAN), 0.4, 0.0, (SCAN, scan(_0=0.25)), (STATIC_FRAMES, frames("front_laser", x=0.4)))
    observer.configure({"measured_from": "centre"})
    assert risk(observer) == pytest.approx(0.35)


def test_silent_laser_is_stale_and_never_fine():
    observer = fed(following(SCAN), 0.4, 0.0, (SCAN, scan()))
    observer.receive(ODOMETRY, odometry(0.4), 2.0)
    (status,) = observer.evaluate(2.0)
    assert status.message == "QA stale"
    assert "front/scan" in status.values[0].value
    assert observer.take_outputs() == []


def test_camera_configuration_uses_the_cloud_without_the_floor():
    points = [(0.5, 0.0, 0.0), (0.2, 0.0, -0.5), (math.nan, 0.0, 0.0)]
    observer = fed(following(CLOUD), 0.4, 0.0, (CLOUD, cloud(points)), (STATIC_FRAMES, frames(x=0.3, z=0.5)))
    assert risk(observer) == pytest.approx(0.5)
    assert SCAN not in dict(observer.topics)


def test_cloud_without_transform_is_stale():
    observer = fed(following(CLOUD), 0.4, 0.0, (CLOUD, cloud([(1.0, 0.0, 0.0)])))
    assert "no fixed transform" in observer.evaluate(1.0)[0].values[0].value


def test_without_configuration_the_cloud_stands_in_for_a_silent_laser():
    observer = fed(SafetyQualityObserver(), 0.4, 0.0, (STATIC_FRAMES, frames(z=0.5)))
    assert CLOUD not in dict(observer.topics)
    assert observer.evaluate(1.0)[0].message == "QA stale"
    assert CLOUD in dict(observer.topics)
    observer.receive(CLOUD, cloud([(0.25, 0.0, 0.0)]), 1.0)
    assert risk(observer) == pytest.approx(0.75)


@pytest.mark.parametrize("settings", [{"gain": 1.0}, {"braking_gain": "x"}, {"base_frame": 1}, {"half_angle": True}])
def test_bad_settings_are_refused(settings):
    with pytest.raises(ValueError, match="SafetyQualityObserver/"):
        SafetyQualityObserver().configure(settings)


def test_physical_formula_is_a_setting():
    observer = fed(following(SCAN), 1.0, 0.0, (SCAN, scan(_0=0.5)))
    observer.configure({"max_deceleration": 1.0, "reaction_time": 0.5})
    assert risk(observer) == pytest.approx(0.5)


def test_wiring_names_the_sensor_where_no_parameter_does():
    wired = Connection("/camera/depth/points", ConnectionKind.TOPIC, (), ())
    assert navigation_sensor(RosSystem("s", connections=(wired,))) == CLOUD
    assert navigation_sensor(RosSystem("s")) is None


def test_scan_leaves_out_what_is_no_return():
    msg = scan()
    msg.ranges = [math.nan, math.inf, 0.01, 10.0, 1.0]
    x, _ = scan_points(msg)
    assert len(x) == 1


def test_obstacle_closer_than_the_laser_measures_is_a_risk():
    msg = scan(_0=-math.inf)
    assert risk(fed(following(SCAN), 0.4, 0.0, (SCAN, msg))) == pytest.approx(0.95)
    assert msg.ranges[135] == -math.inf, "the message is left as it is"


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        ({"ranges": []}, "no measurement among 0 ranges"),
        ({"ranges": [math.nan] * 271}, "no measurement among 271 ranges"),
        ({"angle_increment": math.nan}, "malformed: angle_min"),
        ({"angle_increment": 0.0}, "malformed: angle_min"),
        ({"angle_min": math.inf}, "malformed: angle_min"),
        ({"range_max": math.nan}, "malformed: range_min"),
        ({"range_max": 0.0}, "malformed: range_min"),
        ({"range_min": math.nan}, "malformed: range_min"),
    ],
)
def test_scan_that_says_nothing_is_stale_and_never_fine(spoil, told):
    msg = scan(_0=0.25)
    for name, value in spoil.items():
        setattr(msg, name, value)
    observer = fed(following(SCAN), 0.4, 0.0, (SCAN, msg))
    (status,) = observer.evaluate(1.0)
    assert status.message == "QA stale" and told in status.values[0].value
    assert observer.take_outputs() == []


@pytest.mark.parametrize("ranges", [[math.inf] * 271, [math.nan] * 270 + [math.inf]])
def test_scan_without_returns_is_no_risk(ranges):
    msg = scan()
    msg.ranges = ranges
    assert risk(fed(following(SCAN), 0.4, 0.0, (SCAN, msg))) == 0.0


def test_sensor_of_one_beam_needs_no_increment():
    msg = LaserScan(range_min=0.05, range_max=4.0, ranges=[0.5])
    assert [axis.tolist() for axis in scan_points(msg)] == [[0.5], [0.0]]


@pytest.mark.parametrize("padding", [0, 8])
def test_rows_of_a_cloud_may_be_padded(padding):
    rows = np.asarray([[[5, 0, 0.5], [6, 0, 0.5]], [[7, 1, 0.5], [8, 1, 0.5]]], dtype="<f4")
    msg = cloud([(0.0, 0.0, 0.0)])
    msg.height = msg.width = 2
    msg.row_step = 24 + padding
    msg.data = b"".join(row.tobytes() + b"\xff" * padding for row in rows)
    assert [axis.tolist() for axis in cloud_points(msg)] == [[5, 6, 7, 8], [0, 0, 1, 1], [0.5] * 4]
    msg.row_step = 2**32 - 1
    with pytest.raises(StaleInputError, match="malformed"):
        cloud_points(msg)


@pytest.mark.parametrize("spoil", [{"data": b"123"}, {"fields": []}, {"point_step": 2}])
def test_malformed_cloud_is_stale(spoil):
    msg = cloud([(1.0, 2.0, 3.0)])
    for name, value in spoil.items():
        setattr(msg, name, value)
    observer = fed(following(CLOUD), 0.4, 0.0, (CLOUD, msg), (STATIC_FRAMES, frames()))
    assert "malformed" in observer.evaluate(1.0)[0].values[0].value


def test_big_endian_cloud():
    msg = cloud([(1.0, 2.0, 3.0)])
    msg.data, msg.is_bigendian = np.asarray([1.0, 2.0, 3.0], dtype=">f4").tobytes(), True
    assert [axis[0] for axis in cloud_points(msg)] == [1.0, 2.0, 3.0]


def test_chain_of_frames():
    tree = StaticFrames()
    tree.add(frames("mast", x=1.0, yaw=math.pi / 2))
    step = frames("lens", x=1.0)
    step.transforms[0].header.frame_id = "mast"
    tree.add(step)
    assert tree.transform("lens", "base_link")[:3, 3] == pytest.approx([1.0, 1.0, 0.0])
    assert tree.transform("lens", "elsewhere") is None
    assert rotation_translation((0, 0, 0, 0), (0, 0, 0)) is None


def test_sensor_topics_are_settings():
    observer = SafetyQualityObserver()
    observer.configure({"scan_topic": "laser", "odometry_topic": "odom"})
    assert dict(observer.topics).keys() >= {"laser", "odom"}
    for topic, msg in (("odom", odometry(0.4)), ("laser", scan(_0=0.25))):
        observer.receive(topic, msg, 1.0)
    assert risk(observer) == pytest.approx(0.75)


def test_rate_of_a_topic_falls_while_it_is_silent():
    observer = PublishedObserver("ComfortQualityObserver")
    for i in range(11):
        observer.receive("/speed", Float32(0.0), 0.1 * i)
    assert observer.rate("/speed", 1.0) == pytest.approx(10.0)
    assert observer.rate("/speed", 5.0) == pytest.approx(2.0)
    assert observer.rate("/accel", 5.0) == 0.0


def test_hysteresis_holds_the_level_until_it_has_moved_far_enough():
    observer = EnergyQualityObserver()
    observer.configure({"hysteresis": 0.05})
    levels = [float(observer.qa_status(level).values[0].value) for level in (0.5, 0.54, 0.46, 0.56, 0.52)]
    assert levels == [0.5, 0.5, 0.5, 0.56, 0.56]


def test_rate_and_age_are_settings_of_every_observer():
    observer = published()
    observer.configure({"max_age": 9.0, "rate_hz": 2})
    assert observer.rate_hz == 2.0
    assert observer.evaluate(8.0)[0].message == "QA status"


@pytest.mark.parametrize("settings", [{"rate_hz": 0}, {"max_age": -1}, {"hysteresis": "x"}, {"unknown": 1}])
def test_bad_settings_of_any_observer_are_refused(settings):
    with pytest.raises(ValueError, match="ComfortQualityObserver/"):
        published().configure(settings)


@pytest.mark.parametrize("rate", [1e-10, 1e12, math.nan])
def test_rate_at_which_no_thread_can_work_is_refused(rate):
    with pytest.raises(ValueError, match=r"ComfortQualityObserver.*rate"):
        published().configure({"rate_hz": rate})
    with pytest.raises(ValueError, match="Hz must be from 1e-06 to 1000"):
        TopicObserver("Odd", rate, [])


def test_truth_value_of_a_published_observer_is_no_stale_number():
    class TaskObserver(TopicObserver):
        def calculate_attr(self, msgs):
            return DiagnosticStatus(message="QA status", values=[KeyValue("objetive_error", "True")])

    (status,) = TaskObserver("TaskObserver", 1.0, []).evaluate(0.0)
    assert status.message == "QA status"


def pose(**variances):
    msg = PoseWithCovarianceStamped()
    covariance = [0.0] * 36
    covariance[0], covariance[7] = variances.get("x", 0.0), variances.get("y", 0.0)
    covariance[1] = covariance[6] = variances.get("xy", 0.0)
    msg.pose.covariance = covariance
    return msg


@pytest.mark.parametrize(
    ("variances", "level"),
    [
        ({}, 0.0),
        ({"x": 0.0625, "y": 0.01}, 0.5),
        ({"x": 1.0, "y": 0.1}, 1.0),
        ({"x": 0.02, "y": 0.02, "xy": 0.0025}, 0.3),
    ],
)
def test_localization(variances, level):
    observer = LocalizationQualityObserver()
    observer.receive("amcl_pose", pose(**variances), 0.0)
    assert risk(observer, 0.5) == pytest.approx(level)


@pytest.mark.parametrize("variances", [{"x": math.nan}, {"x": -1.0}, {"x": 0.01, "y": 0.01, "xy": 1.0}])
def test_covariance_that_is_none_is_stale(variances):
    observer = LocalizationQualityObserver()
    observer.receive("amcl_pose", pose(**variances), 0.0)
    assert observer.evaluate(0.5)[0].message == "QA stale"


def test_cpu_load_is_a_level(monkeypatch):
    class Times(tuple):
        idle = property(lambda self: self[1])

    times = iter([Times((10.0, 90.0)), Times((13.0, 91.0))])
    monkeypatch.setattr("rosgraph_monitor.observers.cpu.psutil.cpu_times", lambda: next(times))
    observer = CpuLoadQualityObserver()
    assert observer.evaluate(0.0)[0].message == "QA stale"
    assert risk(observer) == pytest.approx(0.75)


def goals(*entries):
    msg = GoalStatusArray()
    for name, second, state in entries:
        msg.status_list.append(GoalStatus(GoalID(rospy.Time(second), name), state, ""))
    return msg


def told(observer, msg):
    observer.receive("move_base/status", msg, 0.0)
    observer.evaluate(0.0)
    return [sent.data for _, sent in observer.take_outputs()]


def test_aborted_goal_is_an_objective_error_until_the_next_goal():
    observer = ObjectiveErrorObserver()
    assert told(observer, goals(("a", 1, GoalStatus.ACTIVE))) == []
    assert told(observer, goals(("a", 1, GoalStatus.ABORTED))) == [True]
    assert observer.evaluate(0.0)[0].level == DiagnosticStatus.ERROR
    assert told(observer, goals(("a", 1, GoalStatus.ABORTED))) == []
    assert told(observer, goals(("a", 1, GoalStatus.ABORTED), ("b", 2, GoalStatus.ACTIVE))) == [False]
    assert told(observer, goals(("b", 2, GoalStatus.PREEMPTED))) == []


def test_goal_that_had_failed_before_is_no_concern():
    assert told(ObjectiveErrorObserver(), goals(("old", 1, GoalStatus.ABORTED))) == []


class Quality(enum.Enum):
    COMFORT = "comfort"


@pytest.mark.parametrize(
    ("spoilt", "told"),
    [
        ({"values": [KeyValue(1, "0.5")]}, "returned 1 as key: make it a text"),
        ({"values": [KeyValue("comfort", 0.5)]}, "returned 0.5 as value of comfort: make it a text"),
        ({"values": [KeyValue(b"comfort", "0.5")]}, "as key"),
        ({"values": [KeyValue(Quality.COMFORT, "0.5")]}, "as key"),
        ({"values": [KeyValue("a", "1"), KeyValue("comfort", True)]}, "returned True as value of comfort"),
        ({"name": 3}, "returned 3 as name"),
        ({"message": b"QA status"}, "as message"),
        ({"hardware_id": 7}, "as hardware_id"),
        ({"name": "\udcff"}, "surrogates not allowed"),
    ],
)
def test_status_that_can_not_be_published_is_refused_with_what_is_wrong(spoilt, told):
    class OddObserver(Observer):
        def generate_diagnostics(self, now):
            return [DiagnosticStatus(**{"message": "QA status", "values": [KeyValue("comfort", "0.5")], **spoilt})]

    with pytest.raises((TypeError, ValueError), match=told):
        OddObserver("OddObserver").evaluate(0.0)


def test_reason_with_odd_characters_can_be_published():
    status = published().stale("no sense in \udcff\x1b[2J")
    status.serialize(io.BytesIO())
    assert status.values[0].value == "no sense in \\udcff\\x1b[2J"


@pytest.mark.parametrize("returned", [DiagnosticArray(), None, []])
def test_published_observer_may_return_an_array_or_nothing(returned):
    class LogObserver(Observer):
        def generate_diagnostics(self):
            return returned

    assert LogObserver("LogObserver").evaluate(0.0) == []


def test_statuses_of_an_array_are_published():
    class GripObserver(Observer):
        def generate_diagnostics(self):
            return DiagnosticArray(status=[DiagnosticStatus(message="QA status", values=[KeyValue("grip", "0.5")])])

    (status,) = GripObserver("GripObserver").evaluate(0.0)
    assert status.values == [KeyValue("grip", "0.5")]
