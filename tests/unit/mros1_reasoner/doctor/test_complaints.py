"""What a newcomer gets wrong before the first start is told with where and remedy; a system that fits tells nothing."""

from dataclasses import replace

import pytest
from mros1_reasoner.doctor.complaints import package_complaints, system_complaints
from mros1_reasoner.doctor.facts import Launched, ObserverFacts, PackageFacts, SystemFacts
from ros_model.graph.snapshot import build_snapshot
from ros_model.io.project import load_project
from rosgraph_monitor.graph.comparison import Scope

BASE = """RosSystem { Name barn RosComponents (
    ComponentInterface { name gate FromRosNode 'barn.gate.gate'
        RosPublishers { RosPublisher position { RefPublisher 'barn.gate.gate.position' } }
        RosParameters { RosParameter speed { RefParameter 'barn.gate.gate.speed' value 0.5 } } },
    ComponentInterface { name feeder FromRosNode 'barn.feeder.feeder'
        RosSubscribers { RosSubscriber position { RefSubscriber 'barn.feeder.feeder.position' } }
        RosPublishers { RosPublisher portion { RefPublisher 'barn.feeder.feeder.portion' } } } )
    TopicConnections { TopicConnection position { From ( 'gate.position' ) To ( 'feeder.position' ) } } }"""
SETTINGS = """
package: barn
base: barn.rossystem
variants: {component: feeder, table: variants.csv, qa: qa.csv, parameters: {}}
functions: {f_feed: {designs: all}}
quality_attributes: {waste: {direction: lower_is_better}}
utility: waste
objectives: {o_feed: {function: f_feed}}
components: {gate: {node: gate, topic: position}}
observers: []
"""
FOUND = PackageFacts("/ws/barn", "/ws/barn")
WATCHING = ObserverFacts("WasteObserver", "", (("waste", "std_msgs/Float32"),))


@pytest.fixture
def project(tmp_path):
    def write(more=""):
        (tmp_path / "barn.rossystem").write_text(BASE)
        (tmp_path / "metacontrol.yaml").write_text(SETTINGS + more)
        (tmp_path / "variants.csv").write_text("name\nslow\n")
        (tmp_path / "qa.csv").write_text("name,waste\nslow,0.5\n")
        return load_project(tmp_path)

    return write


def snapshot(home="", parameters=None, without=(), topics=(), types=(), services=()):
    gate, feeder, position = f"{home}/gate", f"{home}/feeder", f"{home}/position"
    publishers = [[position, [gate]], [f"{home}/portion", [feeder]], *([name, [node]] for name, node in topics)]
    subscribers = [[position, [feeder]]]
    kept = [[[n, [o for o in nodes if o not in without]] for n, nodes in part] for part in (publishers, subscribers)]
    state = [*([e for e in part if e[1]] for part in kept), list(services)]
    nodes = {node for part in state for _, owners in part for node in owners}
    values = {"gate": {"speed": 0.5}} if parameters is None else parameters
    tree = {home.strip("/"): values} if home else values
    return build_snapshot(state, [(position, "std_msgs/Bool"), *types], tree, dict.fromkeys(nodes, "http://barn:1/"))


def told(project, system, package=FOUND):
    return [str(complaint) for complaint in system_complaints(project, package, system, Scope())]


@pytest.mark.parametrize("home", ["", "/stable_3"])
def test_system_that_fits_tells_nothing(project, home):
    assert told(project(), SystemFacts(snapshot(home), home or "/")) == []
    assert package_complaints(project(), FOUND) == []


def test_node_of_a_variant_need_not_run(project):
    assert told(project(), SystemFacts(snapshot(without=["/feeder"]))) == []


def test_robot_in_another_namespace_is_one_complaint_with_that_namespace(project):
    lines = told(project(), SystemFacts(snapshot("/stable_3")))
    assert lines[0] == (
        "namespace /: no node of the models runs there, and /stable_3/feeder, /stable_3/gate run: "
        "export ROS_NAMESPACE=/stable_3 before this command and roslaunch"
    )
    assert not any(line.startswith(("/gate", "/stable_3")) for line in lines)


