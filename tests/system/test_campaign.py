"""Campaigns by a real scheduler of Dask and its workers, of which one is killed; and by a command that is killed."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest
from helpers.ports import free_port
from helpers.waiting import wait_for
from metacontrol_bags.bag import read_record
from pyarrow import parquet

SOURCES = Path(__file__).parents[2] / "catkin_ws" / "src"
CAMPAIGN = """
timeout: 2
deadline: 100
parts:
  tested:
    routes: [r1, r2]
    initial_configurations: [f2_v2_r2]
    managers: {none: 1, respawn: 2}
"""
RUNS = 6
SHORT = """
r1: {start: [-8, -8, 0.78], goal: [-5, -5.7, 0]}
r2: {start: [-3, -4.2, 3.14], goal: [-6, -6.5, 3.14]}
"""
"""Routes of the campaign that is driven on ROS."""


@pytest.fixture
def ended():
    """Processes that are ended after the test, with all that they started."""
    started = []
    yield started
    for process in started:
        for child in [*psutil.Process(process.pid).children(recursive=True)] if process.poll() is None else []:
            child.kill()
        process.kill()
        process.wait()


def start(ended, *command, **options):
    process = subprocess.Popen([sys.executable, "-m", *command], stderr=subprocess.DEVNULL, **options)
    ended.append(process)
    return process


def campaign(ended, tmp_path, *options, text=CAMPAIGN):
    (tmp_path / "tested.yaml").write_text(text)
    arguments = ["campaign", "tested.yaml", "--output", "out", *options]
    return start(ended, "metacontrol_experiments.cli.main", *arguments, cwd=tmp_path)


def runs(process):
    """Tell whether a process has not ended, waited for or not."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def results(tmp_path):
    return {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("runs/**/result.json")}


def check_complete(tmp_path):
    table = parquet.read_table(tmp_path / "out" / "results.parquet").to_pylist()
    assert len(table) == len(results(tmp_path)) == RUNS
    names = {(row["route"], row["manager"], row["repeat"]) for row in table}
    assert len(names) == RUNS and {row["status"] for row in table} == {"done"}
    seeds = {(row["route"], row["repeat"]): set() for row in table}
    for row in table:
        seeds[row["route"], row["repeat"]].add(row["seed"])
    assert all(len(met) == 1 for met in seeds.values())
    assert not [*Path(tmp_path, "out").glob("**/*.part")]


def test_runs_of_a_worker_that_is_killed_are_driven_by_another_one(ended, tmp_path):
    address = f"tcp://127.0.0.1:{free_port()}"
    port = address.rpartition(":")[2]
    start(ended, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard")
    options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(tmp_path))
    workers = [start(ended, "distributed.cli.dask_worker", address, *options) for _ in range(2)]
    command = campaign(ended, tmp_path, "--scheduler", address)
    wait_for(lambda: results(tmp_path), "the first result")
    children = psutil.Process(workers[0].pid).children()
    workers[0].send_signal(signal.SIGKILL)
    wait_for(lambda: command.poll() is not None, "the end of the campaign")
    assert command.returncode == 0
    check_complete(tmp_path)
    wait_for(lambda: not [child for child in children if runs(child)], "the end of what the dead worker started")


def test_campaign_that_is_killed_goes_on_without_driving_a_run_again(ended, tmp_path):
    command = campaign(ended, tmp_path, "--jobs", "2")
    wait_for(lambda: len(results(tmp_path)) >= 2, "two results")
    os.kill(command.pid, signal.SIGKILL)
    command.wait()
    before = results(tmp_path)
    assert len(before) < RUNS
    second = campaign(ended, tmp_path, "--jobs", "2")
    assert second.wait(150) == 0
    after = results(tmp_path)
    assert {path: after[path] for path in before} == before
    check_complete(tmp_path)
    third = campaign(ended, tmp_path, "--jobs", "2")
    assert third.wait(150) == 0 and results(tmp_path) == after
    elsewhere = campaign(ended, tmp_path, "--from", "out/results.parquet", "--output", "elsewhere")
    assert elsewhere.wait(150) == 0 and not (tmp_path / "elsewhere" / "runs").exists()
    first, copy = (parquet.read_table(tmp_path / name / "results.parquet").to_pylist() for name in ("out", "elsewhere"))
    assert first == copy


def test_campaign_that_is_interrupted_leaves_a_table_and_no_process(ended, tmp_path):
    command = campaign(ended, tmp_path, "--jobs", "2")
    wait_for(lambda: results(tmp_path), "the first result")
    started = psutil.Process(command.pid).children(recursive=True)
    command.send_signal(signal.SIGTERM)
    assert command.wait(150) == 130
    table = parquet.read_table(tmp_path / "out" / "results.parquet").to_pylist()
    assert len(table) == len(results(tmp_path)) >= 1
    wait_for(lambda: not [process for process in started if runs(process)], "the end of all processes")


def test_campaign_of_the_tests_leaves_a_table_from_which_a_report_is_made(ended, tmp_path):
    folder = SOURCES / "metacontrol_experiments" / "campaigns"
    command = campaign(ended, tmp_path, "--jobs", "2", text=(folder / "ci.yaml").read_text())
    assert command.wait(400) == 0
    made = start(ended, "metacontrol_experiments.cli.main", "report", "out", "--no-drive", cwd=tmp_path)
    assert made.wait(200) == 0
    text = (tmp_path / "out" / "report" / "report.md").read_text()
    assert text.startswith(
        "# Results\n\n8 missions (engine lockstep) of the managers `none`, `mros`, `respawn`, `rules`"
    )
    assert "asks for" not in text and "crashed or hung" not in text
    assert "### A pair of missions" in text and "| `mros` | `component` | 1 |" in text
    page = (tmp_path / "out" / "report" / "report.html").read_text()
    assert page.count('src="data:image/png;base64,') == text.count("](figures/") == 3
    assert 'src="figures' not in page


def test_runs_on_ros_side_by_side_have_masters_of_their_own(ended, tmp_path):
    (tmp_path / "routes.yaml").write_text(SHORT)
    text = f"engine: ros\nlogs: true\nroutes_file: routes.yaml{CAMPAIGN}".replace("{none: 1, respawn: 2}", "{none: 1}")
    command = campaign(ended, tmp_path, "--jobs", "2", text=text)
    assert command.wait(150) == 0
    table = parquet.read_table(tmp_path / "out" / "results.parquet").to_pylist()
    assert [row["status"] for row in table] == ["done", "done"]
    assert {json.loads(row["summary"])["engine"] for row in table} == {"ros"}
    assert len([read_record(bag) for bag in (tmp_path / "out" / "runs").rglob("mission.bag")]) == 2


def test_scheduler_that_is_not_there_is_named(tmp_path, ended):
    (tmp_path / "tested.yaml").write_text(CAMPAIGN)
    address = f"tcp://127.0.0.1:{free_port()}"
    command = [sys.executable, "-m", "metacontrol_experiments.cli.main", "campaign", "tested.yaml"]
    refused = subprocess.run(
        [*command, "--scheduler", address], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert refused.returncode == 2
    assert f"--scheduler {address}: no scheduler of Dask answers" in refused.stderr
