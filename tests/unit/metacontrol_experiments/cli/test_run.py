"""The mission that `metacontrol run` makes of its options."""

import os
from unittest import mock

import pytest
from click.testing import CliRunner
from helpers.office import write_office
from metacontrol_experiments.cli import build
from metacontrol_experiments.cli import run as cli
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.lockstep.system import private_parameters
from metacontrol_experiments.mission.mission import Outcome
from metacontrol_experiments.ros import runner
from ros_model.io.files import resolve
from rosgraph_manipulator.io.launch_files import read_launch_file


def settings_of(monkeypatch, *arguments):
    """The settings that the command makes of its options."""
    made = []

    def stop(settings, _display, _make):
        made.append(settings)
        raise cli.RunError("enough")

    monkeypatch.setattr(cli, "run_mission", stop)
    result = CliRunner().invoke(metacontrol, ["run", "--output", "out", *arguments])
    assert result.output.strip() == "metacontrol: enough"
    return made[0]


def test_kind_of_mission_has_options_of_its_own(monkeypatch):
    made = []

    def stop(settings, _display, _make):
        made.append(settings)
        raise cli.RunError("enough")

    monkeypatch.setattr(build, "run_mission", stop)
    for words in (["--mission", "manipulation", "--scenario", "3"], ["--scenario=3", "--mission=manipulation"]):
        result = CliRunner().invoke(metacontrol, ["run", "--output", "out", "--no-metacontrol", *words])
        assert result.output.splitlines()[-1] == "metacontrol: enough"
    assert [(settings.scenario, settings.metacontrol) for settings in made] == [(3, False)] * 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--mission", "manipulation", "--route", "r1"], "--route"),
        (["--scenario", "1"], "--scenario"),
        (["--mission", "dancing"], "'dancing' is not one of 'navigation', 'manipulation'"),
        (["--mission", "manipulation", "--scenario", "7"], "7 is not in the range"),
    ],
)
def test_option_of_another_kind_of_mission_is_refused(words, said):
    result = CliRunner().invoke(metacontrol, ["run", *words])
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.parametrize(("mission", "option"), [("navigation", "--route"), ("manipulation", "--scenario")])
def test_help_is_that_of_the_kind_of_mission(mission, option):
    result = CliRunner().invoke(metacontrol, ["run", "--mission", mission, "--help"])
    assert result.exit_code == 0
    assert option in result.output and "--mission" in result.output


def test_without_options_the_laser_is_killed_on_the_way(monkeypatch):
    (kill,) = settings_of(monkeypatch).contingencies
    assert str(kill) == "kill:front_laser@share:0.6"


def test_other_contingencies_take_the_place_of_the_kill(monkeypatch):
    settings = settings_of(monkeypatch, "--contingency", "clutter:7", "--contingency", "freeze:camera@time:9")
    assert list(map(str, settings.contingencies)) == ["clutter:7@time:0", "freeze:camera@time:9"]


def test_short_options_add_to_the_others(monkeypatch):
    arguments = ("--contingency", "clutter:7", "--failure", "camera", "--failure-at", "0.3", "--power-factor", "1.2")
    settings = settings_of(monkeypatch, *arguments)
    assert list(map(str, settings.contingencies)) == [
        "clutter:7@time:0",
        "kill:camera@share:0.3",
        "power:1.2@share:0.3",
    ]
    assert settings_of(monkeypatch, "--failure", "none").contingencies == ()


def test_world_and_routes_of_the_users_own(monkeypatch, tmp_path):
    world, routes = write_office(tmp_path)
    files = ("--world", str(world), "--routes", str(routes), "--route", "aisle")
    settings = settings_of(monkeypatch, *files)
    assert settings.route.name == "aisle"
    assert f"world:={world}" in settings.launch_command(4000)
    assert not any(argument.startswith("world:=") for argument in settings_of(monkeypatch).launch_command(4000))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--manager", "magic"), "no manager 'magic'; there are as_published, mros, none, random, respawn, rules"),
        (("--manager", "rules", "--no-metacontrol"), "--no-metacontrol is --manager none"),
        (("--manager", "rules", "--parameters", "{calm: 3}"), "--parameters are those of the reasoner, and --manager"),
        (("--parameters", "{clam: 3}"), "--parameters: no parameter 'clam'; there are history, "),
    ],
)
def test_managers_that_cannot_be_had_are_refused_with_one_line(arguments, said):
    result = CliRunner().invoke(metacontrol, ["run", "--output", "out", *arguments])
    assert result.exit_code == 2 and said in result.output and result.output.count("\n") == 1


def test_baseline_is_the_manager_none(monkeypatch):
    assert settings_of(monkeypatch, "--no-metacontrol").manager == "none"
    assert settings_of(monkeypatch, "--manager", "none").manager == "none"
    assert settings_of(monkeypatch).manager == "mros"


