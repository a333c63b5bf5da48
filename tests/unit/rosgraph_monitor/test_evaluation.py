"""Evaluations of the monitor, one after the other."""

import pytest
from ros_model.graph.snapshot import GraphSnapshot, NodeState, build_snapshot
from ros_model.language.metamodel import Component, Port, PortKind, Reference, RosParameter, RosSystem
from rosgraph_monitor.evaluation import GraphEvaluator, Patience
from rosgraph_monitor.graph.desired import Desired
from rosgraph_monitor.health.components import NodeCondition
from rosgraph_monitor.health.liveness import Life
from rosgraph_monitor.health.topics import TopicSpec, TopicVerdict

LASER = "/front_laser"
SYSTEM = RosSystem("base", components=(Component("front_laser"), Component("move_base")))
DESIRED = Desired(SYSTEM)


def graph(*nodes):
    return GraphSnapshot(nodes={name: NodeState(name, f"http://host{name}") for name in nodes})


def lives(**life):
    return {(f"/{name}", f"http://host/{name}"): known for name, known in life.items()}


def monitor(**settings):
    return GraphEvaluator({"front_laser": "laser_resender"}, patience=Patience(5.0, 1.0, 1.0), **settings)


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


@pytest.mark.parametrize(("head_start", "grace"), [(0.0, 5.0), (1.0, 4.0), (600.0, 3.0)])
def test_monitor_that_takes_anothers_place_waits_less_for_nodes_that_were_up_before(head_start, grace):
    dead = ALIVE | lives(front_laser=Life.DEAD)
    watched = monitor()
    assert Patience(5.0).grace(head_start) == grace
    early = [watched.evaluate(BOTH, dead, DESIRED, now, grace=grace) for now in (10.0, 10.0 + grace - 0.1)]
    assert all(("ROS Graph", "running OK", "") in said(statuses) for statuses in early)
    late = said(watched.evaluate(BOTH, dead, DESIRED, 10.0 + grace, grace=grace))
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
    assert ("front_laser", "Missing node", Life.DEAD.value) in waiting
    back = ALIVE | {(LASER, "http://host/again"): Life.ALIVE}
    assert ("laser_resender", "Component status", "RECOVERED") in said(watched.evaluate(again, back, DESIRED, 0.3))
    assert ("laser_resender", "Component status", "TRUE") in said(watched.evaluate(again, back, DESIRED, 9.0))


@pytest.mark.parametrize(
    ("before", "reason"),
    [
        (ALIVE | lives(front_laser=Life.DEAD), Life.DEAD.value),
        (ALIVE | lives(front_laser=Life.HUNG), Life.HUNG.value),
        (None, "ended: it has unregistered from the master"),
    ],
)
def test_node_that_dies_again_before_it_answers_is_missing_all_the_time(before, reason):
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    gone = (BOTH, before) if before else (graph("/move_base"), ALIVE)
    told = [watched.evaluate(*gone, DESIRED, 0.1)]
    again = GraphSnapshot(nodes=BOTH.nodes | {LASER: NodeState(LASER, "http://host/again")})
    told += [watched.evaluate(again, ALIVE, DESIRED, now) for now in (0.2, 0.3)]
    assert all(("front_laser", "Missing node", reason) in said(statuses) for statuses in told)
    dead = ALIVE | {(LASER, "http://host/again"): Life.DEAD}
    assert ("front_laser", "Missing node", Life.DEAD.value) in said(watched.evaluate(again, dead, DESIRED, 0.4))
    hears = ALIVE | {(LASER, "http://host/again"): Life.ALIVE}
    assert ("ROS Graph", "running OK", "") in said(watched.evaluate(again, hears, DESIRED, 0.5))


def test_node_that_was_never_missing_works_until_it_is_known_not_to():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    again = GraphSnapshot(nodes=BOTH.nodes | {LASER: NodeState(LASER, "http://host/again")})
    assert ("ROS Graph", "running OK", "") in said(watched.evaluate(again, ALIVE, DESIRED, 0.1))


def test_excused_nodes_raise_no_alarm():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    in_change = Desired(SYSTEM, frozenset({"move_base"}), excused=frozenset({"move_base"}))
    assert said(watched.evaluate(graph(LASER), ALIVE, in_change, 9.0)) == {
        ("laser_resender", "Component status", "TRUE"),
        ("ROS Graph", "running OK", ""),
    }


