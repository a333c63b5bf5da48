#!/usr/bin/env python3
"""Every kind of node, started by roslaunch and by the launcher: graph, parameters and processes are the same."""

import contextlib
import json
import os
import re
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import psutil
import rosgraph
import rospy
import rostest
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import PairTest, is_alive, pid_of
from rosgraph_launcher.io.processes import MARK, OWNER
from rosgraph_launcher.io.warm_start.sitecustomize import SETTING

DATA = Path(__file__).resolve().parent / "data"
RECORDED = ("/eye", "/left/twin", "/left/deeper/twin", "/right/twin", "/someone", "/shell/wrapped")
ALL = (
    *RECORDED,
    *("/greeter", "/tools/passer", "/slower", "/tools/chooser", "/frame", "/frame_of_old"),
    *("/cpp/manager", "/cpp/counter"),
)
SCRIPT = "launched_script.sh"
OF_THE_CALLER = {"_", "SHLVL", "PWD", "OLDPWD", "ROS_LOG_FILENAME", MARK, OWNER}
"""Variables that tell of who starts a node: the shell script rosrun starts the launcher."""
TAKEN_BACK = {"PYTHONPATH", SETTING}
"""Variables that a prepared process takes back before its script begins; from outside, the former ones are seen."""
OF_OTHERS = re.compile(r"/(run_id|ros(distro|version)|(roslaunch|node_kit|rosgraph_\w+|launched_records)/.*)")
LATE = {"/counted", "/cpp/manager/bond", "/greeting", "/passed", "/slow", "/tf", "/tf_static", "/tools/chosen"}
"""Topics that their nodes publish some time after their start."""

PACKAGE = """<package format="2"><name>counting_nodelet</name><version>0.0.1</version><description>-</description>
<maintainer email="nobody@mros.example">nobody</maintainer><license>Apache-2.0</license>
<exec_depend>nodelet</exec_depend><export><nodelet plugin="${prefix}/nodelets.xml"/></export></package>"""
PLUGINS = """<library path="lib/libcounting"><class name="counting_nodelet/Counter" type="counting_nodelet::Counter"
base_class_type="nodelet::Nodelet"><description>-</description></class></library>"""


def build_nodelet(folder):
    """Build a package with a nodelet."""
    (folder / "lib").mkdir()
    (folder / "package.xml").write_text(PACKAGE)
    (folder / "nodelets.xml").write_text(PLUGINS)
    include = [f"-I/usr/include/{name}" for name in ("pluginlib", "class_loader", "rcpputils", "rcutils")]
    library = str(folder / "lib" / "libcounting.so")
    source = str(DATA / "counting_nodelet.cpp")
    subprocess.run(["g++", "-O0", "-fPIC", "-shared", *include, "-o", library, source], check=True, timeout=DEADLINE_S)


def plain(text):
    """A text without what is new at every start: the rest of an anonymous name, and the number in a log's name."""
    return re.sub(r"-\d+\.log\b", ".log", re.sub(r"someone_\w+", "someone", text))


def name_of(word):
    """The name of the node that an argument `__log:=` belongs to."""
    return plain(os.path.basename(word))


def variables(environment, hidden):
    return {key: plain(value) for key, value in environment.items() if key not in hidden}


def words_of(process):
    words = process.cmdline()
    logs = [name_of(word) for word in words if word.startswith("__log:=")]
    return [plain(word) for word in words if not word.startswith("__log:=")], logs


def seen_process(pid):
    """What can be seen of a process from outside."""
    process = psutil.Process(pid)
    words, logs = words_of(process)
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    fields = dict(line.split(":\t", 1) for line in lines if ":\t" in line)
    output = os.readlink(f"/proc/{pid}/fd/1")
    return {
        "words": words,
        "logs": logs,
        "variables": variables(process.environ(), OF_THE_CALLER | TAKEN_BACK),
        "folder": process.cwd(),
        "priority": process.nice(),
        "status": {key: fields[key] for key in ("Umask", "SigBlk", "SigIgn", "Name", "Uid", "NoNewPrivs")},
        "own session": os.getsid(pid) == pid,
        "input": os.readlink(f"/proc/{pid}/fd/0"),
        "log": re.sub(r"-(\d+-)?stdout", "-stdout", plain(os.path.basename(output))) if ".log" in output else "screen",
        "output mode": os.stat(f"/proc/{pid}/fd/1").st_mode,
    }


