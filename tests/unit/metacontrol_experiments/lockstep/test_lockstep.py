"""Missions in lockstep: deterministic, driven by the same cores as on ROS."""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_bags.metrics import summarise
from metacontrol_experiments.cli import main as cli
from metacontrol_experiments.contingency.parsing import parse_contingency
from metacontrol_experiments.io.lockstep_setup import Library, describe_system, restarts_between, set_up
from metacontrol_experiments.lockstep.frames import KEPT_S, Frames
from metacontrol_experiments.lockstep.reconfiguration import navigation_parameters
from metacontrol_experiments.lockstep.system import LockstepError, private_parameters
from metacontrol_experiments.mission.mission import Outcome
from metacontrol_experiments.mission.routes import Route
from metacontrol_experiments.mission.settings import Settings
from pybullet_simulator.robot.robot import Robot
from robot_formulas.geometry import Pose

PACKAGE = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim"
WAY = Route("short", Pose(-8.0, -8.0, 0.78), Pose(-5.0, -5.6, 0.0))
FAR = Route("far", Pose(-8.0, -8.0, 0.78), Pose(5.4, 6.0, 0.0))


def settings(tmp_path, *texts, **changes):
    usual = {"manager": "none", "contingencies": tuple(map(parse_contingency, texts)), "timeout_s": 60.0}
    return Settings(**({"route": WAY, "output": tmp_path} | usual | changes))


@pytest.fixture(scope="module")
def system():
    return describe_system(Settings.launch_package, "metacontrol_sim_reasoner.launch")


def test_frames_answer_as_tf_does():
    frames = Frames(Robot())
    assert frames.lookup("map", "base_link", None) is None and frames.newest("map", "odom") is None
    frames.add(1.0, Pose(1.0, 0.0, 0.0), Pose(0.0, 2.0, math.pi / 2))
    frames.add(1.02, Pose(1.0, 0.0, 0.0), Pose(0.0, 3.0, math.pi / 2))
    assert frames.lookup("map", "base_link", 1.0)[:2, 3] == pytest.approx([1.0, 2.0])
    assert frames.lookup("map", "front_laser", None)[:3, 3] == pytest.approx([1.0, 3.393, 0.18])
    assert frames.lookup("odom", "map", 1.0)[:2, 3] == pytest.approx([-1.0, 0.0])
    assert frames.lookup("map", "base_link", 1.03) is None and frames.lookup("map", "base_link", 0.9) is None
    assert frames.lookup("map", "nowhere", None) is None and frames.newest("map", "nowhere") is None
    assert frames.newest("map", "camera_link") == 1.02
    assert frames.newest("base_link", "camera_link") == math.inf


POSES = st.builds(Pose, st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), st.floats(-3.0, 3.0))
FRAMES = ("map", "odom", "base_link", "front_laser", "camera_link")


@given(st.lists(st.tuples(st.sampled_from([Pose(1.0, 2.0, 0.3), Pose(-4.0, 0.0)]), POSES), min_size=1, max_size=6))
def test_frames_are_placed_by_the_poses_of_their_time(moments):
    robot, frames = Robot(), Frames(Robot())
    for number, (map_to_odom, odometry) in enumerate(moments):
        frames.add(float(number), map_to_odom, odometry)
    for number, (map_to_odom, odometry) in enumerate(moments):
        base = map_to_odom.matrix() @ odometry.matrix()
        sensors = (base @ one.mount.pose.matrix(one.mount.z) for one in (robot.front_laser, robot.camera))
        in_map = dict(zip(FRAMES, (np.eye(4), map_to_odom.matrix(), base, *sensors), strict=True))
        for target, source in itertools.product(FRAMES, repeat=2):
            expected = np.linalg.inv(in_map[target]) @ in_map[source]
            np.testing.assert_array_equal(frames.lookup(target, source, float(number)), expected)
    assert frames.lookup("map", "wheel", None) is None and frames.newest("map", "wheel") is None


def test_frames_forget_what_is_old():
    frames = Frames(Robot())
    for tick in range(int(3 * KEPT_S * 10)):
        frames.add(tick / 10, Pose(0.0, 0.0, 0.0), Pose(0.0, 0.0, 0.0))
    assert frames.lookup("map", "odom", 0.1) is None
    assert frames.lookup("map", "odom", 3 * KEPT_S - 5.0) is not None


