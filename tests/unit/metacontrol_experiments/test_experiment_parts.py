"""Routes, commit, timeline, processes, the figure and the command's refusals."""

import fcntl
import os
import signal
import socket
import struct
import sys
from types import SimpleNamespace

import psutil
import pytest
from click.testing import CliRunner
from metacontrol_bags import messages
from metacontrol_bags.bag import read_record
from metacontrol_bags.decision import Decision
from metacontrol_bags.figure import configuration_spans, draw
from metacontrol_bags.record import (
    ComponentReport,
    ConfigurationReport,
    Event,
    MissionRecord,
    QualityReport,
)
from metacontrol_bags.timeline import Timeline
from metacontrol_experiments.cli import main as cli
from metacontrol_experiments.io.commit import current_commit
from metacontrol_experiments.io.input_files import read_route
from metacontrol_experiments.io.processes import ProcessTree, wait_until
from metacontrol_experiments.mission.routes import RouteError
from metacontrol_experiments.mission.settings import Settings
from robot_formulas.geometry import Pose

HASH = "0123456789abcdef0123456789abcdef01234567"


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_route_is_read(tmp_path):
    path = write(tmp_path / "routes.yaml", "routes:\n  r1: {start: [1, 2, 0.5], goal: [3.0, 4.0]}\n")
    route = read_route(path, "r1")
    assert (route.start, route.goal) == (Pose(1.0, 2.0, 0.5), Pose(3.0, 4.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("routes: {r2: {start: [0, 0], goal: [1, 1]}}", "no route 'r1'; there are r2"),
        ("routes: {r1: {start: [0, 0]}}", "'r1', goal"),
        ("routes: {r1: {start: [0, .nan], goal: [1, 1]}}", "'r1', start"),
        ("routes: {r1: 7}", "needs a start"),
        ("routes: [1", "cannot be read"),
        ("7", "no route"),
    ],
)
def test_bad_route_is_named(tmp_path, text, said):
    with pytest.raises(RouteError, match=said):
        read_route(write(tmp_path / "routes.yaml", text), "r1")


def test_commit_comes_from_the_environment_first(monkeypatch):
    monkeypatch.setenv("MROS_COMMIT", "v1")
    assert current_commit() == "v1"


@pytest.mark.parametrize(
    ("head", "files", "expected"),
    [
        (HASH, {}, HASH),
        ("ref: refs/heads/main", {"refs/heads/main": HASH}, HASH),
        ("ref: refs/heads/main", {"packed-refs": f"# pack-refs\n{HASH} refs/heads/main\n"}, HASH),
        ("ref: refs/heads/new", {}, "unknown"),
    ],
)
def test_commit_is_read_without_git(monkeypatch, tmp_path, head, files, expected):
    monkeypatch.delenv("MROS_COMMIT", raising=False)
    write(tmp_path / ".git" / "HEAD", head + "\n")
    for name, text in files.items():
        write(tmp_path / ".git" / name, text)
    assert current_commit(tmp_path / "src" / "module.py") == expected


def test_timeline_tells_changes_only():
    timeline = Timeline({"safety": 0.6})
    said = [
        entry.text
        for report in (
            ComponentReport(1.0, "front_laser", "TRUE"),
            ComponentReport(2.0, "front_laser", "FALSE"),
            ComponentReport(2.1, "front_laser", "FALSE"),
            QualityReport(2.2, "safety", 0.5),
            QualityReport(2.3, "safety", 0.7),
            QualityReport(2.4, "safety", 0.8),
            QualityReport(2.5, "safety", None),
            QualityReport(2.6, "safety", None),
            ConfigurationReport(2.7, "f_navigate", "a", "STABLE"),
            ConfigurationReport(2.8, "f_navigate", "b", "RECONFIGURING"),
            Decision("1", "EXECUTED", "o_navigate", "component:front_laser", "a", "b", stamp=2.9),
            ComponentReport(3.0, "front_laser", "RECOVERED"),
            ComponentReport(3.1, "front_laser", "TRUE"),
            Event(4.0, "MISSION_END", "r1", {"outcome": "reached", "reason": "goal reached"}),
        )
        for entry in timeline.tell(report)
    ]
    assert said == [
        "component front_laser has failed",
        "safety 0.70 is above 0.6",
        "safety cannot be observed: stale",
        "f_navigate: b RECONFIGURING",
        "a -> b done",
        "component front_laser is back",
        "mission over: goal reached",
    ]


def test_decision_tells_analysis_and_plan():
    report = Decision("1", "DECIDED", "o_navigate", "qa:energy", "a", "b", stamp=1.0, degraded=True)
    analysis, plan = Timeline({}).tell(report)
    assert (analysis.step, analysis.text) == ("R2", "o_navigate is violated by qa:energy")
    assert (plan.step, plan.text) == ("R3", "a -> b, degraded")


def test_configuration_counts_from_stable_on():
    record = MissionRecord(
        events=(Event(10.0, "MISSION_START", "r1"), Event(20.0, "MISSION_END", "r1")),
        configurations=(
            ConfigurationReport(8.0, "f", "a", "STABLE"),
            ConfigurationReport(14.0, "f", "b", "RECONFIGURING"),
            ConfigurationReport(15.0, "f", "b", "STABLE"),
        ),
    )
    assert configuration_spans(record) == [(10.0, 15.0, "a"), (15.0, 20.0, "b")]


