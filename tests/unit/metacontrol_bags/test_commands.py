"""The commands, mounted in `metacontrol bag` and alone."""

import json
import math

import pytest
from click.testing import CliRunner
from metacontrol_bags.adaptation import describe_adaptation
from metacontrol_bags.bag import read_record
from metacontrol_bags.bag_file import BagError
from metacontrol_bags.cli.main import bag as group
from metacontrol_bags.metrics import summarise
from metacontrol_bags.side_by_side import short_names
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_msgs.msg import ActiveConfiguration, Candidate, Cause, Decision, ExpectedQA, FunctionGrounding
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

COMMANDS = ("info", "metrics", "plot", "decisions", "compare")


def call(*arguments):
    return CliRunner().invoke(group, [str(argument) for argument in arguments], prog_name="metacontrol-bag")


def told(*arguments):
    result = call(*arguments, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def one_line(result, *words):
    (line,) = result.stderr.splitlines()
    assert all(word in line for word in words), line
    return line


@pytest.fixture
def path(mission_bag, tmp_path):
    return mission_bag.write(tmp_path / "mission.bag")


@pytest.fixture
def unfinished(mission_bag, tmp_path):
    """Return a bag of a recorder that was killed before the mission ended."""
    mission_bag.messages = [entry for entry in mission_bag.messages if entry[0] < 18.0]
    target = tmp_path / "killed.bag.active"
    content = mission_bag.write(tmp_path / "whole.bag", chunk_bytes=2000).read_bytes()
    place = content.index(b"index_pos=") + 10
    target.write_bytes(
        content[:place] + bytes(8) + content[place + 8 : int.from_bytes(content[place : place + 8], "little")]
    )
    return target


@pytest.fixture
def foreign(bag, tmp_path):
    """Return a bag of another robot."""
    for number in range(5):
        bag.add(1e9 + number, "/scan", LaserScan(ranges=[1.0] * 100))
        bag.add(1e9 + number, "/chat\x1b[2J\nter", String("hello"))
    return bag.write(tmp_path / "foreign.bag")


def test_metacontrol_has_the_same_group(path):
    result = CliRunner().invoke(metacontrol, ["bag", "metrics", str(path)])
    assert result.exit_code == 0
    assert result.stdout == call("metrics", path).stdout


def test_info_tells_topics_types_and_rates(path, mission_bag):
    (entry,) = told("info", path)
    assert (entry["messages"], entry["closed"], entry["problems"]) == (len(mission_bag.messages), True, [])
    assert (entry["first_s"], entry["duration_s"]) == (9.0, 11.5)
    topics = {item["topic"]: item for item in entry["topics"]}
    assert topics["/ground_truth/state"]["type"] == "nav_msgs/Odometry"
    assert topics["/ground_truth/state"]["messages"] == 102
    assert topics["/ground_truth/state"]["rate_hz"] == pytest.approx(102 / 11.5, abs=1e-3)
    assert "nav_msgs/Odometry" in call("info", path).stdout


def test_info_of_a_bag_without_index_counts_the_same(path, unfinished, mission_bag):
    result = call("info", unfinished, "--json")
    assert result.exit_code == 0
    one_line(result, str(unfinished), "not closed", "rosbag reindex")
    assert json.loads(result.stdout)[0]["messages"] == len(mission_bag.messages)


def test_metrics_are_those_of_the_summary(path):
    (entry,) = told("metrics", path)
    record = read_record(path)
    assert (entry["bag"], entry["problems"]) == (str(path), [])
    assert entry["summary"] == summarise(record)
    assert entry["adaptation"] == describe_adaptation(record)
    text = call("metrics", path).stdout
    assert "component:front_laser" in text and "10.00 s" in text


def test_bag_of_a_killed_recorder_tells_what_it_has(unfinished):
    result = call("metrics", unfinished, "--json")
    assert result.exit_code == 0
    one_line(result, str(unfinished), "not closed", "end of the mission is not in it")
    summary = json.loads(result.stdout)[0]["summary"]
    assert summary["route"] == "r1" and len(summary["reconfigurations"]) == 1
    assert summary["outcome"] == "unknown"


@pytest.mark.parametrize("command", ["metrics", "compare"])
def test_bag_without_configurations_tells_the_rest(path, mission_bag, tmp_path, command):
    topic = "/rosgraph_manipulator/active_configuration"
    mission_bag.messages = [entry for entry in mission_bag.messages if entry[1] != topic]
    result = call(command, path, mission_bag.write(tmp_path / "none.bag"), "--json")
    assert result.exit_code == 0
    one_line(result, "none.bag", f"has no {topic}")
    with_them, without = json.loads(result.stdout)
    assert with_them["adaptation"]["configurations"] and without["adaptation"]["configurations"] == {}


def test_bag_of_something_else_is_no_record_of_a_mission(foreign):
    with pytest.raises(BagError, match=r"foreign\.bag: holds nothing of a mission, only "):
        read_record(foreign)


@pytest.mark.parametrize("command", [name for name in COMMANDS if name != "info"])
def test_bag_of_another_robot_is_refused_in_one_line(foreign, command):
    result = call(command, foreign)
    assert result.exit_code == 2 and result.stdout == ""
    assert "\x1b" not in one_line(result, str(foreign), "record")


def test_info_of_a_bag_of_another_robot_controls_no_terminal(foreign):
    result = call("info", foreign)
    assert result.exit_code == 0 and result.stderr == ""
    assert "sensor_msgs/LaserScan" in result.stdout and "\x1b" not in result.stdout
    assert "2001-09-09" in result.stdout


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("content", [None, b"", b"no bag"])
def test_what_cannot_be_read_does_not_hide_the_rest(path, command, content):
    bad = path.with_name("bad.bag")
    if content is not None:
        bad.write_bytes(content)
    result = call(command, bad, path)
    assert result.exit_code == 2
    one_line(result, f"metacontrol-bag: {bad}: ")
    assert len(result.stdout) > 10


def test_missing_topics_are_named(mission_bag, tmp_path):
    mission_bag.messages = [m for m in mission_bag.messages if not m[1].startswith("/ground_truth/s")]
    result = call("metrics", mission_bag.write(tmp_path / "poor.bag"), "--json")
    assert result.exit_code == 0
    line = one_line(result, "no /ground_truth/state (the way)", "no /ground_truth/safety")
    assert "/ground_truth/energy" not in line
    summary = json.loads(result.stdout)[0]["summary"]
    assert summary["mean_qa"]["safety"] is None and summary["goal_reached"] is True


def test_decisions_tell_causes_candidates_choice_and_result(bag, tmp_path):
    bag.event(10.0, "MISSION_START", "r1")
    candidates = [
        Candidate(name="b", expected_qas=[ExpectedQA("energy", 0.3)], utility=0.5, chosen=True),
        Candidate(name="c", utility=math.nan, refused_because="no wheel", lost_because="no wheel"),
    ]
    cause = Cause(trigger="qa:energy", text="energy 0.7 > 0.6", quality="energy", level=0.7, limit=0.6, excess=0.17)
    for stamp, state in ((12.0, "DECIDED"), (13.0, "EXECUTED")):
        bag.decision(stamp, state, "qa:energy", change=("a", "b"), reasons=[cause], candidates=candidates)
    path = bag.write(tmp_path / "decisions.bag")
    (entry,) = told("decisions", path)
    (decision,) = entry["decisions"]
    assert decision["state"] == "EXECUTED" and decision["trigger"] == "qa:energy"
    assert decision["reasons"][0]["excess"] == pytest.approx(0.17)
    assert [item["name"] for item in decision["candidates"]] == ["b", "c"]
    assert decision["candidates"][1]["utility"] is None
    text = call("decisions", path).stdout
    for word in ("a -> b", "EXECUTED", "energy 0.7 > 0.6", "17%", "chosen", "no wheel"):
        assert word in text


def test_mission_without_adaptation_has_no_decisions(mission_bag, tmp_path):
    mission_bag.messages = [m for m in mission_bag.messages if not isinstance(m[2], Decision)]
    path = mission_bag.write(tmp_path / "baseline.bag")
    assert told("decisions", path)[0]["decisions"] == []
    assert "no decisions" in call("decisions", path).stdout


def test_compare_has_a_column_for_each_bag(mission_bag, tmp_path):
    adapted = mission_bag.write(tmp_path / "adapted.bag")
    mission_bag.messages = [m for m in mission_bag.messages if m[1] != "/mros1_reasoner/decision"]
    baseline = mission_bag.write(tmp_path / "baseline.bag")
    rows = call("compare", "--markdown", baseline, adapted).stdout.splitlines()
    assert rows[0] == "|  | baseline.bag | adapted.bag |"
    assert rows[1] == "|---|---:|---:|"
    assert "| reconfigurations | 0 | 1 |" in rows
    assert [entry["bag"] for entry in told("compare", baseline, adapted)] == [str(baseline), str(adapted)]
    assert "adapted.bag" in call("compare", baseline, adapted).stdout


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["a/x.bag", "b/y.bag"], ["x.bag", "y.bag"]),
        (["a/mission.bag", "b/mission.bag"], ["a/mission.bag", "b/mission.bag"]),
        (["x.bag", "x.bag"], ["x.bag (1)", "x.bag (2)"]),
        (["/r/a/m.bag", "r/b/m.bag"], ["a/m.bag", "b/m.bag"]),
    ],
)
def test_columns_have_the_shortest_names_that_differ(paths, names, tmp_path):
    assert (
        short_names([tmp_path / path if path.startswith("r") else tmp_path.__class__(path) for path in paths]) == names
    )