@pytest.mark.parametrize("path", sorted((PACKAGE / "models/variants").glob("*.rossystem")), ids=lambda path: path.stem)
def test_every_variant_has_its_own_parameters(path, system):
    parameters = navigation_parameters(system, path.stem)
    frequency, speed, radius = ((15, 20, 25), (0.3, 0.5, 0.75), (0.5, 0.65, 0.8))
    numbers = [int(part[1]) - 1 for part in path.stem.split("_")[:3]]
    assert parameters.controller_frequency == frequency[numbers[0]]
    backwards = path.stem.endswith("_b")
    assert parameters.controller.backwards is backwards
    ends = (parameters.controller.min_vel_x, parameters.controller.max_vel_x)
    assert ends == ((-0.3, -0.1) if backwards else (0.1, speed[numbers[1]]))
    for costmap in (parameters.global_costmap, parameters.local_costmap):
        assert [layer.inflation_radius for layer in costmap.layers if layer.kind == "inflation"] == [radius[numbers[2]]]
        kind = "PointCloud2" if path.stem.endswith("_k") else "LaserScan"
        assert [source.data_type for source in costmap.sources] == [kind]
        assert [source.topic == "rear/scan" for source in costmap.sources] == [backwards]


def test_only_another_sensor_restarts_navigation():
    restarts = restarts_between(Settings.launch_package, "metacontrol_sim_reasoner.launch")
    assert not restarts("f2_v2_r2", "f3_v3_r1") and not restarts("f1_v1_r3_k", "f2_v1_r3_k")
    assert restarts("f2_v2_r2", "f2_v1_r3_k") and restarts("f1_v3_r1_k", "f1_v3_r1")


def test_mission_reaches_its_goal_and_repeats_byte_for_byte(tmp_path):
    one = set_up(settings(tmp_path, "clutter:2", "power:1.4@time:3")).run()
    assert one.state.outcome is Outcome.REACHED
    summary = summarise(one.record)
    assert summary["engine"] == "lockstep" and summary["goal_reached"] and summary["collisions"] == 0
    assert summary["control"] == {"rate_hz": 20.0, "periods_missed": 0.0}
    assert [entry["name"] for entry in summary["perturbations"]] == ["clutter:2", "power:1.4"]
    assert summary["contingency"] == {"clutter": 2, "power": 1.4, "component": None}
    assert one.log == set_up(settings(tmp_path, "clutter:2", "power:1.4@time:3")).run().log
    other = set_up(settings(tmp_path, "clutter:2", "power:1.4@time:3", seed=2)).run()
    assert other.log != one.log


def test_baseline_stands_still_when_its_laser_dies(tmp_path):
    outcome = set_up(settings(tmp_path, "kill:front_laser@time:3", timeout_s=10.0)).run()
    assert outcome.state.outcome is Outcome.TIMEOUT
    late = outcome.record.poses[outcome.record.poses[:, 0] > outcome.state.started_s + 6.0, 1:]
    assert np.ptp(late, axis=0).max() < 0.01


def test_meta_controller_goes_on_with_the_camera_and_repeats_byte_for_byte(tmp_path):
    asked = settings(tmp_path, "kill:front_laser@time:2", manager="mros", spares=False)
    one = set_up(asked).run()
    assert one.state.outcome is Outcome.REACHED
    summary = summarise(one.record)
    (change,) = [entry for entry in summary["reconfigurations"] if entry["trigger"] == "component:front_laser"]
    assert change["to"].endswith("_k") and summary["final_configuration"].endswith("_k")
    assert 0.0 < change["detect_s"] < 1.0 and 0.0 <= change["decide_s"] < 1.0 and 0.5 < change["execute_s"] < 5.0
    assert one.log == set_up(asked).run().log


def test_missions_that_share_what_they_read_give_the_same_logs(tmp_path):
    asked = [
        settings(tmp_path, "clutter:2", "kill:front_laser@time:2", manager=manager, timeout_s=8.0)
        for manager in ("mros", "none", "rules")
    ]
    alone = [set_up(one).run().log for one in asked]
    library = Library()
    assert [set_up(one, library).run().log for one in (*asked, *asked)] == alone * 2


