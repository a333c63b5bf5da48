"""Our nodes end promptly whatever they are at: told to, without a master, and inside a call to one that hangs."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import rosgraph
import rospkg
import yaml
from metacontrol_experiments.processes import free_port

DEADLINE_S = 60
SERVER = str(Path(__file__).resolve().parent / "manipulator" / "server.launch")
NAVIGATION = Path(rospkg.RosPack().get_path("metacontrol_sim")) / "config" / "move_base.yaml"
NODES = {  # its package, and what it publishes when it is at its work
    "rosgraph_launcher": ("rosgraph_manipulator", "/rosgraph_launcher/state"),
    "rosgraph_manipulator": ("rosgraph_manipulator", "/rosgraph_manipulator_action_server/status"),
    "action_relay": ("rosgraph_manipulator", "/a/status"),
    "move_base": ("move_base", "/move_base/status"),
}
PARAMETERS = {
    "/configurations": {"slow": {"launch": SERVER}},
    "/rosgraph_manipulator": {"launcher_timeout": 0.1},
    "/action_relay": {"action": "a", "server": "b", "type": "actionlib/TestAction"},
    "/move_base": yaml.safe_load(NAVIGATION.read_text()),
}


def wait_for(condition, what):
    end = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end, f"not within {DEADLINE_S} s: {what}"
        time.sleep(0.05)


class World:
    """A master of the test's own, and nodes that join it."""

    def __init__(self, folder):
        port = free_port()
        self._folder = folder
        self._words = [sys.executable, "-c", f"import rosmaster; rosmaster.rosmaster_main(['--core', '-p', '{port}'])"]
        own = {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_LOG_DIR": str(folder), "ROS_HOME": str(folder)}
        self._environment = {**os.environ, **own, "PYTHONUNBUFFERED": "1"}
        self._master = rosgraph.Master("/test", own["ROS_MASTER_URI"])
        self._processes = []

    def start_master(self, parameters=None):
        process = self._start("master", self._words)
        wait_for(self._master_answers, "the master answers")
        for name, value in {**PARAMETERS, **(parameters or {})}.items():
            self._master.setParam(name, value)
        return process

    def start_node(self, name):
        return self._start(name, ["/usr/bin/rosrun", NODES[name][0], name])

    def wait_until_up(self, name):
        topic = NODES[name][1]
        wait_for(lambda: f"/{name}" in dict(self._master.getSystemState()[0]).get(topic, ()), f"{name} is up")

    def said(self, name):
        return (self._folder / f"{name}.txt").read_text()

    def assert_ends(self, name, process):
        try:
            process.wait(DEADLINE_S)
        except subprocess.TimeoutExpired:
            pytest.fail(f"{name} goes on: {self.said(name)}")
        assert "Traceback" not in self.said(name)

    def close(self):
        for process in self._processes:
            process.kill()
            process.wait(DEADLINE_S)

    def _start(self, name, words):
        with open(self._folder / f"{name}.txt", "w") as output:
            process = subprocess.Popen(words, env=self._environment, stdout=output, stderr=subprocess.STDOUT)
        self._processes.append(process)
        return process

    def _master_answers(self):
        with contextlib.suppress(OSError):
            return bool(self._master.getPid())
        return False


@pytest.fixture
def world(tmp_path):
    made = World(tmp_path)
    yield made
    made.close()


@pytest.mark.parametrize("name", NODES)
def test_node_ends_when_told_to(world, name):
    world.start_master()
    process = world.start_node(name)
    world.wait_until_up(name)
    process.send_signal(signal.SIGTERM)
    world.assert_ends(name, process)
    assert process.returncode == 0


@pytest.mark.parametrize("name", NODES)
def test_node_ends_when_told_to_though_the_master_hangs(world, name):
    master = world.start_master()
    process = world.start_node(name)
    world.wait_until_up(name)
    master.send_signal(signal.SIGSTOP)
    process.send_signal(signal.SIGTERM)
    world.assert_ends(name, process)


@pytest.mark.parametrize("name", NODES)
def test_node_without_its_master_says_so_once_and_ends(world, name):
    master = world.start_master()
    process = world.start_node(name)
    world.wait_until_up(name)
    master.kill()
    world.assert_ends(name, process)
    assert world.said(name).count("the master is lost") == 1, world.said(name)


@pytest.mark.parametrize("name", NODES)
def test_node_that_waits_for_a_master_ends_when_told_to(world, name):
    process = world.start_node(name)
    wait_for(lambda: "master may not be running" in world.said(name), f"{name} waits for a master")
    process.send_signal(signal.SIGTERM)
    world.assert_ends(name, process)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_manipulator_ends_when_told_to_though_its_launcher_hangs(world, number):
    world.start_master({"/rosgraph_manipulator/initial_configuration": "slow"})
    launcher = world.start_node("rosgraph_launcher")
    world.wait_until_up("rosgraph_launcher")
    launcher.send_signal(signal.SIGSTOP)
    process = world.start_node("rosgraph_manipulator")
    wait_for(lambda: "rosgraph_launcher is not there" in world.said("rosgraph_manipulator"), "it asks the launcher")
    process.send_signal(number)
    world.assert_ends("rosgraph_manipulator", process)