@pytest.mark.parametrize(
    ("options", "name", "start"),
    [
        ([], "mission.png", b"\x89PNG"),
        (["--format", "svg"], "mission.svg", b"<?xml"),
        (["--output", "{}/other.svg"], "other.svg", b"<?xml"),
        (["--output", "{}/other.png", "--format", "svg"], "other.svg", b"<?xml"),
    ],
)
def test_plot_is_png_or_svg(path, tmp_path, options, name, start):
    result = call("plot", path, *(option.format(tmp_path) for option in options))
    assert (result.exit_code, result.stdout) == (0, f"{tmp_path / name}\n")
    assert (tmp_path / name).read_bytes().startswith(start)


def test_plots_of_several_bags_go_into_a_folder(path, unfinished, tmp_path):
    (tmp_path / "figures").mkdir()
    result = call("plot", path, unfinished, "--output", tmp_path / "figures")
    assert result.exit_code == 0
    assert {file.name for file in (tmp_path / "figures").iterdir()} == {"mission.png", "killed.png"}
    refused = call("plot", path, unfinished, "--output", tmp_path / "one.png")
    assert refused.exit_code == 2 and "make a folder" in refused.stderr


def test_plot_into_a_folder_that_is_not_there_is_refused(path, tmp_path):
    result = call("plot", path, "--output", tmp_path / "nowhere" / "figure.png")
    assert result.exit_code == 2
    one_line(result, "nowhere", "No such file")


