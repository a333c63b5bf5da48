"""The summary of synthetic missions, against values worked out by hand."""

import json

import pytest
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import Twist
from metacontrol_bags.bag import BagError, read_record
from metacontrol_bags.metrics import MetricsError, configuration_at, summarise, verdict
from metacontrol_bags.record import Event, MissionRecord
from metacontrol_bags.series import mean, periods_missed, share_above

REQUIRED_KEYS = {
    "schema_version",
    "commit",
    "engine",
    "mission",
    "route",
    "contingency",
    "metacontrol",
    "seed",
    "goal_reached",
    "success",
    "duration_s",
    "path_length_m",
    "collisions",
    "initial_configuration",
    "final_configuration",
    "time_above_threshold",
    "mean_qa",
    "reconfigurations",
    "perturbations",
    "goals",
    "cost",
    "real_time_factor",
}


@pytest.fixture
def summary(mission_bag, tmp_path):
    return summarise(read_record(mission_bag.write(tmp_path / "mission.bag")))


def test_summary_has_every_key_and_is_json(summary):
    assert summary.keys() >= REQUIRED_KEYS
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_summary_tells_what_was_run(summary):
    assert summary["schema_version"] == 1
    assert summary["engine"] == "ros"
    assert (summary["mission"], summary["route"], summary["seed"], summary["commit"]) == ("D2", "r1", 3, "abc")
    assert summary["metacontrol"] is True
    assert summary["contingency"] == {"clutter": 0, "power": 1.0, "component": "front_laser"}
    assert (summary["initial_configuration"], summary["final_configuration"]) == ("f2_v2_r2", "f2_v1_r3_k")


def test_way_time_and_contacts_count_within_the_mission_only(summary):
    assert summary["duration_s"] == 10.0
    assert summary["path_length_m"] == pytest.approx(8.0)
    assert summary["collisions"] == 1
    assert summary["real_time_factor"] == 2.0


def test_shares_and_means_are_weighted_by_time(summary):
    assert summary["time_above_threshold"] == {"safety": 0.04, "energy": 0.0}
    assert summary["mean_qa"]["safety"] == pytest.approx(0.2 * 0.96 + 0.8 * 0.04, abs=1e-4)
    assert summary["mean_qa"]["energy"] == pytest.approx(0.3 * 0.2 + 0.5 * 0.8, abs=1e-4)


def test_stale_time_stands_beside_what_was_observed(summary):
    energy = summary["observed_qa"]["energy"]
    assert energy["stale_s"] == 2.0
    assert energy["mean"] == pytest.approx((0.3 * 5 + 0.7 * 3) / 8, abs=1e-4)
    assert energy["time_above_threshold"] == 0.375


def test_reconfiguration_has_trigger_and_three_times(summary):
    (entry,) = summary["reconfigurations"]
    assert entry["trigger"] == "component:front_laser"
    assert (entry["from"], entry["to"]) == ("f2_v2_r2", "f2_v1_r3_k")
    assert entry["stamp_s"] == pytest.approx(4.3)
    assert entry["detect_s"] == pytest.approx(0.2)
    assert entry["decide_s"] == pytest.approx(0.1)
    assert entry["execute_s"] == pytest.approx(0.7)


def test_perturbation_goals_and_cost(summary):
    assert summary["perturbations"] == [{"stamp_s": 4.0, "name": "component:front_laser", "share": 0.4, "pid": 4321}]
    assert summary["goals"] == {"sent": 1, "failed": 0}
    assert summary["cost"] == {"/reasoner": {"cpu_percent_mean": 20.0, "memory_mb_max": 110.0}}


def test_success_needs_all_four_conditions(summary, mission_bag, tmp_path):
    assert summary["goal_reached"] and summary["success"]
    mission_bag.quality(18.0, "safety", 0.7)
    mission_bag.quality(18.2, "safety", 0.1)
    risky = summarise(read_record(mission_bag.write(tmp_path / "risky.bag")))
    assert risky["time_above_threshold"]["safety"] == pytest.approx(0.06)
    assert risky["goal_reached"] and not risky["success"]
    assert verdict(summary, "; ") == "yes"
    assert verdict(risky, "; ") == "no: time above the safety threshold 6.0%, not below 5%"


