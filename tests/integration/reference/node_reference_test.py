#!/usr/bin/env python3
"""The reference of all nodes, docs/reference/nodes.md, beside the nodes that run and the parameters that they read."""

import contextlib
import json
import os
import re
import signal
import sys
import unittest
import xml.etree.ElementTree as ET
from pathlib import Path

import rosgraph
import rospy
import rosservice
import rostest
from helpers.waiting import wait_for
from integration.rosgraph_manipulator.manipulator_harness import pid_of
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
PAGE = ROOT / "docs" / "reference" / "nodes.md"
ROW = re.compile(
    r"^\| (publishes|subscribes|service|action|action client|reconfigure|parameter) \| `([^`]+)` \| (.*?) \|"
)
OF_EVERY_NODE = ("/rosout", "/tf_static", "/tf", "/clock", "/rosout_disable_topics_generation")
SERVICE_TYPES = {}
MASTER = rosgraph.Master("/node_reference_test")


def page():
    """Return the rows of each section of the page: heading -> {(kind, name, type or default)}."""
    found, section = {}, ""
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            section = line.lstrip("# ").strip("`")
        elif row := ROW.match(line):
            found.setdefault(section, set()).add((row[1], row[2], row[3].strip("`")))
    return found


def started():
    """Return the full name of the node that stands for each executable, the first one: `package/type` -> name."""
    launch = ET.parse(HERE / "node_reference.test").getroot()  # noqa: S314 our own file
    found = {}
    for group in launch.iter("group"):
        for node in group.iter("node"):
            found.setdefault(f"{node.get('pkg')}/{node.get('type')}", f"/{group.get('ns')}/{node.get('name')}")
    return found


def running():
    """Return what the master knows now: publishers, subscribers and services, and the types of topics."""
    return MASTER.getSystemState(), dict(MASTER.getTopicTypes())


def interfaces(node, known):
    """Return what a running node offers and takes: {(kind, name, type)}."""
    state, types = known
    publishers, subscribers, services = ({n for n, nodes in part if node in nodes} for part in state)
    services = {name for name in services if not name.endswith(("/get_loggers", "/set_logger_level"))}
    found = set()
    for name in {n.removesuffix("/goal") for n in subscribers if n.endswith("/goal")}:
        if {f"{name}/goal", f"{name}/cancel"} <= subscribers and {f"{name}/status", f"{name}/result"} <= publishers:
            found.add(("action", name, types[f"{name}/goal"].removesuffix("ActionGoal")))
            subscribers -= {f"{name}/goal", f"{name}/cancel"}
            publishers -= {f"{name}/{part}" for part in ("status", "feedback", "result")}
    for name in {n.removesuffix("/goal") for n in publishers if n.endswith("/goal")}:
        if {f"{name}/goal", f"{name}/cancel"} <= publishers and {f"{name}/status", f"{name}/result"} <= subscribers:
            found.add(("action client", name, types.get(f"{name}/goal", "").removesuffix("ActionGoal")))
            publishers -= {f"{name}/goal", f"{name}/cancel"}
            subscribers -= {f"{name}/{part}" for part in ("status", "feedback", "result")}
    for name in {n.removesuffix("/set_parameters") for n in services if n.endswith("/set_parameters")}:
        found.add(("reconfigure", name, ""))
        services -= {f"{name}/set_parameters"}
        publishers -= {f"{name}/parameter_descriptions", f"{name}/parameter_updates"}
    found |= {("publishes", name, types.get(name, "")) for name in publishers if name != "/rosout"}
    found |= {("subscribes", name, types.get(name, "")) for name in subscribers if name not in OF_EVERY_NODE}
    found |= {("service", name, service_type(name)) for name in services}
    return {(kind, relative(name, node), what) for kind, name, what in found}


def service_type(name):
    """Return the type of a service; "" as long as its node does not answer."""
    if not SERVICE_TYPES.get(name):
        with contextlib.suppress(rosservice.ROSServiceIOException):
            SERVICE_TYPES[name] = rosservice.get_service_type(name)
    return SERVICE_TYPES.get(name) or ""


