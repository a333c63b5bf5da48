"""The packages of examples/: built as a user's workspace beside ours, and run."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from xmlrpc.client import Error as XmlRpcError
from xmlrpc.client import ServerProxy

import pytest
from helpers.ports import reserved_port
from helpers.waiting import wait_for

ROOT = Path(__file__).parents[2]
MODELS = ROOT / "catkin_ws" / "src" / "metacontrol_sim" / "models"
LIMIT_S = 300.0


def run(*command: str, environment: dict[str, str], folder: Path) -> str:
    """Run a command to its end; return what it writes."""
    done = subprocess.run(
        command, env=environment, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


@contextmanager
def running(*command: str, environment: dict[str, str], folder: Path):
    """Run a command within the `with`, its output in a file; it is interrupted at the end."""
    log = folder / f"{Path(command[0]).name}_{len(list(folder.iterdir()))}.log"
    with log.open("w") as file:
        process = subprocess.Popen(
            command, env=environment, cwd=folder, stdout=file, stderr=subprocess.STDOUT, start_new_session=True
        )
        try:
            yield log
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(LIMIT_S)
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory) -> tuple[Path, dict[str, str]]:
    """Build a copy of the examples; return its folder and environment."""
    folder = tmp_path_factory.mktemp("examples")
    shutil.copytree(ROOT / "examples", folder / "src", ignore=shutil.ignore_patterns("__pycache__"))
    environment = {**os.environ, "ROS_HOME": str(folder / "ros"), "ROS_LOG_DIR": str(folder / "log")}
    python = f"-DPYTHON_EXECUTABLE={sys.executable}"
    run("catkin_make", "-C", str(folder), python, environment=environment, folder=folder)
    sourced = run("bash", "-c", ". devel/setup.bash && env -0", environment=environment, folder=folder)
    environment = dict(pair.split("=", 1) for pair in sourced.split("\0") if pair)
    return folder, {**environment, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"}


@pytest.fixture
def master(workspace, tmp_path):
    """Run a master; return the environment of its nodes."""
    _, environment = workspace
    with reserved_port() as port:
        environment = {**environment, "ROS_MASTER_URI": f"http://localhost:{port}", "PYTHONUNBUFFERED": "1"}
        with running("roscore", "-p", str(port), environment=environment, folder=tmp_path):
            wait_for(
                lambda: (
                    not subprocess.run(
                        ["rosnode", "list"], env=environment, capture_output=True, check=False
                    ).returncode
                ),
                "the master answers",
            )
            yield environment


def test_generator_makes_a_table_of_the_variants(workspace, tmp_path):
    _, environment = workspace
    run("rosmodel", "generate", "catalogue", str(MODELS), "-o", ".", environment=environment, folder=tmp_path)
    lines = (tmp_path / "docs" / "variants.md").read_text().splitlines()
    assert lines[2] == "| variant | energy | energy_median | performance | safety |"
    assert len(lines) == 4 + 39
    assert lines[4].startswith("| f1_v1_r1 | 0.")


def test_utility_ranks_by_the_worst_quality(workspace, tmp_path):
    _, environment = workspace
    code = """
from mros1_reasoner.knowledge.model import Design, Direction, Quality
from mros1_reasoner.planning.utility import make_utility
low, high = Quality(Direction.LOWER_IS_BETTER), Quality(Direction.HIGHER_IS_BETTER)
utility = make_utility({"worst": ["noise", "grip"]}, {"noise": low, "grip": high})
designs = [Design("loud", "f", {"noise": 0.9, "grip": 0.9}), Design("even", "f", {"noise": 0.4, "grip": 0.3})]
print(max(designs, key=utility).name)
"""
    assert run(sys.executable, "-c", code, environment=environment, folder=tmp_path).strip() == "even"


def test_observer_says_how_hot_a_motor_is(master, tmp_path):
    hot = ("rostopic", "pub", "-r", "5", "motor/temperature", "sensor_msgs/Temperature", "{temperature: 65.0}")
    observe = ("rosrun", "rosgraph_monitor", "monitor", "--load", "MotorTemperatureObserver")
    heard = ("rostopic", "echo", "/diagnostics/status")
    with (
        running(*hot, environment=master, folder=tmp_path),
        running(*observe, environment=master, folder=tmp_path),
        running(*heard, environment=master, folder=tmp_path) as log,
    ):
        level = re.compile(r'key: "motor_temperature"\s+value: "0\.5"')
        wait_for(
            lambda: level.search(log.read_text()), lambda: f"the level of 65 degrees, not {log.read_text()[-300:]}"
        )


def pid_of(node: str, master: dict[str, str]) -> int:
    """Return the process id of a node; 0 while it is not there."""
    try:
        uri = ServerProxy(master["ROS_MASTER_URI"]).lookupNode("/test", node)[2]
        return ServerProxy(uri).getPid("/test")[2]
    except (OSError, XmlRpcError, TypeError, KeyError):
        return 0


def test_tactic_restarts_the_nodes_of_a_namespace_together(workspace, master, tmp_path):
    folder, _ = workspace
    package = folder / "src" / "example_tactic"
    launch = ("roslaunch", "rosgraph_manipulator", "manipulator.launch", f"config:={package}/config/manipulator.yaml")
    nodes = ("/arm/driver", "/arm/filter", "/camera/driver")
    with running(*launch, "initial_configuration:=slow", environment=master, folder=tmp_path):
        before = {node: wait_for(lambda node=node: pid_of(node, master), f"{node} is up") for node in nodes}
        wait_for(
            lambda: "STABLE" in run("rosrun", "rosgraph_manipulator", "status", environment=master, folder=tmp_path),
            "slow is deployed",
        )
        plans = run("rosrun", "rosgraph_manipulator", "plan", "slow", "fast", environment=master, folder=tmp_path)
        assert plans.index("together") < plans.index("restart /arm/driver")
        run("rosrun", "rosgraph_manipulator", "request", "fast", environment=master, folder=tmp_path)
        after = {node: pid_of(node, master) for node in nodes}
    assert after["/camera/driver"] == before["/camera/driver"]
    assert 0 != after["/arm/driver"] != before["/arm/driver"]
    assert 0 != after["/arm/filter"] != before["/arm/filter"]
