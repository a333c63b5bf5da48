"""Parameters that change while the robot drives."""

import importlib

import pytest
from move_base.costmap.grid import FREE, LETHAL
from move_base.parameters.reader import read_parameters
from move_base.parameters.reconfiguration import ServerDescription, changed, present_values, servers
from node_kit.parameters import ParameterError
from robot_formulas.geometry import Pose


def definition(name):
    return importlib.import_module(f"move_base.cfg.{name}Config")


def test_servers_have_the_published_names(tree):
    assert [server.namespace for server in servers(read_parameters(tree()))] == [
        "",
        "TrajectoryPlannerROS",
        "global_costmap",
        "global_costmap/static_layer",
        "global_costmap/obstacles_layer",
        "global_costmap/inflater_layer",
        "local_costmap",
        "local_costmap/static_layer",
        "local_costmap/obstacles_layer",
        "local_costmap/inflater_layer",
    ]


def test_present_values_are_those_that_the_node_has(tree):
    given = tree(TrajectoryPlannerROS__max_vel_x=0.3)
    parameters = read_parameters(given)
    controller = ServerDescription("TrajectoryPlannerROS", "BaseLocalPlanner")
    values = present_values(parameters, given, controller, ["max_vel_x", "vx_samples", "min_vel_y", "max_vel_y"])
    assert values == {"max_vel_x": 0.3, "vx_samples": 6, "max_vel_y": 0.5}
    inflation = ServerDescription("local_costmap/inflater_layer", "InflationPlugin")
    assert present_values(parameters, given, inflation, ["inflation_radius"]) == {"inflation_radius": 0.65}


def test_definitions_have_the_nodes_own_defaults(tree):
    minimal = {name: {"plugins": tree()[name]["plugins"]} for name in ("global_costmap", "local_costmap")}
    for given in (minimal, {**minimal, "base_local_planner": "dwa_local_planner/DWAPlannerROS"}):
        parameters = read_parameters(given)
        for server in servers(parameters):
            defaults = definition(server.definition).defaults
            present = present_values(parameters, {}, server, set(defaults) - {"base_local_planner"})
            assert present.items() <= defaults.items(), server


def test_every_parameter_of_every_server_can_be_set(tree):
    parameters = read_parameters(tree())
    for server in servers(parameters):
        for name, value in definition(server.definition).defaults.items():
            if name in {"base_global_planner", "base_local_planner"}:
                continue
            new, _ = changed(tree(), server.namespace, {name: value})
            level = new
            for part in filter(None, server.namespace.split("/")):
                level = level[part]
            assert level[name] == value


def test_planner_changes_with_a_new_start_only(tree):
    with pytest.raises(ParameterError, match="base_local_planner can't change while move_base runs"):
        changed(tree(), "", {"base_local_planner": "dwa_local_planner/DWAPlannerROS"})


def test_size_of_a_rolling_window_changes(simulate, walls, tree):
    simulation = driving(simulate(walls(8.0, 8.0)), (2.0, 0.0, 0.0), seconds=1.0)
    _, parameters = changed(tree(), "local_costmap", {"width": 5, "height": 4})
    simulation.navigator.reconfigure(parameters)
    simulation.run(0.05)
    assert simulation.navigator.local_snapshot.costs.shape == (80, 100)


def test_footprint_that_comes_later_is_kept_free(simulate, walls, tree):
    simulation = driving(simulate(walls(8.0, 8.0)), (2.0, 0.0, 0.0), seconds=1.0)
    before = simulation.navigator.local_snapshot.radii.inscribed
    _, parameters = changed(
        tree(), "local_costmap", {"footprint": "[[0.9, 0.8], [0.9, -0.8], [-0.9, -0.8], [-0.9, 0.8]]"}
    )
    simulation.navigator.reconfigure(parameters)
    simulation.run(0.05)
    assert simulation.navigator.local_snapshot.radii.inscribed > before + 0.3