def names():
    """The nodes that are registered, by their names without what is new at every start."""
    with contextlib.suppress(rosgraph.MasterException, OSError):
        nodes = {owner for part in rosgraph.Master("/test").getSystemState() for _, owners in part for owner in owners}
        return {plain(name): name for name in nodes if plain(name) in ALL}
    return {}


def graph():
    """Topics and services, with the nodes that have them."""
    ours = set(ALL)
    return [
        sorted((plain(item), plain(owner)) for item, owners in part for owner in owners if plain(owner) in ours)
        for part in rosgraph.Master("/test").getSystemState()
    ]


def flat(tree, prefix=""):
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}/{key}")
        else:
            yield f"{prefix}/{key}", value


def tree_of(name):
    with contextlib.suppress(rosgraph.MasterError):
        return rosgraph.Master("/test").getParam(name)
    return {}


def tree_keys(name):
    return [key for key, _ in flat(tree_of(name))]


def parameters():
    """All parameters that are of the nodes. The master tells them: rospy has some of them from a cache."""
    return {plain(key): value for key, value in flat(tree_of("/")) if not OF_OTHERS.fullmatch(key)}


def records():
    """What the recording nodes tell of themselves."""
    found = {}
    for key, text in flat(tree_of("/launched_records")):
        record = json.loads(plain(text))
        record["variables"] = variables(record["variables"], OF_THE_CALLER)
        found[plain(key)] = record
    return found


def script():
    """The process of the shell script that is no ROS node, or None."""
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            words = process.cmdline()
            uri = process.environ().get("ROS_MASTER_URI")
            if any(word.endswith(SCRIPT) for word in words) and uri == rosgraph.get_master_uri():
                return process.pid
    return None


def seen():
    """All that can be seen of the nodes, once they all run; None before."""
    registered = names()
    pids = {name: pid_of(registered[name]) for name in registered}
    told = records()
    pid = script()
    if set(pids) != set(ALL) or None in pids.values() or set(told) != set(RECORDED) or not pid:
        return None
    published = graph()[0]
    if not {topic for topic, _ in published} >= LATE or ("/cpp/manager/bond", "/cpp/counter") not in published:
        return None
    with contextlib.suppress(psutil.Error, FileNotFoundError, ProcessLookupError):
        processes = {name: seen_process(number) for name, number in {**pids, "script": pid}.items()}
        return {"processes": processes, "records": told, "parameters": parameters(), "graph": graph()}
    return None


SETTLE_S = 100
"""Wall s, within which all that nodes do at their start must have happened."""
SAME_LOOKS = 10
"""Looks in a row that find the same; then nodes have done what they do at their start."""


def differs(found, expected):
    """Whether anything that is seen is another than expected."""
    parts = ("parameters", "graph", "records")
    return any(found[part] != expected[part] for part in parts) or any(
        found["processes"][name] != process for name, process in expected["processes"].items()
    )


def settled():
    """What is seen of the nodes once it stays the same: a bond of a nodelet comes up later than its node."""
    found, same = seen(), 0
    while same < SAME_LOOKS:
        again = wait_for(seen, "all nodes still run")
        same = same + 1 if found and not differs(again, found) else 0
        found = again
    return found


