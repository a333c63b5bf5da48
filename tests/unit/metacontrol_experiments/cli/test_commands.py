"""What the command leaves, and what it refuses."""

import fcntl
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from metacontrol_experiments import cli
from metacontrol_experiments.cli.main import metacontrol


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_summary_and_figure_of_a_bag(mission_bag, tmp_path):
    bag = mission_bag.write(tmp_path / "mission.bag")
    result = CliRunner().invoke(metacontrol, ["summary", str(bag)])
    assert result.exit_code == 0 and '"goal_reached": true' in result.output
    result = CliRunner().invoke(metacontrol, ["figure", str(bag)])
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
    result = CliRunner().invoke(metacontrol, [*arguments, *output])
    assert result.exit_code == 2
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert not (tmp_path / "out").exists()


def test_port_in_use_is_refused_with_one_line(tmp_path):
    with socket.socket() as taken:
        taken.bind(("", 0))
        taken.listen()
        port = taken.getsockname()[1]
        result = CliRunner().invoke(metacontrol, ["run", "--port", str(port), "--output", str(tmp_path)])
    assert result.exit_code == 2
    assert f"port {port} is in use" in result.output
    assert len(result.output.strip().splitlines()) == 1


def test_folder_in_which_another_run_is_at_work_is_refused_with_one_line(tmp_path):
    bag = write(tmp_path / "mission.bag", "the other one's")
    other = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    try:
        result = CliRunner().invoke(metacontrol, ["run", "--output", str(tmp_path)])
    finally:
        os.close(other)
    assert result.exit_code == 2
    assert result.output == f"metacontrol: --output: another run is at work in {tmp_path}: choose another folder\n"
    assert bag.exists()


@pytest.mark.parametrize("command", ["run", "campaign", "bag", "report", "compare"])
def test_command_imports_what_takes_long_when_it_needs_it(command):
    code = (
        "import sys; from metacontrol_experiments.cli.main import metacontrol; "
        f"metacontrol([{command!r}, '--help'], standalone_mode=False); "
        "print([name for name in ('aiohttp', 'dask', 'matplotlib', 'pybullet', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_all_commands_are_told():
    shown = CliRunner().invoke(metacontrol, ["--help"]).output
    told = [line.split()[0] for line in shown.partition("Commands:\n")[2].splitlines() if line[2:3].strip()]
    modules = {path.stem for path in Path(cli.__file__).parent.glob("*.py") if f"def {path.stem}(" in path.read_text()}
    assert set(told) >= {"bag", "view"} and set(told) - {"bag", "view"} == modules - {"main", "build"}