def test_switched_off_obstacle_layer_neither_shows_nor_stops_the_robot(simulate, walls, tree):
    simulation = simulate([], hidden=[(2.0, 0.0, 0.5, 0.5, 0.0)])
    simulation.run(1.0)
    assert (simulation.navigator.local_snapshot.costs == LETHAL).any()
    off, _ = changed(tree(), "local_costmap/obstacles_layer", {"enabled": False})
    _, parameters = changed(off, "global_costmap/obstacles_layer", {"enabled": False})
    simulation.navigator.reconfigure(parameters)
    simulation.silent_from = simulation.time
    simulation.run(2.0)
    assert not (simulation.navigator.local_snapshot.costs == LETHAL).any()
    assert simulation.navigator._surroundings.stale_reason(simulation.time) == ""


def test_layer_that_starts_switched_off_can_be_switched_on(tree):
    given = tree(local_costmap__inflater_layer__enabled=False)
    parameters = read_parameters(given)
    server = ServerDescription("local_costmap/inflater_layer", "InflationPlugin")
    assert server in servers(parameters)
    assert parameters.local_costmap.layers_of("inflation") == ()
    assert present_values(parameters, given, server, ["enabled"]) == {"enabled": False}
    _, parameters = changed(given, server.namespace, {"enabled": True})
    assert [layer.name for layer in parameters.local_costmap.layers_of("inflation")] == ["inflater_layer"]


def test_change_reaches_its_parameter_and_leaves_the_tree_given(tree):
    given = tree()
    new, parameters = changed(given, "local_costmap/inflater_layer", {"inflation_radius": 0.9})
    assert next(layer for layer in parameters.local_costmap.layers if layer.kind == "inflation").inflation_radius == 0.9
    assert new["local_costmap"]["inflater_layer"]["inflation_radius"] == 0.9
    assert given == tree()


def test_values_that_do_not_fit_together_are_refused(tree):
    with pytest.raises(ParameterError, match="min_vel_x"):
        changed(tree(), "TrajectoryPlannerROS", {"max_vel_x": 0.05})


def driving(simulation, goal, until=None, seconds=20.0):
    simulation.run(0.3)
    simulation.navigator.set_goal(Pose(*goal), simulation.time)
    simulation.run(seconds, until)
    return simulation


def test_robot_goes_on_without_a_stop_at_its_new_speed(simulate, walls, variant):
    simulation = simulate(walls(), start=(-4.0, 0.0, 0.0), tree=variant(speed=0.5))
    driving(simulation, (4.0, 0.0, 0.0), until=lambda one: one.velocity.x > 0.45)
    assert simulation.velocity.x > 0.45
    _, parameters = changed(variant(speed=0.5), "TrajectoryPlannerROS", {"max_vel_x": 0.25})
    simulation.navigator.reconfigure(parameters)
    before = len(simulation.run_log.commands)
    log = simulation.run(3.0)
    speeds = [command.x for _, command in log.commands[before:]]
    assert min(speeds) > 0.1
    assert max(speeds[20:]) <= 0.25 + 1e-9
    assert log.outcome is None


def test_another_inflation_counts_at_once_and_forgets_no_obstacle(simulate, walls, tree):
    simulation = driving(simulate(walls(8.0, 8.0)), (2.0, 0.0, 0.0), seconds=1.0)
    narrow = simulation.navigator.local_snapshot
    _, parameters = changed(tree(), "local_costmap/inflater_layer", {"inflation_radius": 2.0})
    simulation.navigator.reconfigure(parameters)
    simulation.run(0.05)
    wide = simulation.navigator.local_snapshot
    assert (wide.costs > 0).sum() > 1.2 * (narrow.costs > 0).sum()
    assert (wide.costs == LETHAL).sum() > 0.9 * (narrow.costs == LETHAL).sum() > 0


def test_switched_off_inflation_leaves_walls_and_what_the_robot_cannot_reach(simulate, walls, tree):
    simulation = driving(simulate(walls(8.0, 8.0)), (2.0, 0.0, 0.0), seconds=1.0)
    _, parameters = changed(tree(), "local_costmap/inflater_layer", {"enabled": False})
    simulation.navigator.reconfigure(parameters)
    simulation.run(0.05)
    assert set(simulation.navigator.local_snapshot.costs.ravel()) == {FREE, LETHAL}


def test_another_rate_of_control_is_taken_over(simulate, walls, tree):
    simulation = simulate(walls())
    _, parameters = changed(tree(), "", {"controller_frequency": 5.0})
    simulation.navigator.reconfigure(parameters)
    log = driving(simulation, (2.0, 0.0, 0.0)).run_log
    assert log.text == "Goal reached."