@pytest.fixture
def two_pumps(bag, tmp_path):
    """Return a bag of two robots, in their namespaces, that know neither move_base nor a ground truth."""
    for robot, failed in (("north", "valve"), ("south", "filter")):
        of_robot = f"robot:/{robot}"
        for stamp, configuration, state in ((10.0, "brisk", "STABLE"), (14.0, "gentle", "RECONFIGURING")):
            functions = [FunctionGrounding("f_pump", configuration, state)]
            topic = f"/{robot}/rosgraph_manipulator/active_configuration"
            bag.add(stamp, topic, ActiveConfiguration(functions=functions))
        bag.diagnostic(13.0, "Component status", failed, "FALSE", hardware_id=of_robot)
        bag.diagnostic(15.5, "Component status", failed, "RECOVERED", hardware_id=of_robot)
        bag.diagnostic(10.0, "QA status", "pressure", 0.2 if robot == "north" else 0.9, hardware_id=of_robot)
        for stamp, state in ((13.5, "DECIDED"), (14.5, "EXECUTED")):
            cause = Cause(trigger="qa:pressure", text="pressure 0.2 < 0.4 for 1 s", quality="pressure")
            cause.level, cause.limit, cause.excess = 0.2, 0.4, 0.5
            message = Decision(id=robot, state=state, trigger="qa:pressure", objective="o_pump", reasons=[cause])
            message.from_configuration, message.to_configuration = "brisk", "gentle"
            message.stamp_executed = message.header.stamp
            bag.add(stamp, f"/{robot}/mros1_reasoner/decision", message)
    bag.add(20.0, "/chat", String("the end"))
    return bag.write(tmp_path / "pumps.bag")


