"""Everything that reads a file: by which errors it may refuse one, and good files to begin from."""

from __future__ import annotations

import io
import json
import logging
import shutil
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unittest.mock import patch
from xml.parsers.expat import ExpatError

import cv2
import numpy as np
import yaml
from helpers.campaign_tables import result
from helpers.mission_bags import adapting_mission
from metacontrol_bags.adaptation import describe_adaptation
from metacontrol_bags.bag import BagError, read_record
from metacontrol_bags.bag_file import BagFile
from metacontrol_bags.metrics import MetricsError, summarise
from metacontrol_dashboard.io.bags import read_run
from metacontrol_dashboard.state.requests import RequestError, read_request
from metacontrol_experiments.campaign.calibration import CalibrationError
from metacontrol_experiments.campaign.matrix import CampaignError, Known, ground_files, parse_campaign
from metacontrol_experiments.campaign.progress import from_json, to_json
from metacontrol_experiments.contingency.parsing import ComponentError, ContingencyError
from metacontrol_experiments.io.campaign_folder import results_of, write_table
from metacontrol_experiments.io.ground_files import read_ground
from metacontrol_experiments.io.input_files import read_components, read_contingencies, read_route, route_names
from metacontrol_experiments.io.report_files import read_published
from metacontrol_experiments.io.report_files import read_table as read_report
from metacontrol_experiments.io.tables import read_delays, read_runs
from metacontrol_experiments.io.yardstick_runs import TraceError, read_trace
from metacontrol_experiments.lockstep.delays import DelayError
from metacontrol_experiments.mission.routes import RouteError
from metacontrol_experiments.pyramid.campaign import (
    PyramidRun,
    levels,
    parse_pyramids,
    read_summary,
    report,
    rows,
)
from metacontrol_experiments.report.missions import ReportError
from metacontrol_experiments.report.published import PublishedError
from metacontrol_sim.ros.send_goal import GoalFileError, read_goal
from move_base.parameters.reader import read_parameters
from mros1_reasoner.io import ontology_files
from mros1_reasoner.io.ontology_files import read_knowledge_base, read_triples
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoner_bag import read_decisions, read_recording
from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop.asked import Asked
from mros1_reasoner.replay.recording import RecordingError
from node_kit.io.input_files import InputFileError, read_text, read_yaml
from node_kit.last_start import Kept, kept_of, missing, remedy
from node_kit.parameters import ParameterError
from node_kit.takeover import TakeoverError, decode_parameter
from pybullet_simulator.io.map_file import MapError, read_map
from pybullet_simulator.io.robot_file import RobotFileError, planar_urdf
from pybullet_simulator.io.world_file import read_world
from pybullet_simulator.world.world import WorldError, rasterise
from ros_model.checks.systems import check_system
from ros_model.checks.whole_projects import check_project
from ros_model.errors import ModelError
from ros_model.io.files import read_text as read_model_text
from ros_model.io.models import read_library, read_packages, read_system
from ros_model.io.project import library_beside, load_project, read_table
from ros_model.language.reconfigure import ReconfigureError, parse_reconfigure
from ros_model_extraction.io.launch_files import read_launch_file
from ros_model_extraction.packages.package_source import extract_package
from rosgraph_manipulator.change.journal import Journal, begin_journal, parse_journal, resume
from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.io.configuration_file import options_from, read_file
from rosgraph_manipulator.io.launch_files import LaunchFileError, read_model
from rosgraph_manipulator.io.launch_files import read_launch_file as read_deployed_file

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "catkin_ws/src"
EXAMPLES = ROOT / "examples"


@dataclass(frozen=True)
class Reader:
    """Something that reads a file.

    Attributes:
        name: of what it reads.
        modules: of the packages, as paths below catkin_ws/src without `/src/PACKAGE`, that open the file.
        kind: of structure, for `mutation.mutated`.
        file: name of the file.
        seeds: returns good files.
        errors: by which it may refuse a file.
        read: reads the file.
        share: of all inputs, beside that of the others.
        names_file: whether a refusal names the file; False where the file was read, and only its values are judged.
    """

    name: str
    modules: tuple[str, ...]
    kind: str
    file: str
    seeds: Callable[[], Iterable[bytes]]
    errors: tuple[type[Exception], ...]
    read: Callable[[Path], object]
    share: float = 1.0
    names_file: bool = True


def _files(*names: str) -> Callable[[], list[bytes]]:
    return lambda: [(ROOT / name).read_bytes() for name in names]


def _texts(*texts: str) -> Callable[[], list[bytes]]:
    return lambda: [text.encode() for text in texts]


