"""Every command and reader, given files and paths that can't be used, refuses them in one line and never falls over."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner
from metacontrol_bags.bag import BagError, read_record
from metacontrol_experiments.campaign.calibration import CalibrationError
from metacontrol_experiments.campaign.matrix import CampaignError
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.contingency.parsing import ComponentError, ContingencyError
from metacontrol_experiments.io.campaign_folder import read_table as read_results
from metacontrol_experiments.io.input_files import read_components, read_contingencies, read_route, route_names
from metacontrol_experiments.io.tables import read_delays, read_runs
from metacontrol_experiments.lockstep.delays import DelayError
from metacontrol_experiments.mission.routes import RouteError
from metacontrol_sim.ros.send_goal import GoalFileError, read_goal
from mros1_reasoner.cli.explain import explain
from mros1_reasoner.cli.replay import replay
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoner_bag import read_decisions, read_recording
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.replay.recording import RecordingError
from node_kit.parameters import ParameterError
from pybullet_simulator.io.map_file import MapError, read_map
from pybullet_simulator.io.robot_file import RobotFileError, planar_urdf
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.world import WorldError
from ros_model.cli.rosmodel import main as rosmodel
from ros_model.errors import ModelError
from ros_model.io.files import resolve
from ros_model.io.models import read_packages, read_system
from ros_model.io.project import load_project, read_table
from ros_model_extraction.io.launch_files import read_launch_file
from ros_model_extraction.packages.catkin_package import find_packages, read_package
from rosbags.rosbag1 import Writer
from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.launch_files import LaunchFileError, read_model
from rosgraph_manipulator.io.launch_files import read_launch_file as read_deployed_file

CONTENTS = {
    "empty": b"",
    "binary": b"\xff\x00\xfe",
    "nested": b"[" * 50_000,
    "nested mapping": b"{a: " * 50_000,
    "nested braces": b"RosSystem { Name x Parameters { Parameter { name p value " + b"{" * 50_000,
    "nested XML": b"<a>" * 50_000,
    "no date": b"a: 2020-13-45",
    "odd tag": b"!!bool maybe",
    "circle": b"&a [*a]",
    "bomb": b"a: &a [x,x,x,x,x,x,x,x,x]\n"
    + b"".join(b"%c: &%c [%s]\n" % (n, n, b",".join([b"*%c" % (n - 1)] * 9)) for n in b"bcdefgh"),
    "quote": b'name,"\n',
}
PATHS = ("missing", "too long", "deep", "null", "folder", "circle of links", "pipe", "unreadable")


class Hang(BaseException):
    """A reader waits for ever. No reader that catches every Exception may take it for a refusal."""


@pytest.fixture(autouse=True)
def no_hanging():
    """End a test that waits for ever, as for the writer of a pipe."""

    def end(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def bad(tmp_path: Path) -> Callable[[str, str], str]:
    """Return the path of a file that can't be used, by what is wrong with it and its extension."""

    def make(what: str, extension: str) -> str:
        path = tmp_path / f"bad{extension}"
        match what:
            case "too long":
                return f"{tmp_path}/{'x' * 5000}{extension}"
            case "deep":
                return f"{tmp_path}/{'x/' * 3000}{extension}"
            case "null":
                return f"{tmp_path}/nul\0{extension}"
            case "folder":
                path.mkdir()
            case "circle of links":
                path.symlink_to(path.name)
            case "pipe":
                os.mkfifo(path)
            case "unreadable":
                path.write_text("")
                path.chmod(0)
            case "missing":
                pass
            case _:
                path.write_bytes(CONTENTS[what])
        return str(path)

    return make


def deployed(path: str) -> object:
    return options_from({"configurations": {"a": {"launch": path}}})


def found_in_package(path: str) -> object:
    return options_from({"configurations": {"a": {"command": f"roslaunch metacontrol_sim {path!r}"}}})


