"""What goes wrong, and when: texts, YAML and moments."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_experiments.contingency.contingency import (
    AT_START,
    Contingency,
    Kind,
    Moment,
    contingencies_due,
    with_seed,
)
from metacontrol_experiments.contingency.parsing import (
    DEFAULT_SHARE,
    ComponentError,
    ContingencyError,
    node_of,
    parse_contingency,
)
from metacontrol_experiments.io.input_files import read_components, read_contingencies
from metacontrol_experiments.mission.routes import Route
from metacontrol_experiments.mission.settings import Settings
from robot_formulas.geometry import Pose

MODELS = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim/models/metacontrol.yaml"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("kill:front_laser@share:0.4", Contingency(Kind.KILL, Moment(share=0.4), target="front_laser")),
        ("freeze:/ns/camera@time:3", Contingency(Kind.FREEZE, Moment(time=3.0), target="/ns/camera")),
        ("clutter:7", Contingency(Kind.CLUTTER, AT_START, count=7)),
        ("power:1.6", Contingency(Kind.POWER, Moment(share=DEFAULT_SHARE), value=1.6)),
        ("light:0@place:1.5,-2", Contingency(Kind.LIGHT, Moment(place=(1.5, -2.0)), value=0.0)),
        ("light:0.5@place:1,2,3", Contingency(Kind.LIGHT, Moment(place=(1.0, 2.0), within=3.0), value=0.5)),
    ],
)
def test_text_is_understood_and_written_again(text, expected):
    assert parse_contingency(text) == expected
    assert parse_contingency(str(expected)) == expected


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nonsense", "expected KIND:WHAT"),
        ("kill:", "expected KIND:WHAT"),
        ("kill:a@share", "expected KIND:WHAT"),
        ("explode:a", "no kind 'explode'; there are kill, stop"),
        ("power:much", "power: is 'much'; give a finite number"),
        ("power:nan", "power: is 'nan'"),
        ("power:-1", "power: is -1; give a number 0 or more"),
        ("light:2", r"light: is 2; give a number from 0 \(dark\) to 1"),
        ("clutter:1.5", "clutter: is '1.5'; give a whole number from 0 to 100"),
        ("clutter:5000", "whole number"),
        ("kill:a@share:1.5", "share: is 1.5; give 0 to 1"),
        ("kill:a@time:-1", "time: is -1; give 0 or more seconds"),
        ("kill:a@moon:1", "give one of share, time"),
        ("kill:a@place:1", "place: is '1'; give x and y"),
        ("kill:a@place:1,2,0", "within is 0"),
    ],
)
def test_text_that_makes_no_sense_is_refused_in_one_line(text, said):
    with pytest.raises(ContingencyError, match=said) as caught:
        parse_contingency(text)
    assert "\n" not in str(caught.value)


def test_yaml_timeline_is_read(tmp_path):
    path = tmp_path / "timeline.yaml"
    path.write_text(
        "contingencies:\n"
        "  - {at: {share: 0.6}, kill: front_laser}\n"
        "  - {at: {place: [1, 2], within: 0.5}, power: 1.6}\n"
        "  - {clutter: {count: 7, seed: 3}}\n"
        "  - {at: {time: 5}, clutter: [[1, 2], [3, 4]]}\n"
    )
    assert read_contingencies(path) == (
        Contingency(Kind.KILL, Moment(share=0.6), target="front_laser"),
        Contingency(Kind.POWER, Moment(place=(1.0, 2.0), within=0.5), value=1.6),
        Contingency(Kind.CLUTTER, AT_START, count=7, seed=3),
        Contingency(Kind.CLUTTER, Moment(time=5.0), places=((1.0, 2.0), (3.0, 4.0))),
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [", "correct the YAML"),
        ("[]", "needs the key contingencies"),
        ("contingencies: {}", "needs the key contingencies"),
        ("contingencies: [7]", r"contingencies\[0\]: is 7"),
        ("contingencies: [{at: {time: 1}}]", r"contingencies\[0\]: needs one kind beside `at`, has none"),
        ("contingencies: [{kill: a, power: 1}]", "has kill, power"),
        ("contingencies: [{true: 1}]", r"contingencies\[0\]: no kind 'True'; there are kill"),
        ("contingencies: [{true: 1, kill: a}]", "has True, kill"),
        ("contingencies: [{kill: 3}]", "kill: is 3; give a component"),
        ("contingencies: [{at: 3, kill: a}]", "at is 3"),
        ("contingencies: [{at: {time: 1, share: 1}, kill: a}]", "give one of share"),
        ("contingencies: [{at: {time: true}, kill: a}]", "time: is True"),
        ("contingencies: [{clutter: [[1]]}]", r"\[1\] is no place"),
        ("contingencies: [{clutter: []}]", "whole number from 1"),
        ("contingencies: [{clutter: {number: 3}}]", "count: N, seed: N"),
    ],
)
def test_bad_timeline_is_refused_with_file_and_entry(tmp_path, text, said):
    path = tmp_path / "timeline.yaml"
    path.write_text(text)
    with pytest.raises(ContingencyError, match=said) as caught:
        read_contingencies(path)
    assert "timeline.yaml" in str(caught.value) and "\n" not in str(caught.value)


def test_missing_timeline_is_refused(tmp_path):
    with pytest.raises(ContingencyError, match="No such file or directory: check the path"):
        read_contingencies(tmp_path / "none.yaml")


@given(st.floats(0, 1), st.floats(0, 300), st.floats(-10, 10), st.floats(-10, 10))
def test_what_has_struck_is_never_due_again(share, elapsed, x, y):
    plan = tuple(map(parse_contingency, ("kill:a@share:0.5", "power:2@time:100", "light:0@place:0,0,5")))
    due = contingencies_due(plan, frozenset(), share, elapsed, x, y)
    assert (
        set(due) == {index for index, met in enumerate((share >= 0.5, elapsed >= 100, x * x + y * y <= 25)) if met}
        or pytest.approx(25.0) == x * x + y * y
    )
    assert contingencies_due(plan, frozenset(due), share, elapsed, x, y) == ()


def test_mission_gives_its_seed_to_clutter_without_one():
    plan = (Contingency(Kind.CLUTTER, count=1), Contingency(Kind.CLUTTER, count=1, seed=9))
    assert [entry.seed for entry in with_seed(plan, 4)] == [4, 9]


def test_broken_component_is_called_as_the_trigger_of_a_decision():
    for kind in ("kill", "stop", "freeze"):
        assert parse_contingency(f"{kind}:camera").event == "component:camera"
    for kind in ("thaw", "repeat", "jump"):
        assert parse_contingency(f"{kind}:camera").event == f"{kind}:camera"
    assert [parse_contingency(text).event for text in ("power:1.60", "clutter:7")] == ["power:1.6", "clutter:7"]


def test_nodes_of_components_come_from_the_models(tmp_path):
    components = read_components(MODELS)
    assert node_of("front_laser", components) == "front_laser"
    assert node_of("/any/node", components) == "/any/node"
    with pytest.raises(ComponentError, match="no component 'warp_drive'; there are front_laser"):
        node_of("warp_drive", components)
    with pytest.raises(ComponentError, match="No such file or directory: check the path"):
        read_components(tmp_path / "none.yaml")


def test_mission_tells_its_contingencies(tmp_path):
    texts = ("clutter:7", "kill:front_laser@share:0.4", "power:1.4@time:3")
    settings = Settings(
        Route("r1", Pose(0.0, 0.0), Pose(5.0, 0.0)), tmp_path, contingencies=tuple(map(parse_contingency, texts))
    )
    told = settings.describe()
    assert (told["clutter"], told["failure"], told["power_factor"]) == ("7", "front_laser", "1.4")
    assert told["contingencies"] == "clutter:7@time:0 kill:front_laser@share:0.4 power:1.4@time:3"
    assert [entry.seed for entry in settings.plan.contingencies] == [1, 1, 1]