# -- models ------------------------------------------------------------------------------------------------------------

_SYSTEMS = _files(
    "examples/talker_listener/models/talker_listener.rossystem",
    "examples/example_mission/models/crawler.rossystem",
    "examples/pick_cell/models/cell.rossystem",
    "tests/integration/mros1_reasoner/cells/variants/picks_by_eye.rossystem",
    "tests/integration/mros1_reasoner/greenhouse/models/greenhouse.rossystem",
)


@cache
def _library() -> Any:
    return read_library([EXAMPLES / "talker_listener/models/talker_listener.ros"])


def _checked_system(path: Path) -> object:
    return list(check_system(read_system(path), None, _library()))


def _project(path: Path) -> object:
    """Read a project in which one file is bad, and check it."""
    folder = path.parent
    models = EXAMPLES / "talker_listener/models"
    for file in [*models.iterdir(), *(models / "variants").iterdir()]:
        copied = folder / file.relative_to(models)
        if file.is_file() and not copied.exists():
            copied.parent.mkdir(exist_ok=True)
            shutil.copyfile(file, copied)
    project = load_project(folder)
    return list(check_project(project, library_beside(folder)))


def _reconfigure(path: Path) -> object:
    try:
        return parse_reconfigure(read_model_text(path))
    except ReconfigureError as error:
        raise ModelError(f"{path}: {error}") from error


# -- packages ----------------------------------------------------------------------------------------------------------


def _package(path: Path) -> object:
    """Extract a package in which one file is bad."""
    folder = path.parent if path.parent.name not in ("src", "msg", "cfg", "scripts") else path.parent.parent
    for name, text in _PACKAGE.items():
        file = folder / name
        if file != path:
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
    return extract_package(folder).model()


_PYTHON = """#!/usr/bin/env python3
import rospy
from std_msgs.msg import String, Float32
RATE = rospy.get_param("~rate", 10)
TOPICS = {"a": String, "b": Float32}
class Node:
    def __init__(self, name="x", *others, **more):
        self.pub = rospy.Publisher(f"{name}/out", String, queue_size=1)
        for topic, kind in TOPICS.items():
            rospy.Subscriber(topic, kind, self.take)
        while RATE > 3 and not rospy.is_shutdown():
            rospy.Service("~go", "std_srvs/Empty", lambda _: None)
    def take(self, message):
        self.pub.publish(str(message.data) * 2)
if __name__ == "__main__":
    rospy.init_node("node")
    Node(rospy.get_param("~name", "y" + "z"))
    rospy.spin()
"""
_CPP = """#include <ros/ros.h>
#include <std_msgs/String.h>
namespace a { const std::string kTopic = "chatter"; }
class Node {
 public:
  explicit Node(ros::NodeHandle nh) : nh_(nh) {
    pub_ = nh_.advertise<std_msgs::String>(a::kTopic, 1);
    nh_.param<double>("rate", rate_, 10.0);
    sub_ = nh_.subscribe("in", 10, &Node::take, this);
  }
  void take(const std_msgs::StringConstPtr& m) { pub_.publish(*m); }
 private:
  ros::NodeHandle nh_; ros::Publisher pub_; ros::Subscriber sub_; double rate_;
};
int main(int argc, char** argv) { ros::init(argc, argv, "b"); Node n(ros::NodeHandle("~")); ros::spin(); return 0; }
"""
_CMAKE = """cmake_minimum_required(VERSION 3.0.2)
project(bad)
set(NAMES a b)
find_package(catkin REQUIRED COMPONENTS roscpp std_msgs)
add_message_files(FILES A.msg)
foreach(name ${NAMES})
  add_executable(${name}_node src/${name}.cpp)
  target_link_libraries(${name}_node ${catkin_LIBRARIES})
endforeach()
if(CATKIN_ENABLE_TESTING)
  add_executable(t src/t.cpp)
endif()
file(GLOB SOURCES src/*.cpp)
catkin_install_python(PROGRAMS scripts/node DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
"""
_MANIFEST = """<?xml version="1.0"?>
<package format="2"><name>bad</name><version>1.0.0</version><description>d</description>
<maintainer email="a@b.org">a</maintainer><license>Apache-2.0</license><depend>roscpp</depend>
<export><nodelet plugin="${prefix}/nodelets.xml"/></export></package>
"""
_NODELETS = """<library path="lib/libbad"><class name="bad/N" type="bad::N" base_class_type="nodelet::Nodelet">
<description>d</description></class></library>
"""
_CFG = """#!/usr/bin/env python3
PACKAGE = "bad"
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
kinds = gen.enum([gen.const("A", int_t, 0, "a"), gen.const("B", int_t, 1, "b")], "kinds")
gen.add("rate", double_t, 0, "Hz", 10.0, 0.1, 100)
gen.add("kind", int_t, 0, "k", 0, 0, 1, edit_method=kinds)
for name in ["x", "y"]:
    gen.add(name + "_size", int_t, 0, "s", 2 * 3, 0, 10)
exit(gen.generate(PACKAGE, "bad", "Bad"))
"""
_MSG = "# a\nuint8 A=1\nstring B=b # c\nHeader header\nfloat64[3] x\nbad/Other[] others\n"
_PACKAGE = {
    "package.xml": _MANIFEST,
    "CMakeLists.txt": _CMAKE,
    "nodelets.xml": _NODELETS,
    "src/a.cpp": _CPP,
    "src/b.cpp": _CPP,
    "scripts/node": _PYTHON,
    "cfg/Bad.cfg": _CFG,
    "msg/A.msg": _MSG,
}

