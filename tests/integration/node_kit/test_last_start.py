"""Each part of the meta-controller begins again, whatever was done to its parameters since it began."""

import contextlib
import os
import shutil
import signal
import subprocess
from pathlib import Path

import psutil
import pytest
from helpers.ports import reserved_port
from helpers.waiting import DEADLINE_S, wait_for
from node_kit.io.xml_rpc import CallError, Client
from node_kit.ros.last_start import GROUP
from node_kit.ros.parts import TOPIC

INTEGRATION = Path(__file__).resolve().parents[1]
SERVER = INTEGRATION / "rosgraph_manipulator" / "data" / "server.launch"
MODEL = INTEGRATION / "mros1_reasoner" / "data" / "application.owl"
LAUNCH = """<launch>
  <group ns="ferry">
    <include file="$(find rosgraph_monitor)/launch/monitor.launch">
      <arg name="config" value="{folder}/monitor.yaml"/>
    </include>
    <include file="$(find rosgraph_manipulator)/launch/manipulator.launch">
      <arg name="config" value="{folder}/manipulator.yaml"/>
    </include>
    <include file="$(find mros1_reasoner)/launch/run.launch">
      <arg name="model" value="{model}"/>
      <arg name="parameters" value="{{reasoner: rules}}"/>
    </include>
  </group>
</launch>"""
PARTS = ("rosgraph_monitor", "rosgraph_manipulator", "rosgraph_launcher", "reasoner")


class Ferry:
    """A meta-controller that roslaunch has started, and its master."""

    def __init__(self, master, roslaunch, console, folder):
        self.master, self.roslaunch, self._console, self.folder = master, roslaunch, console, folder

    def get(self, name):
        """Return a parameter; None: it is not set."""
        with contextlib.suppress(CallError):
            return self.master.call("getParam", name)
        return None

    def process(self, part):
        """Return the process of a part that has begun, or None."""
        words = f"__name:={part}"
        found = [p for p in psutil.Process(self.roslaunch.pid).children() if words in _words(p)]
        return found[0] if found and self.get(f"{GROUP}/ferry__{part}") else None

    def restarted(self, part):
        """Kill a part, and wait until roslaunch has started the next one and it has begun."""
        before = self.process(part)
        said = len(self.said(part))
        before.kill()

        def has_begun():
            begun = self.process(part)
            return begun and begun != before and self._has_begun(part, begun.pid)

        wait_for(has_begun, lambda: f"{part} begins again: {self.said(part)[said:]}")
        return self.said(part)[said:]

    def said(self, part):
        """Return all lines of a part about its start, and none about short silences of the master."""
        lines = self._console.read_text(errors="replace").splitlines()
        return [line for line in lines if line.startswith(f"/ferry/{part}: ") and "it ends if that lasts" not in line]

    def _has_begun(self, part, pid):
        """Tell whether the process of a part gives signs of life, as a part does when it has begun."""
        with contextlib.suppress(CallError):
            uri = self.master.call("lookupNode", f"/ferry/{part}")
            with Client(uri, "/test") as node:  # the master still has what the killed one had published
                return node.pid() == pid and f"/ferry/{TOPIC}" in dict(node.call("getPublications"))
        return False


def _words(process):
    with contextlib.suppress(psutil.Error):
        return process.cmdline()
    return []


@pytest.fixture(scope="module")
def ferry(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ferry")
    shutil.copy(MODEL, folder)
    (folder / "ferry.launch").write_text(LAUNCH.format(folder=folder, model=folder / MODEL.name))
    (folder / "monitor.yaml").write_text("rate: 5.0\n")
    (folder / "manipulator.yaml").write_text(f"probation: 2.0\nconfigurations:\n  slow: {{launch: {SERVER}}}\n")
    with reserved_port() as port, Client(f"http://localhost:{port}", "/test") as master:
        own = {"ROS_MASTER_URI": master.uri, "ROS_LOG_DIR": str(folder), "ROS_HOME": str(folder)}
        words = ["roslaunch", "-p", str(port), str(folder / "ferry.launch")]
        console = folder / "console"
        with console.open("wb") as output:
            roslaunch = subprocess.Popen(words, env={**os.environ, **own}, stdout=output, stderr=output)
        try:
            found = Ferry(master, roslaunch, console, folder)
            for part in PARTS:
                wait_for(lambda part=part: found.process(part), f"{part} begins")
            yield found
        finally:
            roslaunch.send_signal(signal.SIGINT)
            roslaunch.wait(DEADLINE_S)


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("rosgraph_manipulator", "configurations", None),
        ("rosgraph_manipulator", "configurations", "nonsense"),
        ("rosgraph_manipulator", "probation", "long"),
        ("rosgraph_manipulator", "", "nonsense"),
        ("rosgraph_manipulator", "", None),
        ("rosgraph_launcher", "restart_period", "long"),  # it was not set before
        ("rosgraph_monitor", "rate", "fast"),
        ("rosgraph_monitor", "", None),  # it could begin without
        ("reasoner", "model_file", None),
        ("reasoner", "model_file", "/no/such.owl"),
    ],
)
def test_part_begins_with_what_it_had_at_its_last_start(ferry, part, key, value):
    name = f"/ferry/{part}/{key}".rstrip("/")
    before = ferry.get(name)
    if value is None:
        ferry.master.call("deleteParam", name)
    else:
        ferry.master.call("setParam", name, value)
    lines = ferry.restarted(part)
    begins_again = "it begins again with what it had at its last start: /ferry/"
    is_set_again = "what was deleted since its last start is set again: /ferry/"
    assert [line for line in lines if (begins_again if key and value else is_set_again) in line], lines
    assert not [line for line in lines if "tries again in" in line]
    if key:
        assert ferry.get(name) == before


def test_what_somebody_has_set_and_can_be_used_holds(ferry):
    ferry.master.call("setParam", "/ferry/rosgraph_manipulator/probation", 3.0)
    assert ferry.restarted("rosgraph_manipulator") == []
    assert ferry.get("/ferry/rosgraph_manipulator/probation") == 3.0
    kept = f"{GROUP}/ferry__rosgraph_manipulator"
    wait_for(lambda: '/probation": "3.0"' in str(ferry.get(kept)), lambda: f"it is kept: {ferry.get(kept)}")
    ferry.master.call("deleteParam", "/ferry/rosgraph_manipulator/probation")
    ferry.master.call("deleteParam", "/ferry/rosgraph_manipulator/configurations")
    ferry.restarted("rosgraph_manipulator")
    assert ferry.get("/ferry/rosgraph_manipulator/probation") == 3.0  # it is what the last one began with


def test_what_somebody_has_set_holds_also_where_a_file_is_to_blame(ferry):
    ferry.master.call("setParam", "/ferry/reasoner/cool_down", 1.5)
    model = ferry.folder / MODEL.name
    model.rename(model.with_suffix(".away"))
    said = len(ferry.said("reasoner"))
    ferry.process("reasoner").kill()
    wait_for(
        lambda: [line for line in ferry.said("reasoner")[said:] if "tries again in" in line],
        lambda: f"it waits: {ferry.said('reasoner')[said:]}",
    )
    lines = ferry.said("reasoner")[said:]
    assert [line for line in lines if "it has what it found before: /ferry/reasoner/cool_down" in line], lines
    assert ferry.get("/ferry/reasoner/cool_down") == 1.5
    model.with_suffix(".away").rename(model)
    assert ferry.restarted("reasoner") == []
    assert ferry.get("/ferry/reasoner/cool_down") == 1.5