def test_nodes_of_idle_functions_may_run_or_not_and_are_not_judged():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    released = Desired(
        RosSystem("rest", components=(Component("move_base"),)),
        idle=(Component("front_laser", ports=(Port("front/scan", PortKind.PUBLISHER),)),),
        idle_topics=frozenset({"rear/scan"}),
    )
    fine = {("move_base", "Component status", "TRUE"), ("ROS Graph", "running OK", "")}
    assert said(watched.evaluate(BOTH, ALIVE, released, 1.0)) == fine
    assert said(watched.evaluate(graph("/move_base"), ALIVE, released, 30.0)) == fine
    assert watched.excused_topics(graph("/move_base"), released, ["front/scan", "rear/scan", "odom"]) == {
        "front/scan",
        "rear/scan",
    }
    published = build_snapshot([[["/rear/scan", ["/move_base"]]], [], []], [], {}, {"/move_base": "http://h"})
    assert watched.excused_topics(published, released, ["rear/scan"]) == frozenset()


def test_wrong_parameters_are_told_with_the_configurations_that_set_them():
    parameter = RosParameter("speed", Reference("p", "a", "n", "speed"), 1.0)
    system = RosSystem("s", components=(Component("belt", parameters=(parameter,)), Component("move_base")))
    desired = Desired(system, deployed=(("run_slowly", system), ("rest", RosSystem("rest"))))
    watched = GraphEvaluator({})
    for speed in (1.0, 2.0):
        nodes = {"/belt": NodeState("/belt", "http://host/belt")}
        live = GraphSnapshot(nodes=nodes, parameters={"belt": {"speed": speed}})
        statuses = watched.evaluate(live, lives(belt=Life.ALIVE), desired, speed)
    (wrong,) = (status for status in statuses if status.message == "Wrong param configuration")
    assert wrong.values == (("speed", "2.0"), ("expected/speed", "1.0"), ("in configuration", "run_slowly"))


def test_problem_of_the_model_is_told_in_place_of_running_ok():
    (problem,) = monitor().evaluate(BOTH, {}, Desired(SYSTEM, problem="no model x"), 0.0)
    assert problem.message == "desired model: no model x"


def test_without_model_only_mapped_components_are_told():
    assert said(monitor().evaluate(BOTH, ALIVE, Desired(None), 0.0)) == {("laser_resender", "Component status", "TRUE")}


def test_node_that_ends_cleanly_has_its_own_words_and_one_that_died_keeps_its():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    ended = watched.evaluate(graph("/move_base"), ALIVE, DESIRED, 0.1)
    assert ("front_laser", "Missing node", "ended: it has unregistered from the master") in said(ended)
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.2)
    watched.evaluate(BOTH, ALIVE | lives(front_laser=Life.DEAD), DESIRED, 0.3)
    cleaned_up = watched.evaluate(graph("/move_base"), ALIVE, DESIRED, 0.4)
    assert ("front_laser", "Missing node", Life.DEAD.value) in said(cleaned_up)


def test_node_that_ends_while_the_master_is_slow_has_ended_once_the_master_says_so():
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    gone = watched.evaluate(BOTH, ALIVE | lives(front_laser=Life.DEAD), DESIRED, 0.1, is_fresh=False)
    assert ("front_laser", "Missing node", Life.DEAD.value) in said(gone)
    ended = watched.evaluate(graph("/move_base"), ALIVE, DESIRED, 0.2)
    assert ("front_laser", "Missing node", "ended: it has unregistered from the master") in said(ended)


def test_what_changes_between_looks_is_found_though_the_graph_is_the_same():
    watched = monitor()
    for now, known in ((0.0, Life.ALIVE), (0.1, Life.DEAD), (0.2, Life.ALIVE)):
        told = {message for _, message, _ in said(watched.evaluate(BOTH, ALIVE | lives(move_base=known), DESIRED, now))}
        assert ("Missing node" in told) is (known is Life.DEAD)
    other = Desired(RosSystem("other", components=(*SYSTEM.components, Component("camera"))))
    watched.evaluate(BOTH, ALIVE, other, 0.3)
    assert ("camera", "Missing node", "not registered with the master") in said(
        watched.evaluate(BOTH, ALIVE, other, 9.0)
    )


def test_each_way_to_go_has_its_own_words():
    assert len({Life.DEAD.value, Life.HUNG.value, Life.UNREACHABLE.value, "ended", "not registered"}) == 5


LISTENER = RosSystem(
    "s",
    components=(Component("move_base", ports=(Port("scan", PortKind.SUBSCRIBER), Port("map", PortKind.SUBSCRIBER))),),
)


def test_difference_in_interfaces_must_last_and_nodes_may_start():
    watched = GraphEvaluator({}, patience=Patience(5.0, 1.0, 1.0))
    live = build_snapshot([[], [["/scan", ["/move_base"]]], []], [], {}, {"/move_base": "http://host/move_base"})
    alive = lives(move_base=Life.ALIVE)

    def missing(now):
        return [s.values[0][1] for s in watched.evaluate(live, alive, Desired(LISTENER), now) if "port" in s.message]

    assert [missing(now) for now in (0.0, 4.9, 5.0)] == [[], [], ["map"]]