def test_node_of_the_base_that_does_not_run(project):
    lines = told(project(), SystemFacts(snapshot(without=["/gate"])))
    assert lines[0].startswith("/gate: the base has it, and it does not run")
    assert "components/gate: nobody publishes its topic position: start its node, or correct the topic" in lines


def test_node_that_no_model_has(project):
    (line,) = told(project(), SystemFacts(snapshot(topics=[("/moo", "/cow")])))
    assert line == "/cow: runs, and no model has it: add it to the base, or end it"


def test_parameter_that_differs(project):
    (line,) = told(project(), SystemFacts(snapshot(parameters={"gate": {"speed": 2.0}})))
    assert line.startswith("/gate/speed: is 2.0, and the base says 0.5: ")


def test_dead_node_on_the_master_is_cleaned(project):
    lines = told(project(), SystemFacts(snapshot(topics=[("/moo", "/cow")]), dead=frozenset(["/cow"])))
    assert lines == ["/cow: the master lists it, and nobody listens at its address: rosnode cleanup"]


def test_silent_and_unreachable_nodes(project):
    system = SystemFacts(snapshot(), silent=frozenset(["/gate"]), lost={"/feeder": "barn-pc"}, address="ROS_IP is odd")
    lines = told(project(), system)
    assert lines[0].startswith("network: ROS_IP is odd: ")
    assert lines[1].startswith("host barn-pc: the name does not resolve here, and /feeder runs there: ")
    assert lines[2].startswith("/gate: does not answer")


@pytest.mark.parametrize(
    ("simulated", "topics", "begin"),
    [
        (True, [], "/use_sim_time: is true, and nobody publishes /clock"),
        (False, [("/clock", "/gate")], "/use_sim_time: is not true, and /gate publishes /clock"),
        (True, [("/clock", "/gate")], None),
        (False, [], None),
    ],
)
def test_clock_fits_use_sim_time(project, simulated, topics, begin):
    parameters = {"gate": {"speed": 0.5}, "use_sim_time": simulated}
    lines = told(project(), SystemFacts(snapshot(parameters=parameters, topics=topics)))
    assert [line.startswith(begin) for line in lines if "use_sim_time" in line] == ([True] if begin else [])


def test_meta_controller_that_still_runs_in_this_namespace(project):
    topics = [("/diagnostics", "/rosgraph_monitor")]
    (line,) = told(project(), SystemFacts(snapshot(topics=topics)))
    assert line.startswith("/rosgraph_monitor: a node of the meta-controller runs already: rosnode kill")
    elsewhere = snapshot(topics=[("/diagnostics", "/other/rosgraph_monitor")])
    assert told(project(), SystemFacts(elsewhere)) == []


@pytest.mark.parametrize(
    ("launched", "begin"),
    [
        (
            Launched("barn.launch", respawn=True),
            "/feeder: variants bring this node, and roslaunch starts its own again",
        ),
        (Launched("barn.launch", required=True), "/feeder: variants bring this node, and roslaunch ends all others"),
        (Launched("barn.launch"), "note: /feeder: "),
    ],
)
def test_node_of_a_variant_that_the_users_launch_file_starts(project, launched, begin):
    (line,) = told(project(), SystemFacts(snapshot(), launched={"/feeder": launched}))
    assert line.startswith(begin)
    assert "in barn.launch" in line


def test_arguments_of_a_node_that_variants_would_bring_without_them(project):
    system = SystemFacts(snapshot(), launched={"/feeder": Launched("barn.launch", arguments="--hay 3")})
    line = told(project(), system)[0]
    assert line.startswith("/feeder: runs with the arguments '--hay 3', and variants bring it without any: ")
    assert "arguments: {feeder: '--hay 3'}" in line
    (note,) = told(project("arguments: {feeder: --hay 3}\n"), system)
    assert note.startswith("note: ")


def test_action_whose_goal_is_kept_is_offered_by_nobody(project):
    more = "manipulator: {save_action: feed, goal_msg_type: barn_msgs.msg.FeedAction}\n"
    (line,) = told(project(more), SystemFacts(snapshot()))
    assert line.startswith("save_action feed of f_feed: no node offers it, and no model has its server")


