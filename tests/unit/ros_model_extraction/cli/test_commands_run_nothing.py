"""The commands that read a package run nothing of it: each of its files would leave a mark."""

import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
from helpers.rosmodel_command import run  # noqa: F401
from mros1_reasoner.io import first_look
from ros_model.graph.snapshot import GraphSnapshot, NodeState
from ros_model.io import master
from ros_model.io.launch_files import load

EXAMPLE = Path(__file__).parents[4] / "examples" / "talker_listener"
EVIL = "$(eval __import__('os').system('touch {mark}'))"


class Trap:
    """A package that leaves marks.

    Attributes:
        folder: of the package.
        launch: its launch file.
        may_run: which of its files a test expects to be run.
    """

    def __init__(self, place):
        self._marks, self.folder = place / "marks", place / EXAMPLE.name
        self._marks.mkdir()
        self.may_run = []
        shutil.copytree(EXAMPLE, self.folder, ignore=shutil.ignore_patterns("__pycache__"))
        self.launch = self.folder / "launch" / "robot.launch"
        self.launch.write_text('<launch>\n  <node pkg="talker_listener" type="listener" name="listener"/>\n</launch>\n')
        for path in [*self.folder.rglob("*.py"), *self.folder.glob("nodes/*"), self.folder / "CMakeLists.txt"]:
            self._spoil(path, f'open({str(self._marks / path.name)!r}, "w").close()', "from __future__")
        for path in self.folder.rglob("*.launch"):
            text = path.read_text()
            command = f'<param name="told" command="touch {self._marks / path.name}"/>'
            path.write_text(text.replace("</launch>", f"  {command}\n</launch>"))

    def _spoil(self, path, line, future):
        """Put a line where Python runs it; CMake does not even take it for a command."""
        before = path.read_text().splitlines(keepends=True)
        number = next((n for n, text in enumerate(before) if text.startswith(future)), -1) + 1
        number = number or int(before[:1] != [] and before[0].startswith("#!"))
        line = f"execute_process(COMMAND touch {self._marks / path.name})" if path.suffix == ".txt" else line
        path.write_text("".join([*before[:number], line + "\n", *before[number:]]))

    @property
    def ran(self):
        return sorted(path.name for path in self._marks.iterdir())


@pytest.fixture
def trap(tmp_path, monkeypatch):
    trap = Trap(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}:{EXAMPLE.parents[1] / 'catkin_ws' / 'src'}")
    monkeypatch.chdir(trap.folder)
    yield trap
    assert trap.ran == trap.may_run


def test_what_is_run_leaves_a_mark(tmp_path):
    trap = Trap(tmp_path)
    for path in (trap.folder / "setup.py", trap.folder / "src" / "talker_listener" / "battery_life.py"):
        subprocess.run([sys.executable, path], capture_output=True, check=False)
    load(trap.launch, runs_programs=True)
    assert trap.ran == ["battery_life.py", "robot.launch", "setup.py"]


def test_extract_runs_nothing_of_a_package(trap, run, tmp_path):  # noqa: F811
    status, out, _ = run("extract", trap.folder, "-o", tmp_path / "out")
    assert status == 0 and "talker_listener.ros" in out
    assert "fast_talker" in (tmp_path / "out" / "talker_listener.ros").read_text()


def test_extract_runs_nothing_of_a_launch_file(trap, run, tmp_path):  # noqa: F811
    status, _, _ = run("extract", trap.launch, "-o", tmp_path / "out")
    assert status == 0
    assert "which a program gives that was not run: touch" in (tmp_path / "out" / "robot.rossystem").read_text()


def test_extract_refuses_python_in_a_launch_file(trap, run, tmp_path):  # noqa: F811
    evil = EVIL.format(mark=tmp_path / "marks" / "eval")
    trap.launch.write_text(trap.launch.read_text().replace('name="listener"', f'name="listener" args="{evil}"'))
    status, _, said = run("extract", trap.launch, "-o", tmp_path / "out")
    assert status == 2 and "roslaunch refuses it" in said


def test_check_runs_nothing_of_a_project(trap, run):  # noqa: F811
    status, out, _ = run("check", trap.folder / "models")
    assert status == 0 and "battery_life fails: ModuleNotFoundError" in out


def test_check_runs_the_utility_of_a_package_that_is_installed_and_nothing_else(trap, run, monkeypatch):  # noqa: F811
    monkeypatch.syspath_prepend(trap.folder / "src")
    trap.may_run = ["__init__.py", "battery_life.py"]
    try:
        status, out, _ = run("check", trap.folder / "models")
        assert status == 0 and "battery_life fails" not in out
    finally:
        for name in ("talker_listener", "talker_listener.battery_life"):
            sys.modules.pop(name, None)


def test_doctor_runs_nothing_of_a_project_and_of_what_its_robot_was_started_by(trap, run, monkeypatch):  # noqa: F811
    process = SimpleNamespace(
        cmdline=lambda: ["roslaunch", str(trap.launch)], cwd=lambda: str(trap.folder), environ=dict
    )
    read = []
    usual = first_look.load
    talker = GraphSnapshot(nodes={"/talker": NodeState("/talker", "http://localhost:1")})
    monkeypatch.setattr(master, "take_snapshot", lambda *_: talker)
    monkeypatch.setattr(first_look.NodeApi, "ask_pid", lambda _: 1)
    monkeypatch.setattr(first_look, "look_up", lambda _: SimpleNamespace(lineage=[SimpleNamespace(pid=1)]))
    monkeypatch.setattr(first_look, "load", lambda path, *words: read.append(path) or usual(path, *words))
    monkeypatch.setattr(psutil, "Process", lambda _: process)
    status, out, _ = run("doctor", trap.folder, "--listen", "0")
    assert status == 1 and out.splitlines()[-1].endswith("findings")
    assert read == [trap.launch]