def test_energy_over_its_limit_is_answered_without_a_stop(tmp_path):
    changes = {"route": FAR, "initial_configuration": "f3_v3_r1", "timeout_s": 12.0}
    asked = settings(tmp_path, "power:2.5@time:1", manager="mros", **changes)
    record = set_up(asked).run().record
    change = next(entry for entry in summarise(record)["reconfigurations"] if entry["trigger"] == "qa:energy")
    assert change["execute_s"] < 1.0
    began = record.start_stamp + change["stamp_s"]
    during = record.poses[(record.poses[:, 0] > began) & (record.poses[:, 0] < began + 1.0), 1:]
    assert np.hypot(*(during[-1] - during[0])) > 0.1


def test_frozen_laser_that_thaws_is_waited_for(tmp_path):
    outcome = set_up(settings(tmp_path, "freeze:front_laser@time:2", "thaw:front_laser@time:6")).run()
    assert outcome.state.outcome is Outcome.REACHED


def test_laser_that_repeats_itself_is_not_believed_until_it_thaws(tmp_path):
    strikes = ("repeat:front_laser@time:2", "thaw:front_laser@time:8")
    outcome = set_up(settings(tmp_path, *strikes)).run()
    assert outcome.state.outcome is Outcome.REACHED
    seconds = outcome.record.poses[:, 0] - outcome.state.started_s
    standing = outcome.record.poses[(seconds > 4.0) & (seconds < 8.0), 1:]
    assert len(standing) > 100 and np.ptp(standing, axis=0).max() < 0.01


def test_laser_whose_stamps_jump_still_leads_to_the_goal(tmp_path):
    outcome = set_up(settings(tmp_path, "jump:front_laser@time:2")).run()
    assert outcome.state.outcome is Outcome.REACHED
    assert summarise(outcome.record)["collisions"] == 0


def test_camera_variant_drives(tmp_path):
    camera = settings(tmp_path, initial_configuration="f2_v1_r3_k")
    assert set_up(camera).run().state.outcome is Outcome.REACHED


def test_rear_laser_variant_drives_backwards_round_clutter(tmp_path):
    asked = settings(tmp_path, "clutter:2", initial_configuration="f2_v1_r1_b")
    speeds = []
    outcome = set_up(asked).run(lambda simulation: speeds.append(simulation.velocity[0]))
    assert outcome.state.outcome is Outcome.REACHED and summarise(outcome.record)["collisions"] == 0
    speeds = np.array(speeds)
    assert (speeds < -0.2).mean() > 0.5 and speeds.max() < 0.05


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"contingencies": (parse_contingency("kill:battery_load_control"),)}, "in lockstep there are only"),
        ({"route": Route("bad", Pose(-10.0, 0.0), Pose(0.0, 0.0))}, "puts the robot into"),
    ],
)
def test_what_lockstep_cannot_do_is_refused(tmp_path, changes, said):
    with pytest.raises(LockstepError, match=said):
        set_up(replace(settings(tmp_path), **changes))


def test_command_leaves_log_summary_and_figure(tmp_path):
    (tmp_path / "routes.yaml").write_text("short: {start: [-8, -8, 0.78], goal: [-5, -5.6]}\n")
    arguments = ["run", "--engine", "lockstep", "--no-metacontrol", "--failure", "none", "--route", "short"]
    files = ["--routes", str(tmp_path / "routes.yaml"), "--output", str(tmp_path / "out")]
    result = CliRunner().invoke(cli.metacontrol, [*arguments, *files])
    assert result.exit_code == 0, result.output
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"mission.log", "summary.json", "mission.png"}
    refused = CliRunner().invoke(cli.metacontrol, [*arguments, *files, "--contingency", "kill:simulator"])
    assert refused.exit_code == 2 and "in lockstep there are only" in refused.output
    refused = CliRunner().invoke(cli.metacontrol, [*arguments, *files, "--rviz"])
    assert refused.exit_code == 2 and "has no window" in refused.output


