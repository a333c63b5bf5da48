"""Missions on another map, with routes of its own."""

import json

import pytest
import yaml
from click.testing import CliRunner
from helpers.office import write_office
from metacontrol_experiments.campaign.matrix import Run
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.io.campaign_driver import drive
from metacontrol_experiments.io.ground_files import read_ground, read_routes
from metacontrol_experiments.mission.ground import FACTORY
from metacontrol_experiments.mission.routes import RouteError
from pyarrow import parquet


@pytest.fixture
def office(tmp_path):
    return write_office(tmp_path / "maps")


def command(*arguments):
    return CliRunner().invoke(metacontrol, [str(argument) for argument in arguments])


def campaign(tmp_path, routes=("aisle",), managers=None, **keys):
    part = {"routes": list(routes), "initial_configurations": ["f2_v3_r1"], "managers": managers or {"none": 1}}
    path = tmp_path / "asked.yaml"
    path.write_text(yaml.safe_dump({**keys, "timeout": 60, "parts": {"tour": part}}))
    return path


def test_ground_is_told_by_the_contents_of_its_files(office, tmp_path):
    world, routes = office
    mark = read_ground(world, routes).mark
    assert mark.startswith("office.yaml tours.yaml ") and len(mark.split()[-1]) == 12
    other = write_office(tmp_path / "copy")
    assert read_ground(*other).mark == mark
    image = other[0].with_name("office.pgm")
    image.write_bytes(image.read_bytes()[:-1] + b"\x01")
    assert read_ground(*other).mark != mark
    assert read_ground(None, routes).mark != mark
    assert read_ground(None, None) == FACTORY


def test_factory_has_room_at_all_ends_of_its_routes():
    assert len(read_routes(FACTORY, ["r1", "r2", "r3", "r4", "r5", "r6"])) == 6


@pytest.mark.parametrize(
    ("route", "said"),
    [
        ("desk", "tours.yaml: route 'desk', goal: (0.50, 15.91, 0.30) is in an obstacle in "),
        ("unknown", "goal: (3.39, 18.06, 0.30) is where the map does not know the floor in "),
        ("outside", "goal: (8.17, 16.50, 0.30) is off the map in "),
        ("home", "tours.yaml: no route 'home'; there are aisle, desk"),
    ],
)
def test_end_of_a_route_without_room_for_the_robot_is_refused(office, route, said):
    with pytest.raises(RouteError) as refused:
        read_routes(read_ground(*office), ["aisle", route])
    assert said in str(refused.value) and "\n" not in str(refused.value)


def test_world_that_cannot_be_used_is_refused_with_one_line(office, tmp_path):
    _, routes = office
    (tmp_path / "half.yaml").write_text("image: nowhere.pgm\n")
    for path, said in ((tmp_path / "none.yaml", "none.yaml: No such file"), (tmp_path / "half.yaml", "nowhere.pgm")):
        for arguments in (["run", "--route", "aisle"], ["calibrate"], ["campaign", campaign(tmp_path)]):
            refused = command(*arguments, "--world", path, "--routes", routes)
            assert refused.exit_code == 2 and said in refused.output and refused.output.count("\n") == 1


def test_mission_is_driven_on_the_map(office, tmp_path):
    world, routes = office
    files = ("--world", world, "--routes", routes, "--output", tmp_path / "out")
    options = ("--engine", "lockstep", "--manager", "none", "--failure", "none", "--quiet")
    assert command("run", *files, *options, "--route", "aisle").exit_code == 0
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    assert summary["goal_reached"] and 2.0 < summary["path_length_m"] < 4.0
    refused = command("run", *files, *options, "--route", "desk")
    assert refused.exit_code == 2 and "route 'desk', goal: " in refused.output and refused.output.count("\n") == 1


def test_campaign_names_world_and_routes_relative_to_its_file(office, tmp_path):
    path = campaign(
        tmp_path, managers={"none": 1, "random": 1}, world="maps/office.yaml", routes_file="maps/tours.yaml"
    )
    ended = command("campaign", path, "--output", tmp_path / "out")
    assert ended.exit_code == 0, ended.output
    table = parquet.read_table(tmp_path / "out/results.parquet").to_pylist()
    assert [(row["route"], row["outcome"]) for row in table] == [("aisle", "reached")] * 2
    assert {row["ground"] for row in table} == {read_ground(*office).mark}
    (tmp_path / "maps/tours.yaml").write_text((tmp_path / "maps/tours.yaml").read_text() + "\n")
    refused = command("campaign", path, "--output", tmp_path / "out")
    assert refused.exit_code == 2 and "is another mission (ground)" in refused.output


def test_options_take_the_place_of_the_files_that_a_campaign_names(office, tmp_path):
    world, routes = office
    path = campaign(tmp_path, ("desk",), world="nowhere.yaml", routes_file="nowhere.yaml")
    refused = command("campaign", path, "--output", tmp_path / "out")
    assert refused.exit_code == 2 and "nowhere.yaml: No such file" in refused.output
    refused = command("campaign", path, "--output", tmp_path / "out", "--world", world, "--routes", routes)
    assert refused.exit_code == 2 and "route 'desk', goal: " in refused.output and refused.output.count("\n") == 1
    refused = command("campaign", campaign(tmp_path, ("r1",)), "--world", world, "--routes", routes)
    assert refused.exit_code == 2 and "no route 'r1'; there are aisle, desk" in refused.output


@pytest.mark.parametrize("engine", ["lockstep", "ros"])
def test_worker_with_other_files_drives_nothing(office, engine):
    ground = read_ground(*office)
    run = Run("p", "aisle", "f2_v2_r2", 0, 1.0, "none", (), "none", 1, 1, engine, 1.0, ground.mark)
    office[1].write_text("{}\n")
    result, _ = drive(run, 100.0, keep_log=False, ground=ground)
    assert (
        result.status is Status.CRASHED
        and "the files of world and routes are office.yaml" in result.attempts[-1].problem
    )
    office[0].unlink()
    result, _ = drive(run, 100.0, keep_log=False, ground=ground)
    assert "office.yaml: No such file" in result.attempts[-1].problem


def test_calibration_keeps_the_runs_of_each_map_apart(office, tmp_path):
    files = ("--world", office[0], "--routes", office[1], "--runs", tmp_path / "runs.csv")
    arguments = ("calibrate", "--seeds", "1", "--route", "aisle", "--variant", "f2_v3_r1")
    driven = command(*arguments, *files)
    assert driven.exit_code == 0 and "1 missions driven" in driven.output, driven.output
    refused = command("calibrate", "--seeds", "1", "--route", "r1", "--runs", tmp_path / "runs.csv")
    assert refused.exit_code == 2 and "holds runs on office.yaml tours.yaml" in refused.output
