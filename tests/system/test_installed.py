"""All packages installed to a prefix, with neither sources nor build folders left: everything runs from there."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "catkin_ws" / "src"
VENV = Path(sys.executable).parent
LIMIT_S = 600.0
SIMULATOR_SERVICES = ["DeleteObstacle", "SetLight", "SpawnObstacle"]
SHORT = "short: {start: [-8, -8, 0.78], goal: [-3, -4.2, 0]}\n"
ROUTE = ("--routes", "routes.yaml", "--route", "short", "--failure-at", "0.4")
OTHER_LANGUAGES = "gencpp:genlisp"
"""Generators of messages whose files no test here looks at; `./mros setup` runs them."""


def run(*command: str, environment: dict[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, env=environment, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S, check=False
    )


def bare_environment(home: Path) -> dict[str, str]:
    """An environment that knows nothing of the checkout but its virtual environment."""
    path = os.pathsep.join((str(VENV), "/usr/local/bin", "/usr/bin", "/bin"))
    return {"HOME": str(home), "ROS_HOME": str(home / "ros"), "PATH": path, "LANG": "C.UTF-8"}


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> tuple[Path, dict[str, str]]:
    """Build and install a copy of all packages, delete the rest; return the prefix and its environment."""
    folder = tmp_path_factory.mktemp("installed")
    environment = {**bare_environment(folder), "ROS_LANG_DISABLE": OTHER_LANGUAGES}
    shutil.copytree(SOURCES, folder / "src", symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    prefix, build = folder / "prefix", folder / "build"
    configure = (
        *("cmake", "-S", "src", "-B", "build", f"-DCMAKE_INSTALL_PREFIX={prefix}", "-DCATKIN_ENABLE_TESTING=OFF"),
        *(f"-DCATKIN_DEVEL_PREFIX={folder / 'devel'}", f"-DPYTHON_EXECUTABLE={VENV / 'python'}"),
    )
    for command in (configure, ("cmake", "--build", "build"), ("cmake", "--install", "build")):
        done = run(*command, environment=environment, folder=folder)
        assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    for name in ("src", "devel"):
        shutil.rmtree(folder / name)
    shutil.rmtree(build)
    script = ". prefix/setup.sh; export PATH=$VENV:$PATH; env -0"
    sourced = run("sh", "-c", script, environment={**environment, "VENV": str(VENV)}, folder=folder)
    assert sourced.returncode == 0, sourced.stderr
    return prefix, dict(pair.split("=", 1) for pair in sourced.stdout.split("\0") if pair)


def test_every_module_of_ours_is_imported_from_the_prefix(installed, tmp_path):
    prefix, environment = installed
    packages = sorted(path.name for path in SOURCES.iterdir() if (path / "src" / path.name / "__init__.py").exists())
    code = (
        "import importlib, pkgutil, sys\n"
        f"for name in {packages!r}:\n"
        "    package = importlib.import_module(name)\n"
        "    print(package.__file__)\n"
        "    for found in pkgutil.walk_packages(package.__path__, name + '.'):\n"
        "        if not found.name.endswith(('.child', '.warm_start')):\n"
        "            print(importlib.import_module(found.name).__file__)\n"
    )
    done = run(sys.executable, "-c", code, environment=environment, folder=tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]
    files = [line for line in done.stdout.splitlines() if line.startswith("/")]
    assert [file for file in files if not file.startswith(str(prefix))] == []
    written = {path.name for path in SOURCES.rglob("src/*/**/*.py")}
    assert written - {Path(file).name for file in files} <= {"child.py", "warm_start.py"}


def test_services_of_the_simulator_are_installed_as_files_under_both_names(installed, tmp_path):
    prefix, environment = installed
    files = [prefix / "share" / "metacontrol_sim" / "srv" / f"{name}.srv" for name in SIMULATOR_SERVICES]
    assert [file for file in files if file.is_symlink() or not file.is_file()] == []
    code = (
        "import metacontrol_sim.srv, simulator_msgs.srv\n"
        f"for name in {SIMULATOR_SERVICES!r}:\n"
        "    one, other = getattr(metacontrol_sim.srv, name), getattr(simulator_msgs.srv, name)\n"
        "    assert one._md5sum == other._md5sum, name\n"
    )
    done = run(sys.executable, "-c", code, environment=environment, folder=tmp_path)
    assert done.returncode == 0, done.stderr[-3000:]


def test_mission_in_lockstep_runs_from_the_prefix(installed, tmp_path):
    _, environment = installed
    (tmp_path / "routes.yaml").write_text(SHORT)
    done = run(
        *("metacontrol", "run", "--engine", "lockstep", "--quiet", *ROUTE, "--output", "mission"),
        environment=environment,
        folder=tmp_path,
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert json.loads((tmp_path / "mission" / "summary.json").read_text())["goal_reached"] is True


def test_routes_are_found_from_the_prefix(installed, tmp_path):
    _, environment = installed
    done = run("metacontrol", "run", "--engine", "lockstep", "--route", "r0", environment=environment, folder=tmp_path)
    assert done.returncode == 2
    assert "r1, r2, r3" in done.stderr


@pytest.mark.parametrize(
    "command",
    [
        ("metacontrol", "--help"),
        ("rosmodel", "--help"),
        ("rosmodel", "extract", "--help"),
        ("rosrun", "mros1_reasoner", "explain", "--help"),
        ("rosrun", "mros1_reasoner", "replay", "--help"),
        ("rosrun", "rosgraph_manipulator", "plan", "--help"),
        ("rosrun", "rosgraph_monitor", "watch", "--help"),
        ("roslaunch", "--nodes", "metacontrol_sim", "metacontrol_sim_reasoner.launch"),
    ],
    ids=" ".join,
)
def test_command_runs_from_the_prefix(installed, tmp_path, command):
    _, environment = installed
    done = run(*command, environment=environment, folder=tmp_path)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert done.stdout.strip()


def test_models_check_clean_from_the_prefix(installed, tmp_path):
    prefix, environment = installed
    models = prefix / "share" / "metacontrol_sim" / "models"
    done = run("rosmodel", "check", str(models), environment=environment, folder=tmp_path)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


def test_observers_are_found_and_made_from_the_prefix(installed, tmp_path):
    _, environment = installed
    code = (
        "from rosgraph_monitor.observers.plugins import available, make\n"
        "for name in available(): print(name, make(name).topics)\n"
    )
    done = run(sys.executable, "-c", code, environment=environment, folder=tmp_path)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "SafetyQualityObserver" in done.stdout
