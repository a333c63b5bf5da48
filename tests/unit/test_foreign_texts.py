"""Names and texts of others are told as they are: none of them is a format, or a template."""

from types import SimpleNamespace

import pytest
import rospy
from actionlib_msgs.msg import GoalID
from bad_input.journals import MODEL, PARAMETERS
from bad_input.unconnected import NAME, Publisher, unconnected
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from helpers.rosmodel_command import run  # noqa: F401
from metacontrol_bags.decision import Decision
from metacontrol_bags.decision_tables import render
from metacontrol_msgs.msg import (
    ChangeFunctionActionGoal,
    ChangeFunctionGoal,
    MvpReconfigurationActionGoal,
    MvpReconfigurationGoal,
)
from metacontrol_msgs.srv import (
    AddObjectiveRequest,
    FeasibleRequest,
    LoadObserverRequest,
    RemoveObjectiveRequest,
    SaveKnowledgeBaseRequest,
    SetNfrRequest,
)
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.parameters import Parameters
from mros1_reasoner.io.reasoners import make_reasoner
from mros1_reasoner.knowledge.model import Objective
from mros1_reasoner.loop.mape import Mape
from mros1_reasoner.loop.settings import Settings
from mros1_reasoner.ros.core_log import _RosLog
from mros1_reasoner.ros.log import Log
from mros1_reasoner.ros.reasoner import ReasonerNode
from node_kit.io.inbox import Inbox
from rich.console import Console
from ros_model.graph.snapshot import GraphSnapshot, NodeState
from ros_model.language.metamodel import RosSystem
from rosgraph_manipulator.change.deployment import Outcome, Result
from rosgraph_manipulator.change.request_queue import Policy
from rosgraph_manipulator.configuration.configurations import ConfigurationError
from rosgraph_manipulator.io.configuration_file import options_from
from rosgraph_manipulator.ros.requests import RequestServer
from rosgraph_monitor.diagnostics.aggregator_names import unique_name
from rosgraph_monitor.diagnostics.overview import Overview
from rosgraph_monitor.graph.comparison import compare
from rosgraph_monitor.graph.findings import finding_statuses
from rosgraph_monitor.ros.diagnostics import DiagnosticsTopic
from rosgraph_monitor.ros.driver_status import DriverStatusListener
from rosgraph_monitor.ros.observers import ObserverHost

pytestmark = pytest.mark.parametrize(
    "mark", ["{}", "{0.__class__}", "{mark!r:>9}", "%s", "%n", "%(name)s", "100%", "$name", "${name}", "$(name)"]
)


@pytest.fixture
def ros(monkeypatch, tmp_path):
    """A ROS without a master that keeps all lines of logs, and all messages."""
    parameters = {**PARAMETERS, "model_file": str(MODEL), "save_folder": str(tmp_path)}
    with unconnected({NAME: parameters}) as ros:
        ros.published = []
        for name in ("loginfo", "logdebug"):
            monkeypatch.setattr(rospy, name, ros.say)
        send = Publisher.publish

        def publish(publisher, *arguments, **named):
            ros.published.append(str(arguments))
            send(publisher, *arguments, **named)

        monkeypatch.setattr(Publisher, "publish", publish)
        yield ros


def status(message, *values, level=0, name="driver"):
    return DiagnosticStatus(level, name, message, "", [KeyValue(*pair) for pair in values])


def give(ros, topic, message):
    message._connection_header = {"callerid": "/other"}
    for subscriber in ros.listening(topic):
        subscriber.give(message)


def call(ros, name, request):
    """What a service answers."""
    (service,) = ros.listening(name)
    return service.handler(request)


# -- the reasoner ------------------------------------------------------------------------------------------------------


@pytest.fixture
def reasoner(ros):
    parameters = Parameters(ros.parameters[NAME])
    knowledge = parameters.knowledge_base()
    engine = make_reasoner("rules")
    engine.load(knowledge.ontology)
    return ReasonerNode(parameters, knowledge, parameters.objectives(knowledge), engine)


def test_reasoner_quotes_what_operators_ask_for(mark, ros, reasoner):
    for name, request in (
        ("set_nfr", SetNfrRequest("", mark, 1.0)),
        ("add_objective", AddObjectiveRequest("o_new", mark, [])),
        ("add_objective", AddObjectiveRequest(mark, "f_talk", [])),
        ("remove_objective", RemoveObjectiveRequest(mark)),
        ("feasible", FeasibleRequest(mark)),
        ("save_knowledge_base", SaveKnowledgeBaseRequest(f"../{mark}")),
    ):
        assert mark in call(ros, f"{NAME}/{name}", request).message, name


def test_reasoner_quotes_what_diagnostics_name(mark, ros, reasoner):
    array = DiagnosticArray(status=[status("QA status", (mark, "0.1")), status("QA status", ("power", mark))])
    array.header.stamp = rospy.Time.now()
    give(ros, "/diagnostics", array)
    reasoner._inbox.drain()
    assert f"Unsupported QA TYPE received: {mark}" in " ".join(ros.said)
    assert len([line for line in ros.said if mark in line]) == 2