def test_surroundings_are_observed_unless_the_command_says_otherwise(monkeypatch):
    assert settings_of(monkeypatch).environment
    assert not settings_of(monkeypatch, "--no-environment").environment


def test_parameters_reach_the_reasoner_through_the_launch_file(monkeypatch):
    settings = settings_of(monkeypatch, "--parameters", "{horizon: 0, calm: 3.5}")
    assert 'reasoner_parameters:={"calm": 3.5, "horizon": 0}' in settings.launch_command(4000)
    file = resolve(f"package://{settings.launch_package}/launch/{settings.launch_file}")
    for arguments, calm in ((settings.launch_arguments, 3.5), (settings_of(monkeypatch).launch_arguments, None)):
        launched = read_launch_file(file, arguments).system
        assert private_parameters(launched, "mros1_reasoner", "reasoner").get("calm") == calm
    assert not [word for word in settings_of(monkeypatch).launch_command(4000) if "parameters" in word]


@pytest.mark.parametrize(
    ("manager", "file", "node"),
    [
        ("mros", "metacontrol_sim metacontrol_sim_reasoner.launch", "reasoner"),
        ("as_published", "metacontrol_sim metacontrol_sim_reasoner.launch", "reasoner"),
        ("none", "metacontrol_sim MVP_metacontrol_world.launch", ""),
        ("rules", "metacontrol_experiments managed.launch", "mission_manager"),
    ],
)
def test_manager_is_what_the_launch_file_starts(monkeypatch, manager, file, node):
    settings = settings_of(monkeypatch, "--manager", manager)
    command = settings.launch_command(4000)
    assert f" {file} " in " ".join(command) and settings.decider == node
    assert ("manager:=rules" in command) == (manager == "rules")
    assert ("as_published:=true" in command) == (manager == "as_published")


@pytest.mark.parametrize("options", [["--gui"], ["--rviz"], ["--mission", "manipulation", "--gui"]])
def test_window_without_a_display_is_refused_before_anything_starts(monkeypatch, tmp_path, options):
    monkeypatch.setenv("DISPLAY", ":250")
    monkeypatch.setattr(runner, "_find", lambda package, kind: f"/opt/{package}/{kind}")
    monkeypatch.setattr(runner, "_run_alone", lambda *_: pytest.fail("the system was started"))
    kept = tmp_path / "summary.json"
    kept.write_text("{}")
    result = CliRunner().invoke(metacontrol, ["run", "--quiet", "--output", str(tmp_path), *options])
    assert result.exit_code == 2
    assert result.output.count("\n") == 1 and f"{options[-1]}: a window needs" in result.output
    assert kept.exists(), "results of an earlier run"


def test_rviz_that_is_not_installed_is_refused_before_anything_starts(monkeypatch, tmp_path):
    monkeypatch.setattr(runner, "_find", lambda *_: "")
    monkeypatch.setattr(runner, "_run_alone", lambda *_: pytest.fail("the system was started"))
    result = CliRunner().invoke(metacontrol, ["run", "--quiet", "--output", str(tmp_path), "--rviz"])
    assert result.exit_code == 2
    assert result.output.count("\n") == 1 and "--rviz: RViz is not installed: ./mros setup --gui" in result.output


@pytest.mark.parametrize("options", [[], ["--mission", "manipulation"]])
def test_namespace_of_another_robot_is_not_the_missions(monkeypatch, tmp_path, options):
    seen = []

    def stop(*_):
        seen.append((os.environ.get("ROS_NAMESPACE"), os.environ["ROS_HOSTNAME"]))
        raise cli.RunError("enough")

    monkeypatch.setattr(runner, "_run", stop)
    with mock.patch.dict(os.environ, {"ROS_NAMESPACE": "rover"}):
        result = CliRunner().invoke(metacontrol, ["run", "--quiet", "--output", str(tmp_path), *options])
    assert "enough" in result.output
    assert seen == [(None, "localhost")]


@pytest.mark.parametrize(
    ("kind", "said"), [("", ""), ("MISSION_END", "mission.bag: the end of the mission is not in it: the last message")]
)
def test_what_the_bag_of_a_mission_lacks_is_told(monkeypatch, tmp_path, mission_bag, kind, said):
    mission_bag.messages = [entry for entry in mission_bag.messages if getattr(entry[2], "kind", None) != kind]

    def drive(settings, _display, _make):
        mission_bag.write(settings.output / "mission.bag")
        return mock.Mock(state=mock.Mock(outcome=Outcome.REACHED))

    monkeypatch.setattr(cli, "run_mission", drive)
    result = CliRunner().invoke(metacontrol, ["run", "--output", str(tmp_path)])
    assert result.exit_code == 0
    told = [line for line in result.output.splitlines() if "mission.bag: " in line]
    assert said in "".join(told) and len(told) == bool(said)