SCAN = TopicSpec("front/scan", max_age=1.0)
SILENT = TopicVerdict(SCAN, "Silent topic", "last message 3.0 s ago", "max_age 1", "3.00")
PUBLISHED = build_snapshot([[["/front/scan", [LASER]]], [], []], [], {}, {LASER: f"http://host{LASER}"})


def test_silent_topic_fails_the_component_of_its_publisher_at_once():
    watched = monitor()
    alone = Desired(RosSystem("base", components=(Component("front_laser"),)))
    watched.evaluate(PUBLISHED, lives(front_laser=Life.ALIVE), alone, 0.0, topics=[TopicVerdict(SCAN)])
    told = said(watched.evaluate(PUBLISHED, lives(front_laser=Life.ALIVE), alone, 0.1, topics=[SILENT]))
    assert ("laser_resender", "Component status", "FALSE") in told
    assert ("front/scan", "Silent topic", "last message 3.0 s ago") in told
    assert not any(message == "running OK" for _, message, _ in told)
    back = said(watched.evaluate(PUBLISHED, lives(front_laser=Life.ALIVE), alone, 0.2, topics=[TopicVerdict(SCAN)]))
    assert ("laser_resender", "Component status", "RECOVERED") in back


def test_topic_stands_for_its_component_without_a_model():
    watched = GraphEvaluator({})
    spec = TopicSpec("front/scan", max_age=1.0, component="laser")
    unknown = TopicVerdict(spec, heard=False)
    assert said(watched.evaluate(graph(), {}, Desired(None), 0.0, topics=[unknown])) == set()
    silent = TopicVerdict(spec, "Silent topic", "none")
    told = said(watched.evaluate(graph(), {}, Desired(None), 1.0, topics=[silent]))
    assert told == {("laser", "Component status", "FALSE"), ("front/scan", "Silent topic", "none")}


def test_publisher_without_a_mapping_is_a_component_of_its_own_name():
    told = said(
        GraphEvaluator({}).evaluate(PUBLISHED, lives(front_laser=Life.ALIVE), Desired(None), 0.0, topics=[SILENT])
    )
    assert ("front_laser", "Component status", "FALSE") in told


def test_topics_of_nodes_under_reconfiguration_are_excused():
    in_change = Desired(SYSTEM, frozenset({"front_laser"}), excused=frozenset({"front_laser"}))
    assert monitor().excused_topics(PUBLISHED, in_change, ["front/scan", "odom"]) == {"front/scan"}
    assert monitor().excused_topics(PUBLISHED, DESIRED, ["front/scan"]) == frozenset()


@pytest.mark.parametrize(
    ("life", "driver", "status"),
    [
        (Life.ALIVE, NodeCondition.UNKNOWN, "TRUE"),
        (Life.ALIVE, NodeCondition.ALIVE, "TRUE"),
        (Life.ALIVE, NodeCondition.FAILED, "FALSE"),
        (Life.DEAD, NodeCondition.ALIVE, "FALSE"),
    ],
)
def test_component_with_a_node_and_a_drivers_status_needs_both(life, driver, status):
    watched = monitor()
    watched.evaluate(BOTH, ALIVE, DESIRED, 0.0)
    others = {"laser_resender": driver}
    told = said(watched.evaluate(BOTH, ALIVE | lives(front_laser=life), DESIRED, 1.0, others=others))
    assert ("laser_resender", "Component status", status) in told


def test_battery_is_a_component():
    told = said(monitor().evaluate(BOTH, ALIVE, DESIRED, 0.0, others={"battery": NodeCondition.FAILED}))
    assert ("battery", "Component status", "FALSE") in told


def why(statuses, component):
    (values,) = [s.values[1:] for s in statuses if (s.message, s.name) == ("Component status", component)]
    return dict(values).get("reason")


def test_component_says_why_its_node_counts_as_failed():
    watched = monitor()
    assert why(watched.evaluate(BOTH, ALIVE, DESIRED, 0.0), "laser_resender") is None
    hung = ALIVE | lives(front_laser=Life.HUNG, move_base=Life.DEAD)
    statuses = watched.evaluate(BOTH, hung, DESIRED, 0.1)
    assert why(statuses, "laser_resender") == f"node front_laser: {Life.HUNG.value}"
    assert why(statuses, "move_base") == Life.DEAD.value
    unknown = watched.evaluate(BOTH, ALIVE | lives(front_laser=Life.UNKNOWN), DESIRED, 0.2)
    assert why(unknown, "laser_resender") == f"node front_laser: {Life.HUNG.value}"
    ended = watched.evaluate(graph("/move_base"), ALIVE, DESIRED, 0.3)
    assert why(ended, "laser_resender") == f"node front_laser: {Life.HUNG.value}"  # and so it was ended
    well = watched.evaluate(BOTH, ALIVE, DESIRED, 0.4)
    assert why(well, "laser_resender") is None
    assert why(watched.evaluate(graph("/move_base"), ALIVE, DESIRED, 9.0), "laser_resender").startswith(
        "node front_laser: ended"
    )


