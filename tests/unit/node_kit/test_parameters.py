"""What each kind of parameter is, and what is said of a value that is none."""

import math
from pathlib import Path

import pytest
from node_kit import parameters
from node_kit.parameters import ParameterError, ParameterTree, named_entries

REMEDY = "correct the launch or YAML file that sets it"


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        ("number", 1, 1.0),
        ("number", -0.5, -0.5),
        ("whole", 3, 3),
        ("whole", 3.0, 3),
        ("flag", True, True),
        ("flag", False, False),
        ("flag", 1, True),
        ("flag", 0, False),
        ("flag", "true", True),
        ("flag", "False", False),
        ("text", "move_base", "move_base"),
        ("text", 7, "7"),
        ("text", None, ""),
        ("path", "/tmp/w.yaml", Path("/tmp/w.yaml")),
        ("items", (1, "a"), [1, "a"]),
        ("texts", ["/a", "/b"], ["/a", "/b"]),
        ("texts", "/a, /b,", ["/a", "/b"]),
        ("texts", "", []),
        ("texts", "[/a, /b]", ["/a", "/b"]),
        ("texts", " ['/a', \"/b\",] ", ["/a", "/b"]),
        ("texts", "[]", []),
        ("numbers", [1, 0.5], [1.0, 0.5]),
        ("numbers", "[0.1, -0.3]", [0.1, -0.3]),
        ("numbers", "", []),
        ("mapping", {"a": 1}, {"a": 1}),
        ("mapping", "", {}),
        ("mapping", None, {}),
    ],
)
def test_what_is_of_a_kind(kind, value, expected):
    found = getattr(parameters, kind)(value, "/node/name")
    assert found == expected
    assert type(found) is type(expected) or isinstance(expected, Path)


@pytest.mark.parametrize(
    ("kind", "values", "rule"),
    [
        ("number", ["1", None, True, math.nan, math.inf, [1]], "must be a finite number"),
        ("whole", ["1", None, True, math.nan, math.inf, 2.5], "must be a whole number"),
        ("flag", ["yes", None, 2, "TRUE", [], {}, math.nan], "must be true or false"),
        ("text", [True, ["a"], {"a": 1}], "must be a text"),
        ("path", ["", None, 3, ["a"]], "must be the path of a file"),
        ("items", ["a", None, 3, {"a": 1}], "must be a list"),
        ("texts", [["a", 3], 3, None, {"a": 1}], "must be a list of texts"),
        ("numbers", [["a"], [True], "left", 3, None, [math.inf], "nan", [None]], "must be a list of finite numbers"),
        ("mapping", ["a", [1], 3, True], "must be a mapping"),
    ],
)
def test_what_is_not_is_told_with_name_value_and_remedy(kind, values, rule):
    for value in values:
        with pytest.raises(ParameterError) as refused:
            getattr(parameters, kind)(value, "/node/name")
        assert str(refused.value) == f"parameter /node/name is {value!r}: it {rule}: {REMEDY}"


@pytest.mark.parametrize("value", [-1, 10.5])
def test_number_out_of_its_range(value):
    with pytest.raises(ParameterError, match="must be a finite number, at least 0 and at most 10: "):
        parameters.number(value, "~rate", 0.0, 10.0)


def test_number_that_has_to_be_more_than_its_limit():
    assert parameters.number(0.1, "~rate", 0.0, above=True) == 0.1
    with pytest.raises(ParameterError, match="must be a finite number, more than 0: "):
        parameters.number(0, "~rate", 0.0, above=True)


def test_whole_number_out_of_its_range():
    with pytest.raises(ParameterError, match="~seed is -4: it must be a whole number, at least 0: "):
        parameters.whole(-4, "~seed", low=0)


def test_choice():
    assert parameters.choice("wait", "~policy", ["wait", "refuse"]) == "wait"
    for value in ("go", None, ["wait"]):
        with pytest.raises(ParameterError, match="must be one of wait, refuse: "):
            parameters.choice(value, "~policy", ["wait", "refuse"])


def test_tree_names_a_parameter_with_its_place():
    tree = ParameterTree({"costmap": {"width": "wide"}}, "/move_base")
    with pytest.raises(ParameterError, match=r"^parameter /move_base/costmap/width is 'wide'"):
        tree.child("costmap").number("width", 1.0)
    with pytest.raises(ParameterError, match=r"^parameter ~costmap/width is 'wide'"):
        ParameterTree(tree.values).child("costmap").number("width", 1.0)


def test_tree_gives_defaults_and_an_empty_level_where_nothing_is_given():
    tree = ParameterTree({})
    assert tree.child("costmap").number("width", 2.0) == 2.0
    assert tree.number("highest", math.inf) == math.inf
    assert tree.whole("n", 3) == 3
    assert tree.flag("f", True) is True
    assert tree.text("t", "a") == "a"
    assert tree.texts("l", ["b"]) == ["b"]
    assert tree.items("i") == []
    assert tree.numbers("v", [0.5]) == [0.5]
    assert tree.mapping("m") == {}
    assert tree.choice("c", "x", ["x"]) == "x"
    assert not tree.has("n")
    assert tree.value("n") is None


def test_default_that_another_parameter_has_put_out_of_range_is_told():
    with pytest.raises(ParameterError, match=r"~range_max is 8\.0: .* at least 50"):
        ParameterTree({}).number("range_max", 8.0, low=50.0)


def test_former_name_counts_where_the_present_one_is_not_given():
    tree = ParameterTree({"old": 1.0, "both": 2.0, "both_old": "wrong"})
    assert tree.number("new", 0.0, formerly="old") == 1.0
    assert tree.number("both", 0.0, formerly="both_old") == 2.0
    with pytest.raises(ParameterError, match="~both_old"):
        tree.number("other", 0.0, formerly="both_old")


def test_value_where_a_level_should_be():
    with pytest.raises(ParameterError, match=r"^parameter ~costmap is 3: it must be a group of parameters"):
        ParameterTree({"costmap": 3}).child("costmap")


NAMED = {"lift/driver": {"node": "lift/driver"}, "lift": {"node": "lift"}, "eye": {"topic": "eye/scan"}, "odd": 3}


@pytest.mark.parametrize(
    "tree",
    [
        NAMED,
        {"lift": {"driver": {"node": "lift/driver"}, "node": "lift"}, "eye": {"topic": "eye/scan"}, "odd": 3},
    ],
    ids=["file", "parameter server"],
)
def test_entries_have_the_names_of_the_file_also_where_the_server_made_levels_of_their_slashes(tree):
    assert dict(named_entries(tree)) == NAMED


def test_empty_entry_is_an_entry():
    assert list(named_entries({"lift": {"driver": {}}})) == [("lift/driver", {})]


def test_parameter_that_nobody_reads_is_told_with_what_it_may_mean():
    tree = ParameterTree({"rate": 1.0, "cool_dwn": 3, "xyz": 1, "nfr_comfort": 1}, "/plant/reasoner")
    told = tree.strangers(("rate", "cool_down"), ("nfr_",))
    assert told == [
        "parameter /plant/reasoner/cool_dwn is left out, because nothing reads it: did you mean cool_down?",
        "parameter /plant/reasoner/xyz is left out, because nothing reads it: known are cool_down, rate",
    ]