# -- launch files ------------------------------------------------------------------------------------------------------

_LAUNCHED = _texts(
    """<launch><arg name="rate" default="5"/><arg name="ns" value="a"/>
  <group ns="$(arg ns)" if="$(eval arg('rate') != 3)"><param name="p" value="$(arg rate)" type="double"/>
    <node pkg="node_kit" type="talker" name="talker" args="-x $(anon t) --y" respawn="true" respawn_delay="2"
      output="screen" required="false" ns="b" cwd="node" launch-prefix="nice">
      <remap from="chatter" to="/c/chatter"/><param name="~q" type="yaml" value="[1, {a: 2.5}, null]"/>
      <rosparam>{a: [1, 2], b: {c: "x"}}</rosparam><env name="E" value="1"/></node></group>
  <rosparam param="list">[1, 2.0, x, true]</rosparam><rosparam subst_value="true">a: $(arg rate)</rosparam></launch>
""",
    """<launch><machine name="m" address="localhost" user="u" env-loader="/e"/>
  <node machine="m" pkg="node_kit" type="listener.py" name="l" unless="false"/>
  <test test-name="t" pkg="node_kit" type="x" name="x"/>
  <include file="$(find rosgraph_monitor)/launch/aggregator.launch" pass_all_args="true"></include></launch>
""",
    """<launch><node pkg="nodelet" type="nodelet" name="manager" args="manager"/>
  <node pkg="nodelet" type="nodelet" name="n" args="load bad/N manager _x:=1 in:=out __name:=z"/></launch>
""",
)

# -- settings ----------------------------------------------------------------------------------------------------------


def _monitor_settings(path: Path) -> object:
    tree = read_yaml(path)
    tree = tree if isinstance(tree, dict) else {}
    from rosgraph_monitor.ros import parameters

    from bad_input.unconnected import unconnected

    with unconnected({"/node": tree}):
        parts = parameters.components(), parameters.topics(), parameters.timing(), parameters.patience()
        parameters.strangers()
        parameters.names("observers", [])
        parameters.text("desired_rossystem")
        return *parts, parameters.scope({})


def _reasoner_settings(path: Path) -> object:
    tree = read_yaml(path)
    parameters = Parameters(tree if isinstance(tree, dict) else {})
    knowledge = _knowledge()
    parameters.strangers  # noqa: B018
    parameters.model_files, parameters.vocabulary_files  # noqa: B018
    parameters.period, parameters.execution_deadline, parameters.asks, parameters.action  # noqa: B018
    parameters.nodes, parameters.reasoner, parameters.task_actions  # noqa: B018
    Asked.from_parameter(parameters.asked)
    return parameters.settings(knowledge), parameters.objectives(knowledge)


@cache
def _knowledge() -> Any:
    return read_knowledge_base([EXAMPLES / "talker_listener/models/talker_listener.owl"])


def _manipulator_settings(path: Path) -> object:
    return options_from(read_file(str(path)))


def _kept_journal() -> list[bytes]:
    failures = {"f_talk": "dead"}
    kept = Journal({"f_talk": "frugal"}, "fast", 99.5, attempts=1, failures=failures, supervisor="roslaunch 7")
    return [yaml.safe_dump(kept.as_parameter()).encode()]