def test_component_says_which_topic_or_driver_tells_that_it_has_failed():
    watched = GraphEvaluator({"sonar_driver": "sonar"}, patience=Patience(5.0, 1.0, 1.0))
    running = graph("/sonar_driver")
    known = lives(sonar_driver=Life.ALIVE)
    spec = TopicSpec("cell/range", max_age=0.5, component="sonar")
    silent = TopicVerdict(spec, "Silent topic", "last message 3.1 s ago", "max_age 0.5", "3.1")
    failed = {"sonar": NodeCondition.FAILED}
    said_by = {"sonar": "its driver says sonar: echo: no echo"}
    topic = watched.evaluate(running, known, Desired(None), 0.0, topics=[silent])
    assert why(topic, "sonar") == "Silent topic cell/range (max_age 0.5)"
    more = {"others": failed, "reasons": said_by}
    both = watched.evaluate(running, known, Desired(None), 0.1, topics=[silent], **more)
    assert why(both, "sonar") == "Silent topic cell/range (max_age 0.5); its driver says sonar: echo: no echo"
    driver = watched.evaluate(running, known, Desired(None), 0.2, topics=[TopicVerdict(spec)], **more)
    assert why(driver, "sonar") == "its driver says sonar: echo: no echo"


def test_publisher_of_a_silent_topic_says_which():
    watched = GraphEvaluator({}, patience=Patience(5.0, 1.0, 1.0))
    system = Desired(RosSystem("rover", components=(Component("filter"),)))
    running = build_snapshot([[["/scan_filtered", ["/filter"]]], [], []], [], {}, {"/filter": "http://host/filter"})
    silent = TopicVerdict(TopicSpec("scan_filtered", max_age=1.0), "Silent topic", "none", "messages", "none")
    statuses = watched.evaluate(running, lives(filter=Life.ALIVE), system, 0.0, topics=[silent])
    assert why(statuses, "filter") == "Silent topic scan_filtered (no message yet)"


ANONYMOUS = "/front_laser_4711_1700000000000"
ANONYMOUS_SCAN = build_snapshot([[["/front/scan", [ANONYMOUS]]], [], []], [], {}, {ANONYMOUS: "http://host/anonymous"})


@pytest.mark.parametrize("life", [Life.ALIVE, Life.DEAD])
def test_silent_topic_of_an_anonymous_node_is_told_of_the_component_of_the_model(life):
    watched = monitor()
    alone = Desired(RosSystem("base", components=(Component("front_laser"),)))
    known = {(ANONYMOUS, "http://host/anonymous"): Life.ALIVE}
    watched.evaluate(ANONYMOUS_SCAN, known, alone, 0.0, topics=[TopicVerdict(SCAN)])
    known = {(ANONYMOUS, "http://host/anonymous"): life}
    statuses = watched.evaluate(ANONYMOUS_SCAN, known, alone, 0.1, topics=[SILENT])
    told = [s.name for s in statuses if s.message == "Component status"]
    assert told == ["laser_resender"]
    assert why(statuses, "laser_resender") == (
        "Silent topic front/scan (max_age 1)" if life is Life.ALIVE else f"node front_laser: {Life.DEAD.value}"
    )


def test_topics_of_anonymous_nodes_under_reconfiguration_are_excused():
    in_change = Desired(SYSTEM, frozenset({"front_laser"}), excused=frozenset({"front_laser"}))
    assert monitor().excused_topics(ANONYMOUS_SCAN, in_change, ["front/scan"]) == {"front/scan"}


@pytest.mark.parametrize("running", ["/laser_11_1600000000000", "/laser_12_1700000000000"])
def test_settings_may_call_an_anonymous_node_of_the_model_by_its_beginning(running):
    watched = GraphEvaluator({"laser": "sensor"}, patience=Patience(0.1, 0.1, 0.1))
    model = Desired(RosSystem("s", components=(Component("laser_11_1600000000000"),)))
    known = {(running, f"http://host{running}"): Life.ALIVE}
    for now in (0.0, 9.0):
        told = said(watched.evaluate(graph(running), known, model, now))
    assert ("sensor", "Component status", "TRUE") in told
    assert not any(value == "FALSE" for _, _, value in told)


def test_parts_of_the_graph_that_can_not_be_read_are_told_in_place_of_running_ok():
    told = monitor().evaluate(BOTH, ALIVE, DESIRED, 0.0, problem="parameter /js can't be read")
    assert [s.message for s in told if s.name == "ROS Graph"] == ["parameter /js can't be read"]