def relative(name, node):
    """Return a name as the page has it: relative to the robot's namespace, `~` for the node's own."""
    namespace = node[: node.rindex("/") + 1]
    if name == node:
        return "~"
    return name.replace(f"{node}/", "~", 1) if name.startswith(f"{node}/") else name.removeprefix(namespace)


def read():
    """Return what all nodes have read until now: entries of the recorder."""
    files = (Path(os.environ["ROS_LOG_DIR"]) / "parameters").glob("*")
    lines = (line for file in files for line in file.read_text(encoding="utf-8").splitlines(keepends=True))
    return [json.loads(line) for line in lines if line.endswith("\n")]


def parameters(node, entries):
    """Return the parameters that a node has read: {("parameter", name, default)}."""
    found = {}
    for entry in entries:
        if entry["node"] == node:
            name = entry["name"] if entry["name"][0] in "~/" else rospy.resolve_name(entry["name"], node)
            name = re.sub(r"^~(global|local)_costmap/", "~*_costmap/", relative(name, node))
            found[name] = entry["default"] if found.get(name) is None else found[name]
    found.pop("", None)  # the robot's namespace as a whole, in which limits are looked for
    anywhere = {name for name in found if f"~{name}" in found}  # private, or, where it is not given, the robot's
    left_out = anywhere.union(OF_EVERY_NODE)
    return {("parameter", name, shown(default)) for name, default in found.items() if name not in left_out}


def shown(default):
    """Return a default as the page has it."""
    text = json.dumps(default, ensure_ascii=False) if not isinstance(default, str) else default
    return "" if text in ("null", "[]", "{}") else text.replace(str(ROOT), "").replace("|", "/")


def line(row):
    """Return a row as a line of the page."""
    kind, name, what = row
    return f"| {kind} | `{name}` | {f'`{what}`' if kind == 'parameter' and what else what} |"


class NodeReference(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("node_reference_test")
        cls.page, cls.nodes, cls.heard = page(), started(), {}

    def listen(self):
        """Subscribe to everything, because some nodes take what they need only while somebody listens to them."""
        for name, _ in MASTER.getTopicTypes():
            if name.startswith(("/floor/", "/cell/")) and name not in self.heard:
                self.heard[name] = rospy.Subscriber(name, rospy.AnyMsg, lambda _: None)

    def differences(self, kinds):
        """Return the lines by which the page differs, or nothing."""
        look, known = (parameters, read()) if kinds == "parameter" else (interfaces, running())
        lines = []
        for executable, node in self.nodes.items():
            rows = {row for row in self.page.get(executable, ()) if (row[0] == "parameter") == (kinds == "parameter")}
            real = look(node, known)
            lines += [f"{executable}: add    {line(row)}" for row in sorted(real - rows)]
            lines += [f"{executable}: remove {line(row)}" for row in sorted(rows - real)]
        return lines

    def same(self, kinds):
        last = []

        def is_same():
            self.listen()
            last[:] = self.differences(kinds)
            return not last

        wait_for(is_same, lambda: f"{PAGE.relative_to(ROOT)} differs:\n" + "\n".join(last))

    def test_page_has_the_topics_services_and_actions_of_every_node(self):
        self.same("interface")

    def test_page_has_the_parameters_of_every_node(self):
        self.kill_the_manipulator()
        self.same("parameter")

    def kill_the_manipulator(self):
        """Have the manipulator take over what an earlier one has deployed: only then it reads what that one kept."""
        node, told = self.nodes["rosgraph_manipulator/rosgraph_manipulator"], []
        rospy.Subscriber(f"{node}/active_configuration", ActiveConfiguration, told.append)
        stable = FunctionGrounding.STABLE
        wait_for(lambda: told and [f.state for f in told[-1].functions] == [stable], "a configuration is deployed")
        os.kill(pid_of(node), signal.SIGKILL)

    def test_page_names_every_executable(self):
        named = set(re.findall(r"`?(\w+/\w+)`?", PAGE.read_text(encoding="utf-8")))
        there = {f"{path.parents[1].name}/{path.name}" for path in ROOT.glob("catkin_ws/src/*/nodes/*")}
        self.assertEqual(there - named, set())


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "node_reference", NodeReference, sys.argv)
