"""What differs between two configurations."""

import pytest
from rosgraph_launcher.description import NodeDescription, SystemDescription
from rosgraph_manipulator.configuration.difference import compare, read_by_nodes, same_value


def node(name, package="p", executable="x", **parameters):
    return NodeDescription(name, "/", package, executable, parameters=parameters)


def system(*nodes, **parameters):
    return SystemDescription({n.name: n for n in nodes}, parameters)


def test_equal_configurations_do_not_differ():
    difference = compare(system(node("/a", speed=1)), system(node("/a", speed=1.0)))
    assert not difference.touches_nodes
    assert not difference.shared


def test_only_nodes_that_differ_are_named():
    running = system(node("/gone"), node("/same", x=1), node("/tuned", x=1), node("/other", executable="old"))
    wanted = system(node("/same", x=1), node("/tuned", x=2), node("/other", executable="new"), node("/new"))
    difference = compare(running, wanted)
    assert difference.stops == ("/gone",)
    assert difference.starts == ("/new",)
    assert difference.replaced == ("/other",)
    assert difference.parameters == {"/tuned": {"x": 2}}


def test_parameter_that_is_left_out_replaces_its_node():
    difference = compare(system(node("/a", x=1, y=2)), system(node("/a", x=1)))
    assert difference.replaced == ("/a",)


def test_additional_parameter_is_a_new_value():
    assert compare(system(node("/a")), system(node("/a", x=1))).parameters == {"/a": {"x": 1}}


def test_shared_parameter_replaces_every_node():
    difference = compare(system(node("/a"), node("/b"), robot="one"), system(node("/a"), node("/b"), robot="two"))
    assert difference.replaced == ("/a", "/b")


def test_expected_quality_is_read_by_no_node():
    difference = compare(system(node("/a"), **{"/qa_energy": 0.1}), system(node("/a"), **{"/qa_energy": 0.2}))
    assert not difference.touches_nodes
    assert difference.shared == {"/qa_energy": 0.2}


def test_expected_quality_is_no_parameter_of_a_node_whatever_the_nodes_own_are_called():
    found = read_by_nodes(system(node("/a", qa_margin=3), **{"/qa_energy": 0.1, "/robot": "one"}))
    assert found == {"/robot": "one", "/a/qa_margin": 3}


def test_from_nothing_everything_starts():
    assert compare(SystemDescription(), system(node("/a"))).starts == ("/a",)


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (1, 1.0, True),
        (1, True, False),
        ([1, 2], [1.0, 2], True),
        ([True], [1], False),
        ({"a": 0}, {"a": False}, False),
        ({"a": 0}, {"a": 0.0}, True),
        ("1", 1, False),
    ],
)
def test_values_are_compared_by_what_they_mean(one, other, same):
    assert same_value(one, other) is same


def test_all_parameters_have_full_names():
    assert system(node("/a", **{"x/y": 1}), **{"/z": 2}).all_parameters() == {"/a/x/y": 1, "/z": 2}
