import math

import pytest
from mros1_reasoner.knowledge.model import Design, Direction, Quality
from mros1_reasoner.planning import utility as utilities
from mros1_reasoner.planning.utility import UtilityError, known_utility, make_utility
from node_kit.plugins import Plugin

QUALITIES = {"use": Quality(Direction.HIGHER_IS_BETTER), "cost": Quality()}
DESIGN = Design("d", "f", {"use": 0.9, "cost": 0.4})


def utility(wanted, design=DESIGN):
    return make_utility(wanted, QUALITIES)(design)


def test_name_of_a_quality_is_its_expected_level_towards_the_better():
    assert utility("use") == 0.9
    assert utility("cost") == -0.4


def test_unknown_quality_makes_all_designs_equal_and_is_told(caplog):
    assert utility("joy") == 0.0
    assert "no quality is called 'joy'" in caplog.text


def test_weighted_sum():
    assert utility({"weights": {"use": 2, "cost": -0.5}}) == pytest.approx(1.6)


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("use", 0.9),
        ("use - 0.5 * cost", 0.7),
        ("-cost ** 2", -0.16),
        ("max(use - 1, 0) + min(cost, 0.1, use)", 0.1),
        ("use if cost < 0.5 else 0", 0.9),
        ("sqrt(cost) / abs(-2)", math.sqrt(0.4) / 2),
        ("exp(0) + log(1)", 1.0),
        ("1 / (cost - 0.4)", -math.inf),
        ("9 ** 9 ** 9", -math.inf),
        ("sqrt(0 - use)", -math.inf),
    ],
)
def test_expression(text, result):
    assert utility({"expression": text}) == pytest.approx(result)


def test_design_without_the_level_is_of_least_use():
    assert utility({"expression": "use"}, Design("d", "f")) == -math.inf


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "use.__class__",
        "(lambda: 1)()",
        "[use][0]",
        "'use'",
        "True",
        "open('x')",
        "use; cost",
        "use :=",
        "",
        "max()",
        "max(use, key=abs)",
        "joy",
        "use < cost < 1",
        "1" * 2000,
        "(" * 500 + "use" + ")" * 500,
    ],
)
def test_expression_that_holds_anything_else_is_refused(text):
    with pytest.raises(UtilityError, match="utility"):
        make_utility({"expression": text}, QUALITIES)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"magic": 1}, "no package exports one of that name: known: .*expression.*weights"),
        ({"weights": {"joy": 1}}, "no quality is called 'joy': known: cost, use"),
        ({"weights": {"use": "much"}}, "use has the weight 'much'"),
        ({"weights": []}, "expected a mapping"),
        ({"weights": {"use": math.nan}}, "finite number"),
        ({}, "expected the name of a quality"),
        (3, "expected the name of a quality"),
    ],
)
def test_what_makes_no_sense_is_refused(wanted, message):
    with pytest.raises(UtilityError, match=message):
        make_utility(wanted, QUALITIES)


def test_package_of_a_user_adds_a_utility_function(tmp_path, monkeypatch):
    folder = tmp_path / "my_utilities"
    folder.mkdir()
    (folder / "package.xml").write_text(
        '<package format="2"><name>my_utilities</name><version>1.0.0</version><description>x</description>'
        '<maintainer email="a@b.example">a</maintainer><license>Apache-2.0</license><export>'
        '<mros1_reasoner utility="halved" function="my_utilities_code:make"/>'
        '<mros1_reasoner utility="broken" function="nowhere:make"/></export></package>'
    )
    (tmp_path / "my_utilities_code.py").write_text(
        "def make(parameters, qualities):\n    return lambda design: design.expected[parameters] / 2\n"
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.syspath_prepend(str(tmp_path))
    assert utility({"halved": "use"}) == 0.45
    with pytest.raises(UtilityError, match="utility='broken'>: nowhere:make fails: ModuleNotFoundError"):
        make_utility({"broken": None}, QUALITIES)


HUGE = [DESIGN, Design("huge", "f", {"use": 1e308, "cost": 1e308})]


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ({"weights": {"use": 1e308, "cost": -1e308}}, "of huge: ValueError: .*: correct it"),
        ({"weights": {"use": 1e308}}, "of huge is inf: have it be a finite number"),
        ({"expression": "use * 10"}, "of huge is inf"),
        ({"raises": None}, "of d: KeyError: 'joy': correct it"),
        ({"says": "much"}, "of d: ValueError"),
        ({"says": math.nan}, "of d is nan"),
        ({"says": None}, "of d: TypeError"),
    ],
)
def test_design_without_a_utility_is_named_at_the_start(wanted, said, monkeypatch):
    plugins = {"raises": lambda *_: lambda design: design.expected["joy"], "says": lambda given, _: lambda _: given}
    known = {**utilities.find("mros1_reasoner", "utility"), **{name: Made(make) for name, make in plugins.items()}}
    monkeypatch.setattr(utilities, "find", lambda *_: known)
    with pytest.raises(UtilityError, match=said) as caught:
        known_utility(wanted, QUALITIES, HUGE)
    assert "\n" not in str(caught.value)


class Made(Plugin):
    """A plug-in that is a function already."""

    def __init__(self, made):
        super().__init__("", "mros1_reasoner", "utility", "made", "")
        object.__setattr__(self, "made", made)

    def load(self):
        return self.made


def test_known_utility_is_that_of_the_function():
    found = known_utility({"expression": "use / (cost - 0.4)"}, QUALITIES, HUGE)
    assert [found(design) for design in HUGE] == [-math.inf, 1.0]


def test_expression_is_nested_so_deeply_at_most():
    assert utility({"expression": "-" * 190 + "use"}) == 0.9
    assert utility({"expression": "+".join(["cost"] * 190)}) == pytest.approx(0.4 * 190)
    with pytest.raises(UtilityError, match="nested too deeply: at most 200 levels"):
        utility({"expression": "-" * 300 + "use"})