def _kept_by_manipulator(path: Path) -> object:
    """Begin by a journal that a manipulator finds on the parameter server, and keep the next one there."""
    from bad_input.unconnected import told_by_master

    try:
        journal = parse_journal(told_by_master(read_yaml(path)))
    except (TypeError, OverflowError, ExpatError, UnicodeError) as error:
        raise InputFileError(path, f"no parameter: {type(error).__name__}") from error
    known = {"fast": "f_talk", "frugal": "f_talk"}
    begun = [
        resume(journal, known, "f_talk", launched, failed, initial, 100.0, "roslaunch 7")
        for launched in ("", "fast")
        for failed in (False, True)
        for initial in ("", "frugal")
    ]
    begun_journals = [begin_journal([one], "roslaunch 7") for one in begun]
    noted = [one.noted(journal.configurations, 101.0, "fast", failures=journal.failures) for one in begun_journals]
    return dict(journal.failures), [told_by_master(one.as_parameter()) for one in (*begun_journals, *noted)]


def _move_base_settings(path: Path) -> object:
    tree = read_yaml(path)
    return read_parameters(tree if isinstance(tree, dict) else {})


def _campaign(path: Path) -> object:
    content = read_yaml(path)
    ground_files(content, str(path))
    known = Known(["r1", "r2", "r4"], ["f1_v2_r1", "f2_v2_r2"], ["none", "mros", "rules"], ["front_laser"], ["history"])
    return parse_campaign(content, known, str(path))


_CAMPAIGN = """seed: 1
timeout: 100.0
profiles: {fast: {history: 1}}
parts:
  a:
    routes: [r1, r4]
    initial_configurations: [f2_v2_r2]
    clutter: [0, 14]
    power: [1.0, 1.6]
    failures: {none: [], killed: ["kill:front_laser@time:2"]}
    managers: {none: 1, mros: 1, fast: 2}
"""


def _contingencies(path: Path) -> object:
    return read_contingencies(path)


_CONTINGENCIES = """contingencies:
- {at: {share: 0.6}, kill: front_laser}
- {at: {time: 20}, power: 1.6}
- {at: {place: [1.5, -2], within: 1.0}, light: 0.2}
- {clutter: [[1.0, 2.0], [3, 4]]}
- {clutter: 7}
"""
_MANIPULATOR = """configurations:
  a: {function: f, launch: package://metacontrol_sim/launch/variants/f2_v2_r2.launch, args: ["r:=1"], topics: [a]}
  b: {command: roslaunch metacontrol_sim f2_v2_r2.launch}
functions: {f: {kill_nodes: [detector]}}
repairs: {gripper: {launch: {package: metacontrol_sim, file: launch/variants/f2_v2_r2.launch}}}
save_action: move_base
goal_msg_type: move_base_msgs.msg.MoveBaseAction
reconfiguration_action_name: x
kill_nodes: [move_base]
concurrency: replace
"""
_MONITOR = """desired_rossystem: package://metacontrol_sim/models/d2.rossystem
variants: package://metacontrol_sim/models/variants
ros_models: [package://metacontrol_sim/models/observers.ros]
components:
  laser: {node: laser, topic: scan, max_age: 2.0, min_rate: 2.0}
  battery: {topic: battery_state, below: 0.2, above: 0.3}
  arm: {diagnostic: "arm: safety"}
topics: {odom: {max_age: 1.0, min_rate: 5, stuck_after: 3, type: nav_msgs/Odometry}}
observers: [SafetyQualityObserver]
ignore: [/rviz*]
rate: 2.0
startup_grace: 3
FreshnessObserver: {rate: 2}
"""
_REASONER = """model_file: package://metacontrol_sim/models/d2.owl
desired_configuration: ''
nfr_freshness: 0.2
nfr_power: [1.0, 5.0]
utility: {weights: {power: 1.0, freshness: 0.5}}
qa_direction: {freshness: lower_is_better}
components: {laser: {node: laser}}
task_actions: {o_talk: talk}
reasoning_rate: 2.0
asked: [[pause], [set_nfr, o_talkA, power, "3.0"], [lock, ""]]
history: 5
confidence: 0.9
always_improve: true
"""

# -- grounds -----------------------------------------------------------------------------------------------------------


def _image(extension: str, depth: type = np.uint8, channels: int = 1) -> bytes:
    rows = np.linspace(0, 255, 12 * 9 * channels).astype(depth).reshape(9, 12, channels)
    return bytes(cv2.imencode(extension, rows)[1])


def _map(path: Path) -> object:
    content = {"resolution": 0.1, "origin": [0, 0, 0], "occupied_thresh": 0.65, "free_thresh": 0.2, "mode": "scale"}
    return read_map({**content, "image": path.name}, path.parent / "map.yaml")


def _world(path: Path) -> object:
    (path.parent / "map.pgm").write_bytes(_image(".pgm"))
    ground = read_ground(path, None)
    return rasterise(read_world(path)), ground