@pytest.mark.parametrize(
    ("strike", "goes_on"),
    [("kill:front_laser@time:2", True), ("unplug:front_laser@time:2", False), ("freeze:front_laser@time:2", False)],
)
def test_respawn_helps_where_a_driver_has_died_and_its_device_is_there(tmp_path, strike, goes_on):
    outcome = set_up(settings(tmp_path, strike, manager="respawn", timeout_s=20.0)).run()
    assert (outcome.state.outcome is Outcome.REACHED) is goes_on
    assert outcome.record.decisions == ()
    assert ("front_laser started again" in outcome.log) is goes_on


def test_rules_go_on_with_the_camera(tmp_path):
    outcome = set_up(settings(tmp_path, "unplug:front_laser@time:2", manager="rules", spares=False)).run()
    assert outcome.state.outcome is Outcome.REACHED
    summary = summarise(outcome.record)
    assert summary["final_configuration"] == "f2_v1_r3_k" and "manager=rules" in outcome.log


@pytest.mark.parametrize("manager", ["mros", "rules"])
def test_mission_goes_on_backwards_when_front_laser_and_camera_are_dead(tmp_path, manager):
    strikes = ("kill:camera@time:1", "kill:front_laser@time:4")
    outcome = set_up(settings(tmp_path, *strikes, manager=manager)).run()
    assert outcome.state.outcome is Outcome.REACHED
    summary = summarise(outcome.record)
    assert summary["final_configuration"].endswith("_b") and summary["collisions"] == 0
    assert "spares=true" in outcome.log


def test_slow_variant_stays_by_the_rear_laser_when_the_front_laser_freezes_and_has_it_back_later(tmp_path):
    strikes = ("freeze:front_laser@time:2", "thaw:front_laser@time:6")
    outcome = set_up(settings(tmp_path, *strikes, manager="mros", initial_configuration="f1_v1_r2")).run()
    assert outcome.state.outcome is Outcome.REACHED
    taken = [decision for decision in outcome.record.decisions if decision.state == "EXECUTED"]
    assert taken[0].to_configuration == "f1_v1_r2_b"  # not the camera's variant
    assert "f1_v1_r2 stays: rear_laser fills its role scanner now" in taken[0].explanation
    assert not taken[-1].to_configuration.endswith("_b")


@pytest.mark.parametrize("manager", ["mros", "rules", "random"])
def test_mission_without_spares_knows_no_variant_that_needs_one(tmp_path, manager):
    strikes = ("kill:camera@time:1", "kill:front_laser@time:2")
    outcome = set_up(settings(tmp_path, *strikes, manager=manager, spares=False, timeout_s=10.0)).run()
    assert outcome.state.outcome is Outcome.TIMEOUT
    assert not any(decision.to_configuration.endswith("_b") for decision in outcome.record.decisions)
    assert "spares" not in outcome.log
    with pytest.raises(LockstepError, match="f1_v1_r1_b needs a spare, and the mission goes without spares"):
        set_up(settings(tmp_path, manager=manager, spares=False, initial_configuration="f1_v1_r1_b"))


def test_rear_laser_that_dies_stops_the_robot_that_drives_by_it(tmp_path):
    starts = {"initial_configuration": "f2_v1_r1_b", "timeout_s": 20.0}
    outcome = set_up(settings(tmp_path, "kill:rear_laser@time:5", **starts)).run()
    assert outcome.state.outcome is Outcome.TIMEOUT
    late = outcome.record.poses[outcome.record.poses[:, 0] > outcome.state.started_s + 8.0, 1:]
    assert np.ptp(late, axis=0).max() < 0.01
    outcome = set_up(settings(tmp_path, "kill:rear_laser@time:5", **starts | {"manager": "mros"})).run()
    assert summarise(outcome.record)["reconfigurations"][0]["trigger"] == "component:rear_laser"
    assert outcome.state.outcome is Outcome.REACHED


def test_rear_rays_are_cast_only_for_those_who_listen(tmp_path):
    for start, needed in (("f2_v2_r2", False), ("f2_v1_r2_b", True)):
        lockstep = set_up(settings(tmp_path, initial_configuration=start, timeout_s=1.0))
        frames, cast = [], lockstep._simulation.scan
        lockstep._simulation.scan = lambda laser, frames=frames, cast=cast: (
            frames.append(laser.mount.frame) or cast(laser)
        )
        lockstep.run()
        assert set(frames) == {"rear_laser" if needed else "front_laser"}


