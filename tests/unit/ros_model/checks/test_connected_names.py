"""Connected ports whose names do not meet in the graph."""

import pytest
import yaml
from ros_model.checks.systems import check_system
from ros_model.language.system_reader import parse_system

STATION = """RosSystem {{ Name station RosComponents (
    ComponentInterface {{ name gauge {gauge_space} FromRosNode 'wells.gauge.gauge'
        RosPublishers {{ RosPublisher '{out}' {{ RefPublisher 'wells.gauge.gauge.level' }} }} }},
    ComponentInterface {{ name pump {pump_space} FromRosNode 'wells.pump.pump'
        RosSubscribers {{ RosSubscriber '{into}' {{ RefSubscriber 'wells.pump.pump.level' }} }}
        RosParameters {{ RosParameter power {{ RefParameter 'wells.pump.pump.power' value 1 }} }} }} )
    TopicConnections {{ TopicConnection '{topic}' {{ From ( 'gauge.{out}' ) To ( 'pump.{into}' ) }} }} }}"""


def station(out="level", into="level", topic="level", gauge="", pump=""):
    spaces = {"gauge_space": gauge and f"NameSpace {gauge}", "pump_space": pump and f"NameSpace {pump}"}
    return STATION.format(out=out, into=into, topic=topic, **spaces)


def told(text, started=None):
    return [finding.message for finding in check_system(parse_system(text), started=started)]


@pytest.mark.parametrize("names", [{"out": "/level", "pump": "well"}, {"into": "/level", "gauge": "well"}])
def test_absolute_name_that_misses_the_relative_one_of_another_namespace_is_told(names):
    (message,) = told(station(**names))
    assert "is /level" in message
    assert "is /well/level" in message
    assert "remaps one" in message


@pytest.mark.parametrize(
    "names",
    [
        {},
        {"out": "/level"},
        {"out": "/well/level", "pump": "well"},
        {"gauge": "well", "into": "well/level"},
        {"gauge": "well", "pump": "well"},
        {"out": "depth", "into": "height"},  # the launch file that is made of it remaps both
    ],
)
def test_names_that_meet_or_are_remapped_by_the_launch_file_are_not_told(names):
    assert told(station(**names)) == []


def test_component_that_runs_already_must_have_the_name_to_which_the_started_one_is_remapped():
    assert told(station(out="depth", into="height", topic="depth"), {"pump"}) == []
    (message,) = told(station(out="depth", into="height", topic="level"), {"pump"})
    assert "'gauge.depth' is /depth in the graph, but 'pump.height' is /level" in message


def test_project_is_told_once_for_all_variants(run, tmp_path):
    (tmp_path / "station.rossystem").write_text(station(out="depth"))
    (tmp_path / "variants.csv").write_text("name,pump.power\nfull,1\nhalf,2\n")
    settings = {
        "package": "wells",
        "base": "station.rossystem",
        "variants": {"component": "pump", "table": "variants.csv"},
        "functions": {"f": {"designs": "all"}},
        "quality_attributes": {"q": {"direction": "lower_is_better"}},
        "utility": "q",
        "objectives": {"o": {"function": "f"}},
    }
    (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(settings))
    status, text = run("check", tmp_path)[:2]
    assert status == 0
    assert text.count("in the graph") == 1