def test_cause_stamped_by_a_clock_ahead_of_the_reasoners_is_found(bag, tmp_path):
    bag.event(10.0, "MISSION_START", "r1")
    bag.diagnostic(12.0, "Component status", "front_laser", "FALSE")
    bag.decision(12.05, "DECIDED", "component:front_laser", change=("f1_v3_r1", "f1_v1_r1_k"))
    bag.event(12.2, "PERTURBATION", "component:front_laser")
    bag.decision(14.5, "EXECUTED", "component:front_laser", change=("f1_v3_r1", "f1_v1_r1_k"))
    bag.event(16.0, "MISSION_END", "r1", outcome="reached")
    (entry,) = summarise(read_record(bag.write(tmp_path / "ahead.bag")))["reconfigurations"]
    assert (entry["detect_s"], entry["decide_s"]) == (0.0, pytest.approx(0.05))


def test_qa_trigger_is_timed_from_the_true_rise(bag, tmp_path):
    bag.event(10.0, "MISSION_START", "r1")
    for stamp, level in ((9.0, 0.2), (12.0, 0.7), (12.5, 0.75), (15.0, 0.1)):
        bag.quality(stamp, "safety", level)
    for stamp, level in ((11.0, 0.3), (12.4, 0.72), (13.4, 0.75)):
        bag.diagnostic(stamp, "QA status", "safety", level)
    bag.decision(14.0, "DECIDED", "qa:safety", change=("f1_v3_r1", "f1_v1_r1"))
    bag.decision(14.5, "EXECUTED", "qa:safety", change=("f1_v3_r1", "f1_v1_r1"))
    bag.event(16.0, "MISSION_END", "r1", outcome="aborted")
    (entry,) = summarise(read_record(bag.write(tmp_path / "qa.bag")))["reconfigurations"]
    assert entry["detect_s"] == pytest.approx(0.4)
    assert entry["decide_s"] == pytest.approx(1.6)
    assert entry["execute_s"] == pytest.approx(0.5)


def test_baseline_that_is_stuck_has_failed(bag, tmp_path):
    bag.event(10.0, "MISSION_START", "r1", metacontrol="false", failure="front_laser")
    bag.goal(10.0)
    bag.event(14.0, "PERTURBATION", "component:front_laser", share=0.4)
    bag.result(40.0, GoalStatus.ABORTED, "no sensor data")
    bag.event(40.0, "MISSION_END", "r1", outcome="aborted")
    summary = summarise(read_record(bag.write(tmp_path / "baseline.bag")))
    assert summary["goal_reached"] is False and summary["success"] is False and summary["metacontrol"] is False
    assert verdict(summary, "; ").startswith("no: goal not reached; mean safety not known, not below 0.4; time above")
    assert summary["goals"] == {"sent": 1, "failed": 1}
    assert summary["reconfigurations"] == [] and summary["collisions"] is None
    assert summary["mean_qa"] == {"safety": None, "energy": None}


def test_goal_taken_up_again_after_a_bad_result_counts_as_reached(mission_bag, tmp_path):
    mission_bag.goal(14.8)
    mission_bag.result(14.5, GoalStatus.PREEMPTED)
    summary = summarise(read_record(mission_bag.write(tmp_path / "again.bag")))
    assert summary["goals"] == {"sent": 1, "failed": 0} and summary["goal_reached"]


def test_periods_without_a_command_are_missed():
    assert periods_missed([0.0, 0.1, 0.2, 0.3], 10.0) == 0.0
    assert periods_missed([0.0, 0.18, 0.2, 0.31], 10.0) == 0.0  # late, but within its period
    assert periods_missed([0.0, 0.1, 0.4, 0.5], 10.0) == pytest.approx(2 / 5)
    assert periods_missed([0.0, 0.01, 0.02, 0.3], 10.0) == pytest.approx(1 / 3)  # early ones make up for nothing
    slow = [0.15 * number for number in range(21)]
    assert periods_missed(slow, 10.0) == pytest.approx(1 / 3)  # though no gap has an empty period
    assert periods_missed([0.0], 10.0) is None