_MAP_YAML = """image: map.pgm
resolution: 0.05
origin: [-1.0, 2.0, 0.0]
occupied_thresh: 0.65
free_thresh: 0.196
negate: 0
mode: trinary
"""

# -- results and bags --------------------------------------------------------------------------------------------------


def _parquet() -> list[bytes]:
    found = [result("none", 1), result("mros", 2, clutter=7), result("mros", 3, power=1.4)]
    with tempfile.TemporaryDirectory() as folder:
        path = write_table(Path(folder), [one.run for one in found], {one.run.name: one for one in found}, {"a": "b"})
        return [path.read_bytes()]


def _result(path: Path) -> object:
    """Read a result, and write the table of a campaign that has no other one."""
    found = from_json(read_text(path), str(path))
    return write_table(path.parent, [found.run], {found.run.name: found}, {"a": "b"})


def _table(path: Path) -> object:
    """Read a table, and write one of what it holds."""
    found = results_of(path)
    return write_table(path.parent, [one.run for one in found.values()], found, {"a": "b"})


def _summaries() -> list[bytes]:
    strikes = [{"name": "light:0.04", "recover_s": 0.5}, {"name": "obstacle:left", "recover_s": None}]
    told = {"success": True, "placed": 6, "duration_s": 70.0, "placed_error_mm": 1.2, "moved_mm": 0.0, "placed_lost": 0}
    told |= {
        "stands_still": True,
        "real_time_factor": 1.0,
        "outcome": "reached",
        "reason": "it stands",
        "commit": "abc",
    }
    return [json.dumps(told | {"strikes": strikes}).encode()]


def _summary(path: Path) -> object:
    """Read a summary of D1, and make the tables of a campaign of it."""
    summary = read_summary(read_text(path), str(path))
    return [made({PyramidRun(0, 1, "mros", "fd2"): summary}) for made in (report, rows, levels)]


def _trace() -> list[bytes]:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, variant="f1", route="r1", seed=1, clutter=0, reached=True, duration_s=3.0,
                        risk=np.zeros(3), acceleration=np.zeros((2, 3)), speed=np.zeros((2, 3)), forward=np.zeros(2),
                        rate=np.zeros(2), share=np.zeros(2))  # fmt: skip
    return [buffer.getvalue()]


@cache
def _bags() -> list[bytes]:
    bag = adapting_mission()
    bag.messages = bag.messages[:1] + [entry for entry in bag.messages[1:] if entry[1] != "/ground_truth/state"]
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number, (compression, size) in enumerate((("none", 1 << 20), ("none", 300), ("bz2", 1000), ("lz4", 1000))):
            found.append(bag.write(Path(folder) / f"{number}.bag", compression, size).read_bytes())
        from bad_input.journals import write_journal

        path = Path(folder) / "journal.bag"
        write_journal(path)
        found.append(path.read_bytes())
    return found


def _mission(path: Path) -> object:
    """Read a mission's bag, and tell its figures as JSON."""
    record = read_record(path)
    try:
        return json.dumps([summarise(record), describe_adaptation(record)], allow_nan=False)
    except MetricsError as error:
        raise BagError(f"{path}: {error}") from error


def _scanned(path: Path) -> object:
    with BagFile(path) as bag:
        bag.scan()
        return sum(1 for _ in bag.messages(lambda _: True))


# -- ontologies --------------------------------------------------------------------------------------------------------

_OWL = _files(
    "examples/talker_listener/models/talker_listener.owl",
    "tests/integration/mros1_reasoner/cells/cell.owl",
    "tests/integration/mros1_reasoner/data/grasp.owl",
)
_NTRIPLES = """<http://a/b#x> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://metacontrol.org/t#F> .
_:n <http://a/b#p> "va\\"lue\\n\\u00e9"^^<http://www.w3.org/2001/XMLSchema#string> .
<http://a/b#x> <http://a/b#q> "1.5"^^<http://www.w3.org/2001/XMLSchema#float> .
<http://a/b#x> <http://a/b#l> "text"@en .
"""
_TURTLE = """@prefix t: <http://metacontrol.org/tomasys#> .
<http://a/b> a <http://www.w3.org/2002/07/owl#Ontology> .
<http://a/b#f> a t:Function ; t:x 1.5 , "a" .
"""
_OWL_XML = """<?xml version="1.0"?>
<Ontology xmlns="http://www.w3.org/2002/07/owl#" ontologyIRI="http://a/b">
<Declaration><NamedIndividual IRI="#f"/></Declaration>
<ClassAssertion><Class IRI="http://metacontrol.org/tomasys#Function"/><NamedIndividual IRI="#f"/></ClassAssertion>
</Ontology>
"""


