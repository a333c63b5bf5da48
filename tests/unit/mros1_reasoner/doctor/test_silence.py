"""Topics that come regularly and are not watched are named, with the line that has them watched; others are not."""

import pytest
from mros1_reasoner.doctor.facts import SystemFacts
from mros1_reasoner.doctor.silence import period_of, silence_complaints, unwatched_topics
from ros_model.graph.snapshot import build_snapshot
from ros_model.io.project import load_project

BASE = """RosSystem { Name boat RosComponents (
    ComponentInterface { name sonar FromRosNode 'boat.sonar.sonar'
        RosPublishers {
            RosPublisher depth { RefPublisher 'boat.sonar.sonar.depth' },
            RosPublisher chart { RefPublisher 'boat.sonar.sonar.chart' } } },
    ComponentInterface { name helm FromRosNode 'boat.helm.helm'
        RosSubscribers {
            RosSubscriber depth { RefSubscriber 'boat.helm.helm.depth' },
            RosSubscriber chart { RefSubscriber 'boat.helm.helm.chart' } }
        RosPublishers { RosPublisher rudder { RefPublisher 'boat.helm.helm.rudder' } } },
    ComponentInterface { name motor FromRosNode 'boat.motor.motor'
        RosSubscribers { RosSubscriber rudder { RefSubscriber 'boat.motor.motor.rudder' } } } )
    TopicConnections {
        TopicConnection depth { From ( 'sonar.depth' ) To ( 'helm.depth' ) },
        TopicConnection chart { From ( 'sonar.chart' ) To ( 'helm.chart' ) },
        TopicConnection rudder { From ( 'helm.rudder' ) To ( 'motor.rudder' ) } } }"""
SETTINGS = """
package: boat
base: boat.rossystem
variants: {component: helm, table: variants.csv, qa: qa.csv, parameters: {}}
functions: {f_steer: {designs: all}}
quality_attributes: {waste: {direction: lower_is_better}}
utility: waste
objectives: {o_steer: {function: f_steer}}
components: %s
observers: []
"""
EVERY_TENTH = tuple(10.0 + 0.1 * number for number in range(20))


@pytest.fixture
def project(tmp_path):
    def write(components="{echo: {node: sonar}}"):
        (tmp_path / "boat.rossystem").write_text(BASE)
        (tmp_path / "metacontrol.yaml").write_text(SETTINGS % components)
        (tmp_path / "variants.csv").write_text("name\nslow\nfast\n")
        (tmp_path / "qa.csv").write_text("name,waste\nslow,0.5\nfast,0.9\n")
        return load_project(tmp_path)

    return write


def running(home="", more=(), arrivals=None):
    sonar, helm, motor = f"{home}/sonar", f"{home}/helm", f"{home}/motor"
    topics = {"depth": (sonar, helm), "chart": (sonar, helm), "rudder": (helm, motor)}
    publishers = [[f"{home}/{topic}", [source]] for topic, (source, _) in topics.items()]
    subscribers = [[f"{home}/{topic}", [target]] for topic, (_, target) in topics.items()]
    for topic, source, target in more:
        publishers.append([topic, [source]])
        subscribers.append([topic, [target]])
    nodes = dict.fromkeys([sonar, helm, motor, "/rviz"], "http://boat:1/")
    snapshot = build_snapshot([publishers, subscribers, []], [], {}, nodes)
    return SystemFacts(snapshot, home or "/", arrivals=arrivals or {})


def notes(project, system):
    return [str(complaint) for complaint in silence_complaints(project, system)]


@pytest.mark.parametrize("home", ["", "/harbour/boat_2"])
def test_periodic_topic_is_named_with_the_line_that_has_it_watched(project, home):
    system = running(home, arrivals={f"{home}/depth": EVERY_TENTH, f"{home}/chart": (10.0,)})
    (note,) = notes(project(), system)
    assert note.startswith(f"note: {home}/depth: comes every 0.1 s")
    assert f"while {home}/sonar runs" in note
    assert note.endswith("echo: {node: sonar, topic: depth, max_age: 1.0}")


def test_proposed_line_has_the_topic_watched(project):
    watched = project("{echo: {node: sonar, topic: /depth, max_age: 1.0}}")
    assert notes(watched, running(arrivals={"/depth": EVERY_TENTH})) == []
    assert "/depth" not in unwatched_topics(watched, running())


def test_topic_of_what_varies_counts_if_each_variant_has_it(project):
    assert unwatched_topics(project(), running())["/rudder"] == "helm"
    slow_topic = tuple(10.0 + 0.5 * number for number in range(6))
    (note,) = notes(project(), running(arrivals={"/rudder": slow_topic}))
    assert note.endswith("helm: {node: helm, topic: rudder, max_age: 5.0}")
    unknown = running(more=[("/wake", "/helm", "/motor")])
    assert "/wake" not in unwatched_topics(project(), unknown)


def test_topics_that_only_tools_hear_and_those_of_actions_are_left_out(project):
    system = running(more=[("/picture", "/sonar", "/rviz"), ("/go/status", "/helm", "/motor")])
    assert unwatched_topics(project(), system).keys() == {"/depth", "/chart", "/rudder"}


@pytest.mark.parametrize(
    ("arrivals", "period"),
    [
        ((), None),
        ((1.0,), None),  # latched
        ((1.0, 1.1, 1.2, 1.3), None),  # too few
        ((1.0, 1.1, 1.2, 1.3, 1.4), 0.1),
        ((1.0, 1.1, 1.35, 1.4, 1.5), 0.125),  # uneven, as on a busy host
        ((1.0, 1.1, 1.2, 1.3, 2.9), None),  # a burst of events
        ((0.0, 0.0, 0.0, 0.0, 0.0), None),  # time stands still
    ],
)
def test_period_is_known_of_what_comes_regularly(arrivals, period):
    assert period_of(arrivals) == (None if period is None else pytest.approx(period))
