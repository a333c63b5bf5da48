"""Which differences are told, look after look: an arm whose gripper is a node in a namespace."""

import pytest
from ros_model.graph.snapshot import build_snapshot
from ros_model.language.metamodel import Component, Port, PortKind, Reference, RosParameter, RosSystem
from rosgraph_monitor.evaluation import GraphEvaluator, Patience
from rosgraph_monitor.graph.desired import Desired
from rosgraph_monitor.health.liveness import Life

STARTUP = 5.0


def gripper(**parameters):
    given = tuple(RosParameter(key, Reference("p", "a", "n", key), value) for key, value in parameters.items())
    return Component("gripper", namespace="arm", parameters=given)


def system(*components):
    return Desired(RosSystem("s", components=components))


SOFT, HARD = system(gripper(force=1)), system(gripper(force=9))


class Watched:
    """A monitor that looks at the graph again and again."""

    def __init__(self):
        self.evaluator = GraphEvaluator({}, patience=Patience(STARTUP, 1.0, 1.0))

    def told(self, now, desired, parameters, *nodes, address="http://a:1"):
        """Return what is told of a graph with the gripper and further nodes, as (name, message)."""
        uris = {"/arm/gripper": address, **dict.fromkeys(nodes, "http://b:1")}
        snapshot = build_snapshot([[["/rosout", list(uris)]], [], []], [], {"arm": {"gripper": parameters}}, uris)
        lives = dict.fromkeys(uris.items(), Life.ALIVE)
        statuses = self.evaluator.evaluate(snapshot, lives, desired, now)
        return [(s.name, s.message) for s in statuses if s.message not in ("Component status", "running OK")]


WRONG = [("arm/gripper", "Wrong param configuration")]


@pytest.fixture
def watched():
    return Watched()


def test_nothing_is_wrong_or_additional_before_the_active_configuration_is_known(watched):
    base, deployed = SOFT, system(gripper(force=9), Component("camera"))
    for now in (0.0, 0.5, 1.0):
        assert watched.told(now, base, {"force": 9}, "/camera") == []
    assert watched.told(1.5, deployed, {"force": 9}, "/camera") == []
    assert watched.told(20.0, deployed, {"force": 9}, "/camera", "/stray") == [("stray", "Additional node")]


def test_parameter_that_a_node_sets_late_is_not_wrong(watched):
    for now in (0.0, 1.0, 2.0):
        assert watched.told(now, SOFT, {}) == []
    assert watched.told(3.0, SOFT, {"force": 1}) == []


def test_parameter_that_was_right_is_wrong_at_once(watched):
    assert watched.told(0.0, SOFT, {"force": 1}) == []
    assert watched.told(0.1, SOFT, {"force": 2}) == WRONG
    assert watched.told(0.2, SOFT, {"force": 3}) == WRONG
    assert watched.told(0.3, SOFT, {"force": 1}) == []
    assert watched.told(0.4, SOFT, {}) == WRONG


def test_parameter_that_stays_wrong_is_told_in_the_end(watched):
    assert watched.told(0.0, SOFT, {"force": 2}) == []
    assert watched.told(STARTUP - 0.1, SOFT, {"force": 3}) == []
    assert watched.told(STARTUP, SOFT, {"force": 3}) == WRONG


def test_old_look_at_the_parameters_is_not_held_against_the_new_configuration(watched):
    changing = Desired(HARD.system, excused=frozenset({"arm/gripper"}))
    assert watched.told(0.0, SOFT, {"force": 1}) == []
    assert watched.told(50.0, changing, {"force": 1}) == []
    assert watched.told(50.1, HARD, {"force": 1}) == []
    assert watched.told(50.2, HARD, {"force": 9}) == []
    assert watched.told(50.3, HARD, {"force": 1}) == WRONG


@pytest.mark.parametrize("value", [[1, 2], {"low": 1}, "soft"])
def test_parameter_may_have_any_value(watched, value):
    desired = system(gripper(force=value))
    assert watched.told(0.0, desired, {"force": value}) == []
    assert watched.told(0.1, desired, {"force": 0}) == WRONG


def test_new_process_has_its_time_to_set_parameters(watched):
    assert watched.told(0.0, SOFT, {"force": 1}) == []
    assert watched.told(50.0, SOFT, {}, address="http://a:2") == []
    assert watched.told(51.0, SOFT, {"force": 1}, address="http://a:2") == []


def test_parameter_that_is_wrong_stays_wrong_when_another_function_changes(watched):
    assert watched.told(0.0, SOFT, {"force": 1}) == []
    assert watched.told(1.0, SOFT, {"force": 2}) == WRONG
    assert watched.told(1.1, system(*SOFT.system.components, Component("late")), {"force": 2}) == WRONG


SPOKEN = system(Component("gripper", namespace="arm", ports=(Port("state", PortKind.PUBLISHER),)))
PORTS = {"additional": ["state", "voice"], "missing": []}


def ports(watched, now, *topics, desired=SPOKEN, address="http://a:1"):
    """Return which messages on ports are told of a gripper that publishes these topics."""
    publishers = [[f"/arm/{topic}", ["/arm/gripper"]] for topic in topics]
    snapshot = build_snapshot([publishers, [], []], [], {}, {"/arm/gripper": address})
    lives = {("/arm/gripper", address): Life.ALIVE}
    statuses = watched.evaluator.evaluate(snapshot, lives, desired, now)
    return [status.message for status in statuses if "port" in status.message]


@pytest.mark.parametrize(("difference", "message"), [("additional", "Additional port"), ("missing", "Missing port")])
def test_port_that_comes_and_goes_is_told_twice_and_then_no_more(watched, difference, message):
    assert ports(watched, 0.0, "state") == []
    told = []
    for cycle in range(5):
        begin = STARTUP + 10.0 * cycle
        ports(watched, begin, *PORTS[difference])
        told += ports(watched, begin + 2.0, *PORTS[difference])
        assert ports(watched, begin + 4.0, "state") == []
    assert told == [message] * 2


def test_short_lived_port_is_told_no_more_though_no_life_was_long_enough_to_be_told(watched):
    for tick in range(4 * int(STARTUP)):
        ports(watched, 0.5 * tick, "state", *(["voice"] if tick % 2 else []))
    assert ports(watched, 100.0, "state", "voice") == []
    assert ports(watched, 102.0, "state", "voice") == []


def test_port_that_comes_late_and_then_goes_for_good_is_told(watched):
    ports(watched, 0.0)
    assert ports(watched, 2 * STARTUP) == ["Missing port"]
    assert ports(watched, 2 * STARTUP + 1.0, "state") == []
    ports(watched, 3 * STARTUP)
    assert ports(watched, 3 * STARTUP + 1.0) == ["Missing port"]
    assert ports(watched, 90 * STARTUP) == ["Missing port"]


def test_difference_that_lasts_over_a_reconfiguration_has_not_gone(watched):
    ports(watched, 0.0)
    changing = Desired(SPOKEN.system, excused=frozenset({"arm/gripper"}))
    for cycle in range(1, 6):
        assert ports(watched, 20.0 * cycle) == ["Missing port"]
        assert ports(watched, 20.0 * cycle + 5.0, desired=changing) == []


def test_new_process_begins_anew(watched):
    for tick in range(4 * int(STARTUP)):
        ports(watched, 0.5 * tick, *(["state"] if tick % 2 else []))
    assert ports(watched, 100.0) == []
    ports(watched, 101.0, address="http://a:2")
    assert ports(watched, 101.0 + STARTUP, address="http://a:2") == ["Missing port"]
