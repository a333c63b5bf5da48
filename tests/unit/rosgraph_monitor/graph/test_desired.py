"""What should run, by the active configuration."""

from ros_model.errors import ModelError
from ros_model.language.metamodel import Component, Port, PortKind, RosSystem, SystemParameter
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


def test_variant_that_could_not_be_read_for_a_while_is_read_when_it_can_be():
    files = {"slow": SLOW}

    def read(name):
        if name not in files:
            raise ModelError(f"no model {name}")
        return files[name]

    model = DesiredModel(BASE, read)
    model.follow([Grounding("f", "slow", "STABLE")])
    model.follow([Grounding("f", "fast", "STABLE")])
    assert "fast" in model.look_again().problem
    files["fast"] = FAST
    desired = model.look_again()
    assert (desired.problem, desired.excused) == ("", frozenset())
    assert names(desired) == {"laser", "move_base", "fast_helper"}
    assert model.look_again() is desired, "nothing is read again where nothing is missing"


CELL = RosSystem(
    "cell", components=tuple(Component(name) for name in ("conveyor", "camera", "gripper", "viewer", "welder"))
)
PARTS = {
    "pick": RosSystem("pick", components=(Component("gripper"), Component("camera"))),
    "pick_blindly": RosSystem("pick_blindly", components=(Component("gripper"),)),
    "look": RosSystem("look", components=(Component("viewer"), Component("camera"))),
}


def cell(*configurations):
    model = DesiredModel(CELL, PARTS.__getitem__, PARTS.values)
    assert names(model.current) == {"conveyor", "camera", "gripper", "viewer", "welder"}  # nobody deploys anything yet
    for active in configurations:
        model.follow([Grounding(function, name, "STABLE") for function, name in active.items()])
    return model.current


def test_nodes_that_only_a_released_function_has_are_idle():
    desired = cell({"f_pick": "pick", "f_look": "look"}, {"f_look": "look"})
    assert names(desired) == {"conveyor", "camera", "viewer", "welder"}
    assert desired.idle_nodes == {"gripper"}
    desired = cell({"f_pick": "pick"}, {})
    assert names(desired) == {"conveyor", "welder"}
    assert desired.idle_nodes == {"camera", "gripper", "viewer"}


def test_function_that_was_released_before_the_monitor_came_is_idle_too():
    assert cell({"f_look": "look"}).idle_nodes == {"gripper"}


def test_nodes_that_the_running_design_of_a_function_does_without_are_idle():
    assert cell({"f_pick": "pick_blindly"}).idle_nodes == {"camera", "viewer"}


def test_variants_that_can_not_be_read_at_first_are_tried_until_they_are_read():
    unread, looks = {"pick", "pick_blindly"}, []

    def read_all():
        looks.append(set(unread))
        return [ModelError(f"no model {name}") if name in unread else part for name, part in PARTS.items()]

    model = DesiredModel(CELL, PARTS.__getitem__, read_all)
    assert model.look_again() is model.current
    assert not looks, "nobody has told yet what is deployed"
    first = model.follow([Grounding("f_look", "look", "STABLE")])
    assert first.idle_nodes == set()
    assert model.look_again() is first, "nothing new could be read"
    unread.clear()
    desired = model.look_again()
    assert desired.idle_nodes == {"gripper"}
    assert names(desired) == {"conveyor", "camera", "viewer", "welder"}
    assert model.look_again() is desired


def test_topics_that_only_idle_components_publish_are_idle():
    ports = {name: (Port(f"{name}/out", PortKind.PUBLISHER), Port("shared", PortKind.PUBLISHER)) for name in "abc"}
    base = RosSystem("base", components=(Component("a", ports=ports["a"]), Component("b", ports=ports["b"])))
    variants = [RosSystem(name, components=(Component(name, ports=ports[name]),)) for name in "bc"]
    model = DesiredModel(base, {v.name: v for v in variants}.__getitem__, lambda: variants)
    assert model.current.idle_topics == frozenset()
    assert model.follow([Grounding("f", "c", "STABLE")]).idle_topics == {"b/out"}
    assert model.follow([]).idle_topics == {"b/out", "c/out"}


def test_wrong_parameters_belong_to_the_configurations_that_set_them():
    own = {
        "look": RosSystem("look", components=(Component("eye", namespace="head"), Component("lamp"))),
        "pick": RosSystem("pick", components=(Component("lamp"),), parameters=(SystemParameter("site"),)),
        "sort": RosSystem("sort", parameters=(SystemParameter("site"), SystemParameter("speed", namespace="belt"))),
    }
    base = RosSystem("base", components=(Component("belt"),), parameters=(SystemParameter("floor"),))
    desired = DesiredModel(base, own.__getitem__).follow(
        [Grounding("f_look", "look", "STABLE"), Grounding("f_pick", "pick", "FAILED"), Grounding("f_sort", "sort", "")]
    )
    assert desired.configurations_of("head/eye", ["focus"]) == ("look",)
    assert desired.configurations_of("lamp", ["power"]) == ("look", "pick")
    assert desired.configurations_of("belt", ["speed"]) == ()
    assert desired.configurations_of("ROS Graph", ["site"]) == ("pick", "sort")
    assert desired.configurations_of("ROS Graph", ["floor", "belt/speed"]) == ("sort",)
    assert desired.configurations_of("ROS Graph", ["floor"]) == ()


def test_no_configuration_any_more_leads_back_to_the_base_if_its_variants_are_unknown():
    model = DesiredModel(BASE, read)
    model.follow([Grounding("f", "slow", "STABLE")])
    assert model.follow([]).system == BASE
    assert model.follow([Grounding("f", "", "FAILED")]).system == BASE


def test_without_base_nothing_in_particular_is_desired():
    assert DesiredModel(None, read).follow([Grounding("f", "slow", "STABLE")]).system is None


def test_variant_that_could_not_be_read_for_want_of_memory_is_read_when_it_can_be():
    errors = [MemoryError()]

    def read(name):
        if name == "fast" and errors:
            raise errors.pop()
        return {"slow": SLOW, "fast": FAST}[name]

    model = DesiredModel(BASE, read)
    model.follow([Grounding("f", "slow", "STABLE")])
    assert "MemoryError" in model.follow([Grounding("f", "fast", "STABLE")]).problem
    desired = model.look_again()
    assert (desired.problem, names(desired)) == ("", {"laser", "move_base", "fast_helper"})
