"""What should run, by the active configuration."""

from ros_model.errors import ModelError
from ros_model.language.metamodel import Component, RosSystem
from rosgraph_monitor.graph.desired import DesiredModel, Grounding

BASE = RosSystem("base", components=(Component("laser"), Component("move_base")))
SLOW = RosSystem("slow", components=(Component("move_base"), Component("slow_helper")))
FAST = RosSystem("fast", components=(Component("move_base"), Component("fast_helper")))


def read(name):
    try:
        return {"slow": SLOW, "fast": FAST}[name]
    except KeyError:
        raise ModelError(f"no model {name}") from None


def names(desired):
    return {component.name for component in desired.system.components}


def test_without_configuration_the_base_is_desired():
    assert DesiredModel(BASE, read).current.system == BASE


def test_active_variant_is_composed_with_the_base():
    desired = DesiredModel(BASE, read).follow([Grounding("f", "slow", "STABLE")])
    assert names(desired) == {"laser", "move_base", "slow_helper"}
    assert desired.variant_nodes == {"move_base", "slow_helper"}
    assert desired.excused == frozenset()


def test_nodes_of_both_ends_of_a_change_are_excused():
    model = DesiredModel(BASE, read)
    model.follow([Grounding("f", "slow", "STABLE")])
    desired = model.follow([Grounding("f", "fast", "RECONFIGURING")])
    assert desired.excused == {"move_base", "slow_helper", "fast_helper"}
    assert model.follow([Grounding("f", "fast", "STABLE")]).excused == frozenset()


def test_recovering_excuses_and_failed_does_not():
    model = DesiredModel(BASE, read)
    assert "move_base" in model.follow([Grounding("f", "slow", "RECOVERING")]).excused
    assert model.follow([Grounding("f", "slow", "FAILED")]).excused == frozenset()


def test_variant_that_can_not_be_read_keeps_the_last_good_model():
    model = DesiredModel(BASE, read)
    model.follow([Grounding("f", "slow", "STABLE")])
    desired = model.follow([Grounding("f", "broken", "STABLE")])
    assert names(desired) == {"laser", "move_base", "slow_helper"}
    assert "broken" in desired.problem
    assert model.follow([Grounding("f", "fast", "STABLE")]).problem == ""


def test_no_configuration_any_more_leads_back_to_the_base():
    model = DesiredModel(BASE, read)
    model.follow([Grounding("f", "slow", "STABLE")])
    assert model.follow([]).system == BASE
    assert model.follow([Grounding("f", "", "FAILED")]).system == BASE


def test_without_base_nothing_in_particular_is_desired():
    assert DesiredModel(None, read).follow([Grounding("f", "slow", "STABLE")]).system is None