READERS: list[tuple[Callable[[str], object], tuple[type[Exception], ...], str]] = [
    (resolve, (ModelError,), ""),
    (read_system, (ModelError,), ".rossystem"),
    (read_packages, (ModelError,), ".ros"),
    (load_project, (ModelError,), ".yaml"),
    (lambda path: load_project(Path(path).parent), (ModelError,), ""),
    (lambda path: read_table(Path(path)), (ModelError,), ".csv"),
    (lambda path: read_table(Path(path)), (ModelError,), ".yaml"),
    (lambda path: read_launch_file(Path(path)), (ModelError,), ".launch"),
    (lambda path: find_packages(Path(path)), (ModelError,), ""),
    (lambda path: read_package(Path(path)), (ModelError,), ""),
    (lambda path: read_world(Path(path)), (WorldError,), ".yaml"),
    (lambda path: read_map({"resolution": 1, "origin": [0, 0, 0], "occupied_thresh": 0.6, "free_thresh": 0.2,
                            "image": path}, Path("m.yaml")), (MapError,), ".pgm"),
    (lambda path: planar_urdf(Path(path)), (RobotFileError,), ".urdf"),
    (lambda path: read_route(Path(path), "r1"), (RouteError,), ".yaml"),
    (lambda path: route_names(Path(path)), (RouteError,), ".yaml"),
    (lambda path: read_contingencies(Path(path)), (ContingencyError,), ".yaml"),
    (lambda path: read_components(Path(path)), (ComponentError,), ".yaml"),
    (lambda path: read_delays(Path(path)), (DelayError,), ".csv"),
    (lambda path: read_runs(Path(path)), (CalibrationError,), ".csv"),
    (lambda path: read_results(Path(path)), (CampaignError,), ".parquet"),
    (lambda path: read_goal(Path(path)), (GoalFileError,), ".yaml"),
    (read_file, (ConfigurationError,), ".yaml"),
    (deployed, (ConfigurationError,), ".launch"),
    (found_in_package, (ConfigurationError,), ".launch"),
    (read_deployed_file, (LaunchFileError,), ".launch"),
    (lambda path: read_model(Path(path)), (ModelError, LaunchFileError), ".rossystem"),
    (lambda path: read_knowledge_base([Path(path)]), (KnowledgeBaseError,), ".owl"),
    (lambda path: Parameters({"model_file": path}).knowledge_base(),
     (KnowledgeBaseError, ModelError, ParameterError), ".owl"),
    (lambda path: read_decisions(Path(path)), (RecordingError,), ".bag"),
    (lambda path: read_recording(Path(path)), (RecordingError,), ".bag"),
    (lambda path: read_record(Path(path)), (BagError,), ".bag"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(READERS)))
@pytest.mark.parametrize("what", [*PATHS, *CONTENTS])
def test_reader_refuses_in_one_line(bad, what: str, number: int):
    read, errors, extension = READERS[number]
    try:
        read(bad(what, extension))
    except errors as error:
        assert len(str(error).splitlines()) == 1
    # What it takes (an empty table, say) is no concern here; any other exception fails the test.


GOOD = {
    "good.rossystem": "RosSystem { Name good RosComponents ( ComponentInterface { name a FromRosNode 'p.a.a' } ) }",
    "good.launch": "<launch/>",
    "table.csv": "name,a.speed\nv,1\n",
}
ROSMODEL = [
    ("check BAD", ".rossystem"),
    ("check BAD", ".ros"),
    ("check BAD", ""),
    ("check BAD", ".yaml"),
    ("check --path BAD good.rossystem", ""),
    ("format BAD", ".rossystem"),
    ("format BAD", ".ros"),
    ("show BAD", ".rossystem"),
    ("diff BAD good.rossystem", ".rossystem"),
    ("diff good.rossystem BAD", ".ros"),
    ("init BAD", ".rossystem"),
    ("variants BAD table.csv", ".rossystem"),
    ("variants good.rossystem BAD", ".csv"),
    ("variants good.rossystem BAD", ".yaml"),
    ("variants BAD", ""),
    ("generate all BAD -o out", ""),
    ("generate all BAD -o out", ".yaml"),
    ("generate launch BAD -o out", ".rossystem"),
    ("generate launch good.rossystem -o BAD", ""),
    ("generate observer BAD -o out", ".yaml"),
    ("extract BAD -o out", ".launch"),
    ("extract BAD -o out", ""),
    ("extract good.launch -o BAD", ""),
    ("extract good.launch x:=BAD -o out", ""),
]
COMMAND_LINE = [*(path for path in PATHS if path != "null"), *CONTENTS]  # a command line has no null characters