def test_figure_has_its_size(mission_bag, tmp_path):
    draw(read_record(mission_bag.write(tmp_path / "mission.bag")), tmp_path / "mission.png")
    header = (tmp_path / "mission.png").read_bytes()[:24]
    assert struct.unpack(">II", header[16:24]) == (1600, 2000)


def test_launch_command_gives_the_requirements_to_the_reasoner_only(tmp_path):
    write(tmp_path / "routes.yaml", "r1: {start: [-1.5, 2, 0.5], goal: [3, 4]}")
    route = read_route(tmp_path / "routes.yaml", "r1")
    command = Settings(route, tmp_path).launch_command(4000)
    assert command[:5] == ["roslaunch", "-p", "4000", "metacontrol_sim", "metacontrol_sim_reasoner.launch"]
    assert "initial_pose_x:=-1.5" in command and "nfr_safety:=0.6" in command
    baseline = Settings(route, tmp_path, metacontrol=False).launch_command(4000)
    assert baseline[4] == "MVP_metacontrol_world.launch"
    assert not any(argument.startswith("nfr_") for argument in baseline)


def test_processes_end_even_when_orphaned_and_stubborn(tmp_path):
    stubborn = (
        "import signal,time; signal.signal(signal.SIGINT, signal.SIG_IGN); print('up', flush=True); time.sleep(60)"
    )
    parent = (
        "import subprocess, sys; "
        f"subprocess.Popen([sys.executable, '-c', {stubborn!r}], start_new_session=True); print('left', flush=True)"
    )
    tree = ProcessTree({})
    log = tmp_path / "log"
    process = tree.start([sys.executable, "-c", parent], log)
    assert wait_until(lambda: {"up", "left"} <= set(log.read_text().split()), 10.0)
    process.wait(10.0)
    (orphan,) = tree.alive()
    assert tree.owns(orphan.pid)
    tree.close(grace_s=0.5)
    assert tree.alive() == []
    assert not orphan.is_running() or orphan.status() == psutil.STATUS_ZOMBIE


def test_process_of_somebody_else_is_not_owned():
    assert not ProcessTree({}).owns(1)


@pytest.mark.parametrize("ours", [signal.default_int_handler, signal.SIG_IGN], ids=["terminal", "background job"])
def test_stop_interrupts_and_waits(tmp_path, ours):
    former = signal.signal(signal.SIGINT, ours)
    try:
        _stop_interrupts_and_waits(tmp_path)
    finally:
        signal.signal(signal.SIGINT, former)


def _stop_interrupts_and_waits(tmp_path):
    tree = ProcessTree({})
    code = "import time\ntry:\n print('up', flush=True); time.sleep(60)\nexcept KeyboardInterrupt:\n print('bye')"
    process = tree.start([sys.executable, "-c", code], tmp_path / "log")
    assert wait_until(lambda: "up" in (tmp_path / "log").read_text(), 10.0)
    assert tree.stop(process, 20.0)
    assert "bye" in (tmp_path / "log").read_text()


def test_summary_and_figure_of_a_bag(mission_bag, tmp_path):
    bag = mission_bag.write(tmp_path / "mission.bag")
    result = CliRunner().invoke(cli.metacontrol, ["summary", str(bag)])
    assert result.exit_code == 0 and '"goal_reached": true' in result.output
    result = CliRunner().invoke(cli.metacontrol, ["figure", str(bag)])
    assert result.exit_code == 0 and (tmp_path / "mission.png").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["summary", "nowhere.bag"],
        ["figure", "nowhere.bag"],
        ["run", "--route", "r99"],
        ["run", "--initial-configuration", "f9_v9_r9"],
        ["run", "--failure", "flux_capacitor"],
        ["run", "--failure-at", "1.5"],
        ["run", "--contingency", "explode:front_laser"],
        ["run", "--contingency", "kill:flux_capacitor"],
        ["run", "--timeline", "nowhere.yaml"],
        ["run", "--world", "nowhere.yaml"],
        ["run", "--routes", "nowhere.yaml"],
        ["run", "--real-time-factor", "nan"],
        ["run", "--timeout", "0"],
        ["run", "--seed", "one"],
        ["run", "--seed", "-1"],
    ],
)
def test_bad_input_is_refused_with_status_2(arguments, tmp_path):
    output = ["--output", str(tmp_path / "out")]
    result = CliRunner().invoke(cli.metacontrol, [*arguments, *output])
    assert result.exit_code == 2
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert not (tmp_path / "out").exists()


def test_port_in_use_is_refused_with_one_line(tmp_path):
    with socket.socket() as taken:
        taken.bind(("", 0))
        taken.listen()
        port = taken.getsockname()[1]
        result = CliRunner().invoke(cli.metacontrol, ["run", "--port", str(port), "--output", str(tmp_path)])
    assert result.exit_code == 2
    assert f"port {port} is in use" in result.output
    assert len(result.output.strip().splitlines()) == 1


def test_folder_in_which_another_run_is_at_work_is_refused_with_one_line(tmp_path):
    bag = write(tmp_path / "mission.bag", "the other one's")
    other = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    try:
        result = CliRunner().invoke(cli.metacontrol, ["run", "--output", str(tmp_path)])
    finally:
        os.close(other)
    assert result.exit_code == 2
    assert result.output == f"metacontrol: --output: another run is at work in {tmp_path}: choose another folder\n"
    assert bag.exists()


def test_goal_counts_by_its_own_stamp_even_if_the_recorder_lags():
    sent = SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=2, nanosec=500_000_000)), goal_id=SimpleNamespace(id="a")
    )
    assert messages.goal(sent, received=2.3).stamp == pytest.approx(2.5)