def test_action_whose_goal_is_kept_has_another_type(project):
    more = "manipulator: {save_action: feed, goal_msg_type: barn_msgs.msg.FeedAction}\n"
    ends = [(f"/feed/{end}", "/feeder") for end in ("status", "feedback", "result")]
    fitting = snapshot(topics=ends, types=[("/feed/goal", "hay_msgs/HayActionGoal")])
    action = replace(fitting, actions={"/feed": _action("/feed", "hay_msgs/HayAction", "/feeder")})
    lines = told(project(more), SystemFacts(action))
    assert any(
        line.endswith("is of type hay_msgs/HayAction: set goal_msg_type: hay_msgs.msg.HayAction") for line in lines
    )


def _action(name, kind, server):
    from ros_model.graph.snapshot import ActionState

    return ActionState(name, kind, (server,))


@pytest.mark.parametrize("home", ["", "/stable_3"])
def test_observer_hears_nothing_or_another_type(project, home):
    package = replace(FOUND, observers=(WATCHING,))
    silent = SystemFacts(snapshot(home, types=[(f"{home}/portion", "std_msgs/Float32")]), home or "/")
    assert told(project(), silent, package) == [
        f"observer WasteObserver: nobody publishes {home}/waste: "
        "start its publisher, or correct the name: portion has its type"
    ]
    other = snapshot(home, topics=[(f"{home}/waste", f"{home}/gate")], types=[(f"{home}/waste", "std_msgs/Int8")])
    lines = told(project(), SystemFacts(other, home or "/"), package)
    assert lines[-1].startswith(f"observer WasteObserver: {home}/waste is of type std_msgs/Int8, not std_msgs/Float32")


def test_topic_that_a_variant_or_an_observer_publishes_need_not_be_there(project):
    outputs = ObserverFacts("Weigher", outputs=("waste",))
    of_variant = ObserverFacts("PortionObserver", "", (("portion", "std_msgs/Float32"),))
    package = replace(FOUND, observers=(WATCHING, outputs, of_variant))
    assert told(project(), SystemFacts(snapshot(without=["/feeder"])), package) == []


def test_what_is_watched_and_repaired_is_there(project):
    more = "topics: {weather: {max_age: 2.0}}\n"
    (line,) = told(project(more), SystemFacts(snapshot()))
    assert line.startswith("topics/weather: nobody publishes it")


@pytest.mark.parametrize(
    ("change", "begin"),
    [
        ({"folder": None}, "package barn: rospack does not find it: source the workspace"),
        ({"folder": "/old/barn"}, "package barn: rospack finds it in /old/barn, and the models are in /ws/barn"),
        ({"missing": ("models/barn.owl",)}, "models/barn.owl: is not generated yet: rosmodel generate all"),
        (
            {"outdated": ("a", "b")},
            "a, b: are older than the models: rosmodel generate all /ws/barn/models -o /ws/barn",
        ),
        ({"java": "no Java runtime found"}, "reasoner: no Java runtime found"),
        ({"other_clone": "/old/monitor"}, "ROS_PACKAGE_PATH: rospack finds rosgraph_monitor in /old/monitor, which"),
        ({"missing_types": {"a.msg.B": "can't be imported"}}, "goal_msg_type a.msg.B: can't be imported"),
        ({"observers": (ObserverFacts("X", "no package exports it"),)}, "observer X: no package exports it: export it"),
    ],
)
def test_package_that_is_not_ready(project, change, begin):
    (line,) = package_complaints(project(), replace(FOUND, **change))
    assert str(line).startswith(begin)


def test_launch_file_that_begins_with_a_variant_of_before_is_told(project):
    facts = replace(FOUND, initial=(("launch/barn.launch", "snapshot_default"), ("launch/other.launch", "slow")))
    (complaint,) = package_complaints(project(), facts)
    assert str(complaint).startswith("note: launch/barn.launch: initial_configuration names snapshot_default, which")
    assert str(complaint).endswith("name one of slow, there or at each launch")