class LaunchedNodesTest(PairTest):
    maxDiff = None
    configurations = {
        f"shared_{value}": {"function": "f", "launch": str(DATA / "launched.launch"), "args": [f"shared:={value}"]}
        for value in (1, 2)
    }
    manipulator_parameters = {"save_action": "", "initial_configuration": "", "ready_timeout": 100.0, "probation": 0.0}
    launcher_parameters = {"restart_intensity": 100, "standby": True}

    @classmethod
    def setUpClass(cls):
        folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory())) / "counting_nodelet"
        folder.mkdir()
        build_nodelet(folder)
        os.environ["ROS_PACKAGE_PATH"] = f"{os.environ['ROS_PACKAGE_PATH']}:{folder}"
        super().setUpClass()

    def forget(self):
        for name in ("/launched_records", "/launched_shared", "/eye", "/cpp"):
            with contextlib.suppress(KeyError):
                rospy.delete_param(name)

    def by_roslaunch(self, value):
        """Start the nodes by roslaunch; return what is seen of them, and what roslaunch has written."""
        self.forget()
        with tempfile.TemporaryFile("w+") as output:
            process = subprocess.Popen(
                ["/usr/bin/roslaunch", str(DATA / "launched.launch"), f"shared:={value}"],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
            try:
                wait_for(seen, "roslaunch has started all nodes")
                found = settled()
            finally:
                process.send_signal(signal.SIGINT)
                process.wait(DEADLINE_S)
            wait_for(lambda: not names(), "all nodes have ended")
            output.seek(0)
            return found, output.read()

    def assert_same(self, what, expected):
        """Wait until all nodes are seen, and as expected: a bond of a nodelet comes up later than its node."""
        found = wait_for(seen, what)
        deadline = time.monotonic() + SETTLE_S
        while differs(found, expected) and time.monotonic() < deadline:
            found = wait_for(seen, what)
        for part in ("parameters", "graph", "records"):
            self.assertEqual(found[part], expected[part])
        for name, process in expected["processes"].items():
            self.assertEqual({name: found["processes"][name]}, {name: process})

    def test_nodes_are_as_roslaunch_starts_them(self):
        expected, output = zip(*(self.by_roslaunch(value) for value in (1, 2)), strict=True)
        self.assertEqual(expected[0]["records"]["/eye"]["at_import"]["shared"], 1)
        self.forget()

        self.assertEqual(self.request("shared_1"), 1, self.text)
        self.assert_same("the launcher has started all nodes", expected[0])

        before = {name: pid_of(real) for name, real in names().items()}
        rospy.delete_param("/launched_records")
        self.assertEqual(self.request("shared_2"), 1, self.text)  # prepared while the former nodes end
        self.assert_same("the launcher has replaced all nodes", expected[1])
        self.assertFalse(set(before.values()) & {pid_of(real) for real in names().values()})

        wait_for(lambda: len(self.launched()) > len(ALL) + len(RECORDED), "processes stand by")
        kept = ("/right/twin", "/cpp/manager")  # the first one is required, the other one still has the nodelet
        killed = {name: pid_of(real) for name, real in names().items() if name not in kept}
        for key in tree_keys("/launched_records"):
            if plain(key) in killed:
                rospy.delete_param(f"/launched_records{key}")
        for pid in killed.values():
            os.kill(pid, signal.SIGKILL)
        wait_for(lambda: not any(map(is_alive, killed.values())), "all others are dead")
        self.assert_same("the launcher has started them again", expected[1])
        self.wait_for_state("shared_2")

        loader = pid_of("/cpp/counter")
        os.kill(pid_of("/cpp/manager"), signal.SIGKILL)
        wait_for(lambda: not is_alive(loader), "the nodelet's loader has ended")
        self.assert_same("the launcher has started manager and nodelet again", expected[1])
        self.wait_for_state("shared_2")

        said = self.launcher.said()
        self.assertEqual(said.count("node /cpp/counter ended"), 1)  # not with its manager
        for line in ("/eye says 1", "/eye says 2", "/eye warns", "/right/twin warns"):
            self.assertIn(line, said)
            self.assertIn(line, "".join(output))
        self.assertNotIn("/right/twin says", said + "".join(output))


if __name__ == "__main__":
    os.chdir(Path(__file__).parent)
    rostest.rosrun("metacontrol_tests", "launched_nodes", LaunchedNodesTest)
