"""Evaluations of the monitor, one after the other."""

from ros_model.metamodel import Component, RosSystem
from ros_model.snapshot import GraphSnapshot, NodeState
from rosgraph_monitor.desired import Desired
from rosgraph_monitor.liveness import Life
from rosgraph_monitor.monitor import GraphMonitor

LASER = "/front_laser"
SYSTEM = RosSystem("base", components=(Component("front_laser"), Component("move_base")))
DESIRED = Desired(SYSTEM)


def graph(*nodes):
    return GraphSnapshot(nodes={name: NodeState(name, f"http://host{name}") for name in nodes})


def lives(**life):
    return {(f"/{name}", f"http://host/{name}"): known for name, known in life.items()}


def monitor(**settings):
    return GraphMonitor({"front_laser": "laser_resender"}, startup_grace=5.0, restart_patience=1.0, **settings)


def said(statuses):
    return {(s.name, s.message, s.values[0][1] if s.values else "") for s in statuses}


BOTH = graph(LASER, "/move_base")
ALIVE = lives(front_laser=Life.ALIVE, move_base=Life.ALIVE)


def test_graph_as_desired_runs_ok():
    assert said(monitor().evaluate(BOTH, ALIVE, DESIRED, 0.0)) == {
        ("laser_resender", "Component status", "TRUE"),
        ("move_base", "Component status", "TRUE"),
        ("ROS Graph", "running OK", ""),
    }


def test_dead_node_that_the_master_lists_is_missing_and_its_component_false():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    dead = ALIVE | lives(front_laser=Life.DEAD)
    assert said(watched.evaluate(BOTH, dead, DESIRED, 0.1)) == {
        ("laser_resender", "Component status", "FALSE"),
        ("move_base", "Component status", "TRUE"),
        ("front_laser", "Missing node", Life.DEAD.value),
    }


def test_start_up_raises_no_alarm_within_the_grace():
    watched = monitor()
    assert said(watched.evaluate(graph(), {}, DESIRED, 0.0)) == {("ROS Graph", "running OK", "")}
    late = said(watched.evaluate(graph(), {}, DESIRED, 5.0))
    assert ("front_laser", "Missing node", "not registered with the master") in late
    assert ("laser_resender", "Component status", "FALSE") in late


def test_node_of_a_variant_may_be_restarted_before_its_death_is_told():
    watched = monitor()
    desired = Desired(SYSTEM, variant_nodes=frozenset({"move_base"}))
    watched.evaluate(BOTH, ALIVE, desired, 0.0)
    dead = ALIVE | lives(move_base=Life.DEAD)
    assert ("ROS Graph", "running OK", "") in said(watched.evaluate(BOTH, dead, desired, 0.1))
    assert ("move_base", "Component status", "FALSE") in said(watched.evaluate(BOTH, dead, desired, 1.1))


def test_restarted_node_has_another_address_and_recovers_when_it_answers():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    watched.evaluate(BOTH, ALIVE | lives(front_laser=Life.DEAD), DESIRED, 0.1)
    again = GraphSnapshot(nodes=BOTH.nodes | {LASER: NodeState(LASER, "http://host/again")})
    waiting = said(watched.evaluate(again, ALIVE, DESIRED, 0.2))
    assert ("laser_resender", "Component status", "FALSE") in waiting
    back = ALIVE | {(LASER, "http://host/again"): Life.ALIVE}
    assert ("laser_resender", "Component status", "RECOVERED") in said(watched.evaluate(again, back, DESIRED, 0.3))
    assert ("laser_resender", "Component status", "TRUE") in said(watched.evaluate(again, back, DESIRED, 0.4))


def test_excused_nodes_raise_no_alarm():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    in_change = Desired(SYSTEM, frozenset({"move_base"}), excused=frozenset({"move_base"}))
    assert said(watched.evaluate(graph(LASER), ALIVE, in_change, 9.0)) == {
        ("laser_resender", "Component status", "TRUE"),
        ("ROS Graph", "running OK", ""),
    }


def test_problem_of_the_model_is_told_in_place_of_running_ok():
    (problem,) = monitor().evaluate(BOTH, {}, Desired(SYSTEM, problem="no model x"), 0.0)
    assert problem.message == "desired model: no model x"


def test_without_model_only_mapped_components_are_told():
    assert said(monitor().evaluate(BOTH, ALIVE, Desired(None), 0.0)) == {("laser_resender", "Component status", "TRUE")}
