"""The dynamic_reconfigure servers beside those of ROS Navigation 1.17.3: names, types, defaults, ranges."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest
import yaml
from move_base.parameters.reconfiguration import OF_LAYERS, OF_LOCAL_PLANNERS

FACTS = yaml.safe_load((Path(__file__).parent / "data" / "navigation_1_17.yaml").read_text())
README = Path(__file__).parents[4] / "catkin_ws" / "src" / "move_base" / "README.md"

ADDED = {
    "BaseLocalPlanner": {"max_vel_y", "min_vel_y", "xy_goal_tolerance", "yaw_goal_tolerance", "latch_xy_goal_tolerance"}
}
"""Servers of the stand-in have these, too."""

OTHER_DEFAULTS = {
    ("MoveBase", "controller_patience"),  # the original says 5 and waits for 15
    ("BaseLocalPlanner", "y_vels"),  # the original's has -0.3 twice
}

OTHER_RANGES = {("BaseLocalPlanner", "max_vel_x"), ("BaseLocalPlanner", "min_vel_x")}  # negative: backwards


def described(name):
    definition = importlib.import_module(f"move_base.cfg.{name}Config")
    groups = definition.config_description
    return {one["name"]: one for one in groups["parameters"]}


def test_every_definition_of_the_original_is_there():
    assert {"MoveBase", "Costmap2D", *OF_LAYERS.values(), *OF_LOCAL_PLANNERS.values()} == set(FACTS)


@pytest.mark.parametrize("name", FACTS)
def test_server_has_the_parameters_of_the_original(name):
    assert set(described(name)) == set(FACTS[name]) | ADDED.get(name, set())


@pytest.mark.parametrize(("name", "parameter"), [(name, one) for name in FACTS for one in FACTS[name]])
def test_parameter_has_type_default_and_range_of_the_original(name, parameter):
    kind, default, low, high = FACTS[name][parameter]
    ours = described(name)[parameter]
    assert ours["type"] == kind
    if (name, parameter) not in OTHER_DEFAULTS:
        assert ours["default"] == pytest.approx(default) if kind == "double" else ours["default"] == default
    if (name, parameter) in OTHER_RANGES:
        assert (ours["min"], ours["max"]) == (-high, high)
    elif low is not None:
        assert ours["min"] == pytest.approx(low)
    if high is not None:
        assert ours["max"] == pytest.approx(high, abs=1e-5)


def test_readme_names_every_parameter_that_is_taken_without_effect():
    ignored = {
        parameter
        for name in FACTS
        for parameter, one in described(name).items()
        if one["description"].startswith("Taken, without effect")
    }
    text = README.read_text()
    assert [parameter for parameter in sorted(ignored) if f"`{parameter}`" not in text] == []
