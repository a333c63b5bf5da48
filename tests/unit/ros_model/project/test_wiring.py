"""What a variant requires by its wiring: who really feeds it, on graphs as robots have them."""

import re

import pytest
from ros_model.language.metamodel import (
    Component,
    Connection,
    ConnectionKind,
    Port,
    PortKind,
    PortPath,
    Reference,
    RosSystem,
)
from ros_model.project.wiring import Uncounted, wiring_of

KINDS = {"": ConnectionKind.TOPIC, "action": ConnectionKind.ACTION, "service": ConnectionKind.SERVICE}


def system(*lines):
    """Return the system of lines such as `laser > scan > filter, guard` (a topic) or `dock < action dock < nav`."""
    connections, names = [], {}
    for line in lines:
        sources, middle, targets = (part.strip() for part in re.split("[<>]", line))
        kind, name = middle.split() if " " in middle else ("", middle)
        ends = [tuple(PortPath(end, name) for end in re.split(", *", side)) for side in (sources, targets)]
        connections.append(Connection(name, KINDS[kind], *ends))
        names |= {end.component: None for side in ends for end in side}
    return RosSystem("robot", tuple(map(Component, names)), tuple(connections))


def wiring(variant, *lines, foreign=()):
    """Return the wiring of the variant that brings these components of a system, with their connections."""
    whole, own = system(*lines), variant.split()
    part = [c for c in whole.connections if {end.component for end in (*c.sources, *c.targets)} & set(own)]
    return wiring_of(whole, RosSystem("variant", tuple(Component(name) for name in own), tuple(part)), foreign)


def required(variant, *lines):
    return set(wiring(variant, *lines).chains)


def test_sensor_behind_filters_is_required():
    lines = ["laser > scan > filter", "filter > clean > merger", "merger > cloud > grasp"]
    assert required("grasp", *lines) == {"laser", "filter", "merger"}


@pytest.mark.parametrize("topic", ["tf", "/tf", "tf_static", "left/tf", "diagnostics", "clock", "rosout", "nodes/bond"])
def test_topic_on_which_any_node_may_publish_tells_nothing(topic):
    lines = ["lift > lift/state > tracker", f"base, lift, tracker > {topic} > tracker, lift"]
    found = wiring("tracker", *lines)
    assert set(found.chains) == {"lift"}
    assert found.uncounted["base"][1] is Uncounted.SHARED


def test_topic_that_is_only_named_like_a_shared_one_counts():
    assert required("tracker", "timer > lap/clock > tracker", "arm > tf/arm > tracker") == {"timer", "arm"}


def test_shared_topic_is_known_by_the_names_in_the_code_too():
    port = Port("frames", PortKind.PUBLISHER, Reference("p", "arm.py", "arm", "/tf"))
    connection = Connection("frames", ConnectionKind.TOPIC, (PortPath("arm", "frames"),), (PortPath("eye", "frames"),))
    base = RosSystem("robot", (Component("arm", ports=(port,)), Component("eye")), (connection,))
    variant = RosSystem("variant", (Component("eye"),), (connection,))
    assert wiring_of(base, variant).uncounted["arm"][1] is Uncounted.SHARED


LOOP = [
    "driver > base/twist_controller/command > base",
    "base > odometry > driver, localizer",
    "base, localizer > tf > localizer, driver",
]


def test_who_commands_a_component_that_feeds_the_variant_is_not_required():
    found = wiring("localizer", *LOOP)
    assert set(found.chains) == {"base"}
    assert found.uncounted["driver"][1] is Uncounted.COMMAND


def test_server_that_only_one_variant_uses_is_required_by_that_one_though_all_hear_what_it_commands():
    assert required("localizer", *LOOP, "driver < action drive < localizer") == {"base", "driver"}


@pytest.mark.parametrize(
    "topic",
    ["cmd_vel", "raw_cmd_vel", "arm/command", "mobile_base/commands/velocity", "simple/goal", "thrust_setpoint"],
)
def test_variant_that_obeys_does_not_require_who_commands_it(topic):
    assert required("smoother", f"planner > {topic} > smoother", "laser > scan > planner") == set()


def test_who_gets_goals_over_a_topic_is_required_with_its_sensors_as_a_server_is():
    lines = ["mission > move_base_simple/goal > nav", "nav > status > mission", "laser > scan > nav"]
    assert required("mission", *lines) == {"nav", "laser"}
    assert wiring("nav", *lines).uncounted["mission"][1] is Uncounted.GOAL