def test_reasoner_quotes_names_of_its_model_in_decisions_and_logs(mark, ros, tmp_path):
    path = tmp_path / "model.owl"
    path.write_text(MODEL.read_text().replace("#fast", f"#fast_{mark}").replace("#frugal", f"#frugal_{mark}"))
    knowledge = read_knowledge_base([path])
    engine = make_reasoner("rules")
    engine.load(knowledge.ontology)
    objective = Objective(f"o_{mark}", "f_talk", {"freshness": 0.2})
    core = Mape(knowledge, engine, [objective], Settings(correct_expected=False))
    core.observe_active(0.0, "f_talk", f"frugal_{mark}", "STABLE")
    decision = next(filter(None, (_decided(core, tick / 10) for tick in range(60))))
    assert f"frugal_{mark} -> fast_{mark}" in decision.explanation
    Log().tell_decision(decision)
    _RosLog().emit(SimpleNamespace(levelno=20, getMessage=lambda: decision.explanation))
    assert all(line.startswith("[RosReasoner] -- ") and f"fast_{mark}" in line for line in ros.said)
    assert len(ros.said) == 2
    console = Console(width=300)
    with console.capture() as shown:
        console.print(render(decision))
    assert f"fast_{mark}" in shown.get() and "<class" not in shown.get()


def _decided(core: Mape, now: float) -> Decision | None:
    core.observe_level(now, "freshness", 5.0, stamp=now)
    return next(iter(core.step(now)), None)


# -- the monitor -------------------------------------------------------------------------------------------------------


def test_monitor_quotes_names_of_nodes_components_and_drivers(mark, ros):
    running = GraphSnapshot(nodes={f"/{mark}": NodeState(f"/{mark}", "http://a:1")})
    (found,) = finding_statuses(compare(running, RosSystem("s"), dead={}))
    assert (found.name, found.message) == (mark, "Additional node")
    driver = DriverStatusListener({mark: "driver"}, lambda: None)
    give(ros, "/diagnostics", DiagnosticArray(status=[status(mark, level=2)]))
    assert mark in driver.reasons[mark]
    given = status("Component status", (mark, "FALSE"), ("reason", driver.reasons[mark]), level=2)
    assert unique_name(given) == f"Component {mark}"
    overview = Overview()
    overview.take([given, status(mark, (mark, mark), level=2, name=mark)], 0.0)
    console = Console(width=300)
    with console.capture() as shown:
        console.print(overview.render([f"/{mark}"], {}, 0.0))
    assert shown.get().count(mark) == 6 + driver.reasons[mark].count(mark) - 1


def test_monitor_quotes_the_observer_that_it_does_not_know(mark, ros):
    ObserverHost(DiagnosticsTopic())
    call(ros, "/load_observer", LoadObserverRequest(mark))
    assert mark in " ".join(ros.said)


# -- the manipulator ---------------------------------------------------------------------------------------------------


@pytest.fixture
def options(mark, tmp_path):
    """A configuration and a component with such a name, whose launch files are not there, and a good configuration."""
    path = tmp_path / "plain.launch"
    path.write_text("<launch/>")
    missing = f"{tmp_path}/{mark}.launch"
    configurations = {"plain": {"launch": str(path)}, mark: {"launch": missing}}
    return options_from({"configurations": configurations, "repairs": {mark: {"launch": {"file": missing}}}})


def test_manipulator_quotes_names_of_its_configurations(mark, options):
    assert f"/{mark}.launch: correct the name" in options.configurations[mark].problem
    (driver,) = options.drivers.values()
    assert driver.name == f"repair_of_{mark}" and driver.problem.startswith(f"repairs/{mark}/launch: ")
    with pytest.raises(ConfigurationError) as refused:
        options.one_per_function(f"other {mark}", "~initial_configuration")
    known = ", ".join(sorted(["plain", mark]))
    assert str(refused.value) == f"parameter '~initial_configuration' is 'other {mark}'; known are: {known}"


def test_manipulator_quotes_what_it_is_asked_for(mark, ros, options):
    inbox = Inbox()
    server = RequestServer(options, Policy.WAIT, inbox, lambda _: Outcome(Result.OK, None, ""), lambda _: None)
    server.start()
    wishes = {
        f"/{options.reconfiguration_action_name}": MvpReconfigurationActionGoal(
            goal_id=GoalID(rospy.Time(1), "1"), goal=MvpReconfigurationGoal(f"not {mark}")
        ),
        "/rosgraph_manipulator/change_function": ChangeFunctionActionGoal(
            goal_id=GoalID(rospy.Time(1), "2"), goal=ChangeFunctionGoal(f"no {mark}", f"not {mark}", [])
        ),
    }
    for action, wish in wishes.items():
        give(ros, f"{action}/goal", wish)
    for name in ("not", "no"):
        assert any(f"{name} {mark}" in line for line in ros.said), ros.said
        assert any(f"{name} {mark}" in message for message in ros.published), ros.published


# -- models ------------------------------------------------------------------------------------------------------------


def test_models_are_quoted_by_the_commands(mark, run, tmp_path):  # noqa: F811
    path = tmp_path / "m.rossystem"
    wiring = f"TopicConnection t {{ From ( '{mark}.b' ) To ( 'c.d' ) }}"
    path.write_text(f"RosSystem {{ Name bad TopicConnections {{ {wiring} }} }}\n")
    status, out, _ = run("check", path)
    assert status == 1
    assert mark in out and "<class" not in out
