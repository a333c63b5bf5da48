"""`rosmodel generate --packages`: one catkin package for each variant, as published."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from catkin_pkg.packages import find_packages
from helpers import launch_files
from ros_model.cli.rosmodel import main
from ros_model.io.models import read_system
from ros_model.io.project import load_project
from rosgraph_manipulator.io.configuration_file import options_from
from roslaunch.rlutil import resolve_launch_arguments

SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
MODELS = SOURCES / "metacontrol_sim" / "models"


def run(*arguments):
    with pytest.raises(SystemExit) as done:
        main([str(argument) for argument in arguments])
    return done.value.code


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("workspace") / "src"
    assert run("generate", "all", MODELS, "-o", folder, "--packages") == 0
    return folder


@pytest.fixture
def on_path(workspace, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{workspace}:{SOURCES}")


@pytest.fixture(scope="module")
def names():
    return [variant.name for variant in load_project(MODELS).variants]


def test_catkin_finds_a_valid_package_for_each_variant(workspace, names):
    warnings = []
    found = find_packages(str(workspace), warnings=warnings)
    assert sorted(found) == sorted(names)
    for package in found.values():
        package.validate(warnings=warnings)
        assert {dependency.name for dependency in package.exec_depends} >= {"move_base", "metacontrol_sim"}
    assert warnings == []


def test_package_holds_the_model_of_its_variant(workspace, names):
    variants = {variant.name: variant for variant in load_project(MODELS).variants}
    for name in names:
        system = read_system(workspace / name / f"{name}.rossystem")
        assert (system.name, system.components) == (name, variants[name].components)


def test_roslaunch_finds_and_loads_each_by_its_published_command(workspace, names, on_path):
    for name in names:
        (path,) = resolve_launch_arguments([name, f"{name}.launch"])
        assert Path(path) == (workspace / name / "launch" / f"{name}.launch").resolve()
        config = launch_files.read(path)
        assert [node.name for node in config.nodes] == ["move_base"]


def test_command_roslaunch_finds_one(workspace, on_path):
    found = subprocess.run(
        [sys.executable, "/usr/bin/roslaunch", "--nodes", "f1_v1_r3_k", "f1_v1_r3_k.launch"],
        env={**os.environ, "ROS_LOG_DIR": str(workspace.parent)},
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    assert found.stdout.split() == ["/move_base"]


def test_manipulator_takes_the_published_commands(workspace, names, on_path):
    options = options_from(
        yaml.safe_load((workspace / "metacontrol_sim" / "config" / "rosgraph_manipulator.yaml").read_text())
    )
    assert sorted(options.configurations) == sorted(names)
    for name, configuration in options.configurations.items():
        assert Path(configuration.launch_file).name == f"{name}.launch"
        assert configuration.function == "f_navigate"


def test_variant_that_can_not_name_a_package_is_refused(tmp_path, capsys):
    models = tmp_path / "models"
    models.mkdir()
    (models / "b.rossystem").write_text("RosSystem { Name b }")
    (models / "Fast.rossystem").write_text("\nRosSystem { Name Fast }")
    (models / "metacontrol.yaml").write_text(
        "{package: p, base: b.rossystem, variants: {files: [Fast.rossystem]}, functions: {f: {designs: all}},"
        " quality_attributes: {q: {direction: lower_is_better}}, utility: q, objectives: {o: {function: f}}}"
    )
    assert run("generate", "launch", models, "-o", tmp_path / "src", "--packages") == 2
    assert "Fast.rossystem:2:1: variant 'Fast' can't name a catkin package" in capsys.readouterr().err
    assert not (tmp_path / "src").exists()