def test_metrics_of_any_robot_tell_what_its_meta_controller_did(two_pumps):
    (entry,) = told("metrics", "--namespace", "north", two_pumps)
    assert (entry["summary"], entry["problems"]) == (None, [])
    figures = entry["adaptation"]
    assert figures["duration_s"] == 10.0
    assert figures["configurations"] == {
        "f_pump": {"brisk": {"s": 4.0, "changing_s": 0.0}, "gentle": {"s": 6.0, "changing_s": 6.0}}
    }
    assert figures["decisions"]["by_state"] == {"EXECUTED": 1}
    assert figures["reconfiguration_s"] == {"mean": 1.0, "max": 1.0}
    assert figures["components"] == {"valve": [{"stamp_s": 3.0, "recovered_s": 2.5}]}
    pressure = figures["qualities"]["pressure"]
    assert (pressure["limit"], pressure["violated"], pressure["violated_s"]) == (0.4, "below", 10.0)
    shown = call("metrics", "--namespace", "/south", two_pumps).stdout
    assert "f_pump: gentle" in shown
    assert "failures of filter" in shown
    assert "valve" not in shown
    assert "safety" not in shown


@pytest.mark.parametrize("command", ["metrics", "compare", "decisions"])
def test_bag_of_several_robots_asks_for_one(two_pumps, command):
    result = call(command, two_pumps)
    assert result.exit_code == 2
    one_line(result, "/north, /south", "--namespace")
    result = call(command, "--namespace", "west", two_pumps)
    assert result.exit_code == 2
    one_line(result, "no robot in /west", "/north")


def test_the_only_robot_of_a_bag_needs_no_namespace(bag, tmp_path):
    functions = [FunctionGrounding("f_pump", "brisk", "STABLE")]
    bag.add(1.0, "/hall/pump/rosgraph_manipulator/active_configuration", ActiveConfiguration(functions=functions))
    bag.add(3.0, "/chat", String("the end"))
    path = bag.write(tmp_path / "pump.bag")
    result = call("compare", path)
    assert "f_pump: brisk" in result.stdout
    one_line(result, "no /diagnostics (components and qualities)", "no /mros1_reasoner/decision (decisions, if any)")


def test_function_that_is_released_and_deployed_again_does_not_count_between(bag, tmp_path):
    topic = "/rosgraph_manipulator/active_configuration"
    grip, look = FunctionGrounding("f_grip", "firm", "STABLE"), FunctionGrounding("f_look", "far", "STABLE")
    for stamp, functions in ((1.0, [grip, look]), (3.0, [look]), (7.0, [grip, look])):
        bag.add(stamp, topic, ActiveConfiguration(functions=functions))
    bag.add(8.0, "/chat", String("the end"))
    (entry,) = told("metrics", bag.write(tmp_path / "cell.bag"))
    shares = entry["adaptation"]["configurations"]
    assert (shares["f_grip"]["firm"]["s"], shares["f_look"]["far"]["s"]) == (3.0, 7.0)