def test_control_is_that_of_the_initial_configuration(bag, tmp_path):
    bag.event(10.0, "MISSION_START", "r1", controller_hz=10.0)
    bag.configuration(12.05, "b", "RECONFIGURING")
    for stamp in (9.0, 10.1, 10.2, 10.5, 10.6, 12.5, 14.0):
        bag.add(stamp, "/cmd_vel", Twist())
    bag.event(16.0, "MISSION_END", "r1", outcome="aborted")
    summary = summarise(read_record(bag.write(tmp_path / "control.bag")))
    assert summary["control"] == {"rate_hz": 10.0, "periods_missed": 0.4}


def test_clutter_is_read_from_the_bag(mission_bag, tmp_path):
    mission_bag.obstacles(9.0, (1.0, 2.0))
    mission_bag.obstacles(15.0, (1.0, 2.0), (3.0, 4.0))
    assert read_record(mission_bag.write(tmp_path / "clutter.bag")).obstacles == ((1.0, 2.0), (3.0, 4.0))


def test_time_before_the_first_sample_is_left_out():
    samples = ((2.0, 1.0), (4.0, 0.0))
    assert share_above(samples, 0.5, 0.0, 6.0) == pytest.approx(0.5)
    assert mean(samples, 3.0, 5.0) == pytest.approx(0.5)
    assert share_above((), 0.5, 0.0, 6.0) is None


def test_no_configuration_is_known_of_an_empty_record():
    assert configuration_at(MissionRecord(), 5.0) is None
    assert summarise(MissionRecord())["outcome"] == "unknown"


def test_summary_tells_where_clutter_lay():
    record = MissionRecord(events=(Event(1.0, "PERTURBATION", "clutter:2", {"places": "1.5,-2.000 3,4"}),))
    (entry,) = summarise(record)["perturbations"]
    assert entry["places"] == [[1.5, -2.0], [3.0, 4.0]]


@pytest.mark.parametrize(
    ("kind", "values", "said"),
    [
        ("MISSION_START", {"seed": "one"}, "seed is 'one'"),
        ("PERTURBATION", {"places": "here"}, "places is 'here'"),
        ("PERTURBATION", {"places": "nan,1"}, "places is 'nan,1'"),
        ("PERTURBATION", {"places": "1,2,3"}, "places is '1,2,3'"),
        *(
            (kind, {key: text}, f"{key} is '{text}'; expected a finite number")
            for kind, keys in (
                ("MISSION_START", ("seed", "clutter", "power_factor", "controller_hz", "nfr_safety")),
                ("MISSION_END", ("wall_duration_s",)),
                ("PERTURBATION", ("pid", "share")),
            )
            for key in keys
            for text in ("inf", "nan", "1e308")
        ),
    ],
)
def test_nonsense_in_an_event_is_named(kind, values, said):
    record = MissionRecord(events=(Event(1.0, kind, "r1", values),))
    with pytest.raises(MetricsError, match=said):
        summarise(record)


def test_figure_beyond_all_numbers_is_not_known():
    ended = Event(9.0, "MISSION_END", "r1", {"wall_duration_s": "5e-324"})
    summary = summarise(MissionRecord(events=(Event(1.0, "MISSION_START", "r1"), ended)))
    assert summary["real_time_factor"] is None
    assert json.dumps(summary, allow_nan=False)


def test_what_is_farther_than_the_earth_is_large_is_no_place(mission_bag, tmp_path):
    expected = summarise(read_record(mission_bag.write(tmp_path / "mission.bag")))
    mission_bag.pose(16.2, 1e308, 0.0)
    mission_bag.obstacles(9.0, (0.0, -1e308))
    record = read_record(mission_bag.write(tmp_path / "far.bag"))
    assert summarise(record) == expected
    assert record.obstacles == ()


@pytest.mark.parametrize("content", [b"", b"no bag at all", b"#ROSBAG V2.0\n" + bytes(100)])
def test_file_that_is_no_bag_is_refused(tmp_path, content):
    path = tmp_path / "broken.bag"
    path.write_bytes(content)
    with pytest.raises(BagError, match=r"broken\.bag"):
        read_record(path)


def test_missing_bag_is_refused(tmp_path):
    with pytest.raises(BagError, match="no such bag"):
        read_record(tmp_path / "none.bag")


def test_truncated_bag_is_refused(mission_bag, tmp_path):
    path = mission_bag.write(tmp_path / "cut.bag")
    path.write_bytes(path.read_bytes()[:-500])
    with pytest.raises(BagError, match=r"cut\.bag"):
        read_record(path)