def test_random_choice_repeats_byte_for_byte_for_a_seed(tmp_path):
    changes = {"initial_configuration": "f3_v3_r1", "timeout_s": 12.0, "manager": "random"}
    logs = [set_up(settings(tmp_path, "power:2.5@time:1", **changes)).run() for _ in range(2)]
    assert summarise(logs[0].record)["reconfigurations"][0]["trigger"] == "qa:energy"
    assert logs[0].log == logs[1].log


def test_published_behaviour_changes_at_a_single_level_and_stands_still_for_the_time_of_the_paper(tmp_path):
    changes = {"route": FAR, "initial_configuration": "f3_v3_r1", "timeout_s": 12.0, "manager": "as_published"}
    asked = settings(tmp_path, "power:2.5@time:1", **changes)
    outcome = set_up(asked).run()
    change = summarise(outcome.record)["reconfigurations"][0]
    assert change["trigger"] == "qa:energy" and change["stamp_s"] < 3.0
    assert change["execute_s"] == pytest.approx(4.3, abs=0.02)
    began = outcome.record.start_stamp + change["stamp_s"]
    during = outcome.record.poses[
        (outcome.record.poses[:, 0] > began + 2.0) & (outcome.record.poses[:, 0] < began + 4), 1:
    ]
    assert np.ptp(during, axis=0).max() < 0.01
    assert outcome.log == set_up(asked).run().log


def test_launch_file_gives_the_reasoner_the_profile_of_the_published_one():
    launched = describe_system(
        Settings.launch_package, "metacontrol_sim_reasoner.launch", ["as_published:=true"]
    ).launched
    values = private_parameters(launched, "mros1_reasoner", "reasoner")
    profile = yaml.safe_load((PACKAGE.parent / "mros1_reasoner/config/as_published.yaml").read_text())
    assert profile and {name: values[name] for name in profile} == profile


DARK_AND_BLIND = ("light:0@time:3", "kill:front_laser@time:5", "light:1@time:9")


@pytest.mark.parametrize("manager", ["mros", "rules"])
def test_no_camera_is_taken_in_the_dark_but_when_the_light_comes_back(tmp_path, manager):
    outcome = set_up(
        settings(tmp_path, *DARK_AND_BLIND, manager=manager, spares=False, timeout_s=25.0, route=FAR)
    ).run()
    start = outcome.record.start_stamp
    (change,) = summarise(outcome.record)["reconfigurations"]
    assert change["to"].endswith("_k") and 9.0 < change["stamp_s"] < 10.0
    refusals = [d for d in outcome.record.decisions if d.state == "FAILED" and d.stamp - start < 9.0]
    if manager == "mros":
        (refusal,) = refusals
        assert "stays with f2_v2_r2" in refusal.explanation
        assert "no design can be deployed without front_laser or where light 0 < 0.25" in refusal.explanation


def test_mission_that_observes_no_surroundings_drives_blindly(tmp_path):
    asked = settings(tmp_path, *DARK_AND_BLIND, manager="mros", environment=False, timeout_s=7.0, route=FAR)
    outcome = set_up(asked).run()
    (change,) = summarise(outcome.record)["reconfigurations"]
    assert change["to"].endswith("_k") and change["stamp_s"] < 6.0
    assert {report.name for report in outcome.record.observed} == {"safety", "energy"}


@pytest.mark.parametrize("manager", ["mros", "rules", "random"])
def test_camera_is_left_in_the_dark_at_once(tmp_path, manager):
    changes = {"manager": manager, "initial_configuration": "f1_v3_r1_k", "timeout_s": 6.0, "route": FAR}
    outcome = set_up(settings(tmp_path, "light:0.1@time:2", **changes)).run()
    change = summarise(outcome.record)["reconfigurations"][0]
    assert change["trigger"] == "environment:light" and 2.0 < change["stamp_s"] < 3.0
    assert not change["to"].endswith("_k")


def test_light_alone_changes_no_mission(tmp_path):
    lines = [
        set_up(settings(tmp_path, "power:1.4@time:1", manager="mros", timeout_s=5.0, environment=on, route=FAR))
        .run()
        .log
        for on in (True, False)
    ]
    assert lines[0].replace(" environment=true", "") == lines[1]