@pytest.mark.parametrize("what", COMMAND_LINE)
@pytest.mark.parametrize(("line", "extension"), ROSMODEL)
def test_rosmodel_ends_with_a_status(bad, tmp_path: Path, monkeypatch, capsys, line: str, extension: str, what: str):
    for name, text in GOOD.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    path = bad(what, extension)
    with pytest.raises(SystemExit) as ended:  # anything else is a traceback for the user
        rosmodel([word.replace("BAD", path) for word in line.split()])
    said = capsys.readouterr()
    assert ended.value.code in (0, 1, 2)
    assert "Traceback" not in said.out + said.err
    assert ended.value.code == 0 or said.out + said.err


OTHERS = [
    (metacontrol, "summary BAD", ".bag"),
    (metacontrol, "figure BAD", ".bag"),
    (metacontrol, "bag info BAD", ".bag"),
    (metacontrol, "bag metrics BAD", ".bag"),
    (metacontrol, "bag decisions BAD", ".bag"),
    (metacontrol, "bag compare BAD BAD", ".bag"),
    (metacontrol, "bag plot BAD", ".bag"),
    (metacontrol, "run --engine lockstep --quiet --world BAD --output out", ".yaml"),
    (metacontrol, "run --engine lockstep --quiet --routes BAD --output out", ".yaml"),
    (metacontrol, "run --engine lockstep --quiet --timeline BAD --route nowhere --output out", ".yaml"),
    (metacontrol, "calibrate --runs BAD --seeds 1 --variant nothing", ".csv"),
    (metacontrol, "variants --runs BAD", ".csv"),
    (metacontrol, "campaign BAD --output out", ".yaml"),
    (metacontrol, "compare BAD", ".parquet"),
    (metacontrol, "delays BAD --output out.csv", ".parquet"),
    (explain, "BAD", ".bag"),
    (replay, "BAD", ".bag"),
]


@pytest.mark.parametrize("what", COMMAND_LINE)
@pytest.mark.parametrize("number", range(len(OTHERS)))
def test_command_ends_with_a_status(bad, tmp_path: Path, monkeypatch, number: int, what: str):
    command, line, extension = OTHERS[number]
    monkeypatch.chdir(tmp_path)
    path = bad(what, extension)
    result = CliRunner().invoke(command, [word.replace("BAD", path) for word in line.split()])
    assert isinstance(result.exception, SystemExit | None), result.exception
    assert result.exit_code in (0, 1, 2)


def test_message_that_does_not_fit_its_definition_is_refused_in_one_line(tmp_path: Path):
    path = tmp_path / "odd.bag"
    with Writer(path) as writer:
        definition = "string id\nstring state"
        connection = writer.add_connection(
            "/mros1_reasoner/decision", "metacontrol_msgs/msg/Decision", msgdef=definition, md5sum="0" * 32
        )
        writer.write(connection, 1, b"\x09\x00")
    for read, error in ((read_decisions, RecordingError), (read_recording, RecordingError), (read_record, BagError)):
        with pytest.raises(error, match=r"odd\.bag.*fit") as raised:
            read(path)
        assert len(str(raised.value).splitlines()) == 1