def _knowledge_base(path: Path) -> object:
    own, log = _own_ontologies(), logging.getLogger("mros1_reasoner")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        with patch.object(ontology_files, "read_triples", lambda file: own.get(file) or read_triples(file)):
            return read_knowledge_base([path])
    finally:
        log.setLevel(before)


@cache
def _own_ontologies() -> dict[Path, Any]:
    """Return the triples of the package's own ontologies, parsed once: they are the same each time."""
    return {file: read_triples(file) for file in ontology_files.own_ontologies()}


# -- the table ---------------------------------------------------------------------------------------------------------


def _last_start(path: Path) -> None:
    by, present = "/mixer of 7@100", {"/mixer/rate": '"x"', "/mixer/valves": "3"}
    kept = kept_of(read_text(path), by)
    missing(kept, present)
    found = remedy(kept, present, by)
    for value in filter(None, found.wanted.values()):
        json.loads(value)


def _resumed(path: Path) -> object:
    return decode_parameter(read_yaml(path), "move_base_msgs/MoveBaseActionGoal")


def _json(path: Path) -> Any:
    try:
        return json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputFileError(path, "is no JSON: correct it") from error


_MODEL = (ModelError,)
READERS: tuple[Reader, ...] = (
    Reader(
        "a system", ("ros_model/io/models.py", "ros_model/io/files.py"), "text", "bad.rossystem",
        _SYSTEMS, _MODEL, _checked_system, 2.0,
    ),
    Reader(
        "a package's model", ("ros_model/io/models.py",), "text", "bad.ros",
        _files("examples/talker_listener/models/talker_listener.ros", "examples/pick_cell/models/cell.ros",
               "examples/talker_listener/models/observers.ros"),
        _MODEL, read_packages, 1.5,
    ),
    Reader(
        "metacontrol.yaml", ("ros_model/io/project.py",), "yaml", "metacontrol.yaml",
        _files("examples/talker_listener/models/metacontrol.yaml"), _MODEL, _project, 0.3,
    ),
    Reader(
        "a table of variants", ("ros_model/io/project.py",), "csv", "bad.csv",
        _texts("name,talker,talker.rate\nfast,a,5\nfrugal,b,1.5\n", "name,x.y\nab,\"[1, 2]\"\n"),
        _MODEL, read_table, 2.0,
    ),
    Reader(
        "a table of variants in YAML", ("ros_model/io/project.py",), "yaml", "bad.yaml",
        _texts("fast: {talker: a, talker.rate: 5}\nfrugal: {talker: b}\n", "- {name: a, x: 1}\n- {name: b, x: [1]}\n"),
        _MODEL, read_table, 0.3,
    ),
    Reader(
        "expected levels", ("ros_model/io/project.py",), "csv", "qa.csv",
        _files("examples/talker_listener/models/qa.csv"), _MODEL, _project, 0.1,
    ),
    Reader(
        "parameters of dynamic_reconfigure", ("ros_model/io/dynamic_parameters.py",), "text", "bad.cfg",
        _texts(_CFG), _MODEL, _reconfigure, 2.0,
    ),
    Reader(
        "package.xml", ("ros_model_extraction/io/source_files.py", "ros_model_extraction/io/workspace.py"), "xml",
        "package.xml", _texts(_MANIFEST), _MODEL, _package, 0.2,
    ),
    Reader(
        "CMakeLists.txt", ("ros_model_extraction/io/source_files.py",), "text", "CMakeLists.txt",
        _texts(_CMAKE), _MODEL, _package, 0.06,
    ),
    Reader(
        "descriptions of nodelets", ("ros_model_extraction/io/source_files.py",), "xml", "nodelets.xml",
        _texts(_NODELETS), _MODEL, _package, 0.06,
    ),
    Reader(
        "a node in Python", ("ros_model_extraction/io/python_modules.py",), "text", "scripts/node",
        _texts(_PYTHON), _MODEL, _package, 0.08,
    ),
    Reader(
        "a node in C++", ("ros_model_extraction/io/cpp_files.py",), "text", "src/a.cpp",
        _texts(_CPP), _MODEL, _package, 0.06,
    ),
    Reader(
        "a message's definition", ("ros_model_extraction/io/source_files.py",), "text", "msg/A.msg",
        _texts(_MSG), _MODEL, _package, 0.06,
    ),
    Reader(
        "a launch file to extract",
        ("ros_model_extraction/io/launch_files.py", "ros_model/io/launch_files.py", "ros_model/io/launch_loader.py"),
        "xml", "bad.launch", _LAUNCHED, _MODEL, read_launch_file, 0.06,
    ),
    Reader(
        "a launch file to deploy", ("rosgraph_manipulator/io/launch_files.py",), "xml", "bad.launch",
        _LAUNCHED, (LaunchFileError,), read_deployed_file, 2.0,
    ),
    Reader(
        "a system to deploy", ("rosgraph_manipulator/io/launch_files.py",), "text", "bad.rossystem",
        _SYSTEMS, (LaunchFileError, ModelError), read_model, 0.5,
    ),
    Reader(
        "settings of the manipulator", ("rosgraph_manipulator/io/configuration_file.py",), "yaml", "bad.yaml",
        _texts(_MANIPULATOR), (ConfigurationError,), _manipulator_settings, 0.1, names_file=False,
    ),
    Reader(
        "a manipulator's journal", ("rosgraph_manipulator/change/journal.py",), "yaml", "bad.yaml",
        _kept_journal, (InputFileError,), _kept_by_manipulator, 0.2,
    ),
    Reader(
        "settings of the monitor", ("rosgraph_monitor/io/models.py",), "yaml", "bad.yaml",
        _texts(_MONITOR), (ParameterError, ModelError, InputFileError), _monitor_settings, 0.3, names_file=False,
    ),
    Reader(
        "settings of the reasoner", ("mros1_reasoner/io/parameters.py",), "yaml", "bad.yaml",
        _texts(_REASONER), (ParameterError, ModelError, InputFileError), _reasoner_settings, 0.08, names_file=False,
    ),
    Reader(
        "settings of move_base", (), "yaml", "bad.yaml",
        _files("catkin_ws/src/metacontrol_sim/config/move_base.yaml"), (ParameterError, InputFileError),
        _move_base_settings, 0.1, names_file=False,
    ),
    Reader(
        "a goal taken over", (), "yaml", "bad.yaml",
        _texts("type: move_base_msgs/MoveBaseActionGoal\ndata: AAAA\n"), (TakeoverError, InputFileError),
        _resumed, 0.2, names_file=False,
    ),
    Reader(
        "what a node began with", ("node_kit/last_start.py", "node_kit/ros/last_start.py"), "json", "bad.json",
        _texts(Kept("/mixer of 7@100", {"/mixer/rate": "10.0", "/mixer/valves": "[1, {}]"}, {"/mixer/rate": '"x"'},
                    ("/mixer/rate",)).to_text()),
        (InputFileError,), _last_start, 0.2,
    ),
    Reader(
        "a request of the page", ("metacontrol_dashboard/io/server.py",), "json", "bad.json",
        _texts('{"action": "set_limit", "objective": "o", "quality": "q", "value": 1.5}',
               '{"action": "suppose", "failed": ["a"], "limits": {"q": 2}}', '{"action": "lock"}'),
        (RequestError, InputFileError), lambda path: read_request(_json(path)), 2.0, names_file=False,
    ),
    Reader(
        "a campaign", ("metacontrol_experiments/io/ground_files.py",), "yaml", "bad.yaml",
        _texts(_CAMPAIGN), (CampaignError, InputFileError), _campaign, 0.3,
    ),
    Reader(
        "a campaign of pyramids", (), "yaml", "bad.yaml",
        _texts("mission: manipulation\nscenarios: [1, 2]\nseeds: 3\nmanagers: [mros, none]\n",
               "mission: manipulation\nscenarios: [0]\nseeds: 5\nmanagers: [none]\ninitial_configurations: [fd2]\n"),
        (CampaignError, InputFileError), lambda path: parse_pyramids(read_yaml(path), str(path)), 0.1,
    ),
    Reader(
        "routes", ("metacontrol_experiments/io/input_files.py",), "yaml", "bad.yaml",
        _files("catkin_ws/src/metacontrol_sim/worlds/routes.yaml"), (RouteError,),
        lambda path: (route_names(path), read_route(path, "r1")), 0.1,
    ),
    Reader(
        "contingencies", ("metacontrol_experiments/io/input_files.py",), "yaml", "bad.yaml",
        _texts(_CONTINGENCIES), (ContingencyError,), _contingencies, 0.09,
    ),
    Reader(
        "components", ("metacontrol_experiments/io/input_files.py",), "yaml", "bad.yaml",
        _files("examples/pick_cell/models/metacontrol.yaml"), (ComponentError,), read_components, 0.1,
    ),
    Reader(
        "published figures", ("metacontrol_experiments/io/report_files.py",), "yaml", "bad.yaml",
        _files("catkin_ws/src/metacontrol_experiments/config/published.yaml"), (PublishedError,), read_published, 0.01,
    ),
    Reader(
        "delays", ("metacontrol_experiments/io/tables.py",), "csv", "bad.csv",
        _files("catkin_ws/src/metacontrol_experiments/config/delays.csv"), (DelayError,), read_delays, 2.0,
    ),
    Reader(
        "runs of a calibration", ("metacontrol_experiments/io/tables.py",), "csv", "bad.csv",
        lambda: [_runs()], (CalibrationError,), read_runs, 2.0,
    ),
    Reader(
        "a result of a campaign", ("metacontrol_experiments/io/campaign_folder.py",), "json", "result.json",
        lambda: [to_json(result("mros", 2, clutter=7)).encode()], (CampaignError, InputFileError),
        _result, 2.0,
    ),
    Reader(
        "a summary of D1", ("metacontrol_experiments/pyramid/campaign.py",), "json", "summary.json",
        _summaries, (CampaignError, InputFileError), _summary, 2.0,
    ),
    Reader(
        "a table of results", ("metacontrol_experiments/io/campaign_folder.py",), "binary", "bad.parquet",
        _parquet, (CampaignError,), _table, 0.2,
    ),
    Reader(
        "a report's table", ("metacontrol_experiments/io/report_files.py",), "binary", "bad.parquet",
        _parquet, (ReportError,), read_report, 0.8,
    ),
    Reader(
        "a trace of the yardstick", ("metacontrol_experiments/io/yardstick_runs.py",), "binary", "bad.npz",
        _trace, (TraceError,), read_trace, 1.0,
    ),
    Reader(
        "a goal", (), "yaml", "bad.yaml",
        _files("tests/integration/reference/goal.yaml"), (GoalFileError,), read_goal, 0.6,
    ),
    Reader(
        "a world", ("pybullet_simulator/io/world_file.py", "metacontrol_experiments/io/ground_files.py"), "yaml",
        "bad.yaml", _files("catkin_ws/src/metacontrol_sim/worlds/factory.yaml"), (WorldError, RouteError), _world, 0.06,
    ),
    Reader(
        "a map", ("pybullet_simulator/io/map_file.py", "pybullet_simulator/io/world_file.py"), "yaml", "bad.yaml",
        _texts(_MAP_YAML), (WorldError, RouteError), _world, 0.7,
    ),
    Reader(
        "a map's image", ("pybullet_simulator/io/map_file.py",), "binary", "bad.pgm",
        lambda: [_image(".pgm"), _image(".png"), _image(".png", np.uint16), _image(".png", channels=4),
                 b"P2\n3 2\n255\n0 1 2\n3 4 5\n"],
        (MapError,), _map, 2.0,
    ),
    Reader(
        "a robot's URDF", ("pybullet_simulator/io/robot_file.py",), "xml", "bad.urdf",
        _files("catkin_ws/src/pybullet_simulator/urdf/ridgeback.urdf"), (RobotFileError,), planar_urdf, 2.0,
    ),
    Reader(
        "triples of an ontology", ("mros1_reasoner/io/ontology_files.py",), "xml", "bad.owl",
        lambda: [*_OWL(), *_texts(_NTRIPLES, _TURTLE, _OWL_XML)()], (KnowledgeBaseError,), read_triples, 0.05,
    ),
    Reader(
        "an ontology", ("mros1_reasoner/io/ontology_files.py",), "xml", "bad.owl",
        _OWL, (KnowledgeBaseError,), _knowledge_base, 0.02,
    ),
    Reader(
        "a bag", ("metacontrol_bags/bag_file.py",), "binary", "bad.bag", _bags, (BagError,), _scanned, 1.0,
    ),
    Reader(
        "a mission's bag", ("metacontrol_bags/bag_file.py",), "binary", "bad.bag",
        _bags, (BagError,), _mission, 0.01,
    ),
    Reader(
        "a reasoner's bag", ("mros1_reasoner/io/reasoner_bag.py",), "binary", "bad.bag",
        _bags, (RecordingError,), lambda path: (read_decisions(path), read_recording(path)), 0.02,
    ),
    Reader(
        "a run for the page", ("metacontrol_dashboard/io/bags.py",), "binary", "bad.bag",
        _bags, (BagError,), read_run, 0.01,
    ),
)  # fmt: skip


def _runs() -> bytes:
    from dataclasses import fields

    from metacontrol_experiments.campaign.calibration import Run

    names = [field.name for field in fields(Run)]
    values = {"str": "f1_v2_r1", "int": "3", "float": "0.5"}
    rows = [",".join(values[str(field.type)] for field in fields(Run))] * 3
    return "\n".join([",".join(names), *rows, ""]).encode()