@pytest.mark.parametrize("topic", ["arm/command_state", "cmd_vel_feedback", "goal_distance", "recommended_speed"])
def test_topic_that_tells_of_a_command_is_no_command(topic):
    assert required("planner", f"arm > {topic} > planner") == {"arm"}


def test_plant_is_required_without_what_else_acts_on_it():
    lines = ["nav > cmd_vel > base", "base > odom > nav", "battery > load > base", "joystick > teleop/cmd_vel > base"]
    found = wiring("nav", *lines)
    assert set(found.chains) == {"base"}
    assert {name: why for name, (_, why) in found.uncounted.items()} == {
        "battery": Uncounted.PLANT,
        "joystick": Uncounted.COMMAND,
    }


def test_plant_that_answers_on_a_shared_topic_only_is_required():
    assert required("nav", "nav > cmd_vel > base", "base, crane > tf > nav") == {"base"}


def test_plant_that_a_server_of_the_variant_commands_is_required_without_what_else_acts_on_it():
    lines = ["drive < action drive < nav", "drive > command > base", "base > odom > drive", "battery > load > base"]
    assert required("nav", *lines) == {"drive", "base"}


def test_node_that_passes_commands_on_to_the_plant_is_required_without_its_other_inputs():
    lines = ["nav > nav/cmd_vel > mux", "mux > cmd_vel > base", "base > odom > nav", "pad > joy > mux"]
    assert required("nav", *lines) == {"mux", "base"}


@pytest.mark.parametrize("topic", ["footprint", "tf", "diagnostics", "attached_object"])
def test_sensor_is_required_behind_a_filter_that_hears_the_variant(topic):
    lines = [f"grasp > {topic} > filter", "camera > image > filter", "filter > cloud > grasp"]
    assert required("grasp", *lines) == {"camera", "filter"}


def test_sensor_of_a_simulated_robot_is_required_behind_its_filter():
    lines = ["nav > cmd_vel > world", "world > rays > laser", "laser > scan > filter", "filter > clean > nav"]
    assert required("nav", *lines) == {"filter", "laser", "world"}


def test_server_requires_none_of_its_clients_and_clients_require_what_feeds_the_server():
    lines = ["planner < service plan < mission", "map > grid > planner"]
    assert required("planner", *lines) == {"map"}
    assert required("mission", *lines) == {"planner", "map"}


def test_chain_is_the_shortest_way_to_the_variant():
    found = wiring("nav", "laser > scan > filter, nav", "filter > clean > nav", "power > volts > laser")
    assert [(feed.source, feed.connection, feed.target) for feed in found.chains["power"]] == [
        ("power", "volts", "laser"),
        ("laser", "scan", "nav"),
    ]


def test_wiring_in_a_circle_ends():
    assert required("a", "b > x > c", "c > y > b", "c > z > a", "a > w > b") == {"b", "c"}


def test_what_another_function_deploys_is_not_required_and_neither_is_what_feeds_it():
    lines = [
        "laser > scan > drive",
        "drive < action drive < mission",
        "drive > status > mission",
        "gps > fix > mission",
    ]
    found = wiring("mission", *lines, foreign={"drive"})
    assert set(found.chains) == {"gps"}
    assert found.uncounted["drive"][1] is Uncounted.FUNCTION
    assert "laser" not in found.uncounted


def test_what_feeds_the_variant_itself_is_required_though_it_feeds_another_function_too():
    lines = ["laser > scan > drive, mission", "drive < action drive < mission"]
    assert set(wiring("mission", *lines, foreign={"drive"}).chains) == {"laser"}


def test_plant_that_only_another_function_commands_is_required_if_it_feeds_the_variant_and_not_for_tf():
    lines = ["drive < action drive < mission", "drive > cmd_vel > base", "base > tf > mission, drive"]
    assert set(wiring("mission", *lines, foreign={"drive"}).chains) == set()
    found = wiring("mission", *lines, "base > odom > mission", "bumper > hits > base", foreign={"drive"})
    assert set(found.chains) == {"base"}
    assert found.uncounted["bumper"][1] is Uncounted.PLANT


def test_component_of_the_variant_is_not_foreign_to_it():
    assert set(wiring("grasp", "camera > image > grasp", foreign={"grasp"}).chains) == {"camera"}
