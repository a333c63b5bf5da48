"""Names that resolve to the same are one: models from source write `/dock`, those of running systems `dock`."""

from pathlib import Path

import pytest
from ros_model.checks.systems import check_system
from ros_model.io import installed as installed_module
from ros_model.io.project import load_project
from ros_model.language.library import Library
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
SYSTEM = """RosSystem {{ Name x RosComponents (
    ComponentInterface {{ name wheels NameSpace cart FromRosNode 'carts.wheels.py.rear_wheels'
        RosPublishers {{ RosPublisher out {{ RefPublisher 'carts.wheels.py.rear_wheels.{ref}' }} }} }},
    ComponentInterface {{ name odometer FromRosNode 'carts.odometer.py.odometer'
        RosSubscribers {{ RosSubscriber ticks {{ RefSubscriber 'carts.odometer.py.odometer.ticks' }} }} }} )
    TopicConnections {{ TopicConnection ticks {{ From ( 'wheels.out' ) To ( 'odometer.ticks' ) }} }} }}"""


def source(name, kind="std_msgs.Float32", node="rear_wheels"):
    return f"""PackageSet {{ CatkinPackage carts {{
        Artifact wheels.py {{ Node {{ name {node} Publishers {{ Publisher {{ name '{name}' message '{kind}' }} }} }} }},
        Artifact odometer.py {{ Node {{ name odometer
            Subscribers {{ Subscriber {{ name '/ticks' message 'std_msgs.Float32' }} }} }} }} }} }}"""


def found(reference, *models):
    library = Library(package for text in models for package in parse_packages(text).packages)
    return [finding.message for finding in check_system(parse_system(SYSTEM.format(ref=reference)), library=library)]


@pytest.mark.parametrize(
    ("reference", "declared"),
    [
        ("ticks", "ticks"),
        ("ticks", "/cart/ticks"),
        ("/cart/ticks", "ticks"),
        ("~ticks", "wheels/ticks"),
        ("wheels/ticks", "~ticks"),
        ("/cart/wheels/ticks", "~ticks"),
        ("/ticks", "/ticks"),
    ],
)
def test_reference_leads_to_what_resolves_to_the_same(reference, declared):
    assert found(reference, source(declared)) == []
    (message,) = found(reference, source(declared, kind="std_msgs.String"))
    assert "'odometer.ticks' is std_msgs/Float32, but 'wheels.out' is std_msgs/String" in message


@pytest.mark.parametrize(("reference", "declared"), [("ticks", "/ticks"), ("/ticks", "ticks"), ("ticks", "~ticks")])
def test_reference_to_what_resolves_to_something_else_is_told_with_what_there_is(reference, declared):
    (message,) = found(reference, source(declared))
    assert f"declares no publisher '{reference}'" in message
    assert f"'{declared}'" in message or f"it declares {declared}" in message


def test_executable_that_runs_under_another_name_has_what_its_source_declares():
    running = source("~/ticks", node="rear_wheels").replace("'~/ticks'", "'ticks'")
    told = found("lamp", running, source("lamp", node="wheels_node"))
    assert told == found("lamp", source("lamp", node="wheels_node"), running) == []


def test_two_nodes_that_one_model_declares_of_an_executable_are_two():
    both = source("ticks").replace(
        "Node { name rear_wheels",
        "Node { name front_wheels Publishers { Publisher { name lamp } } }, Node { name rear_wheels",
    )
    (message,) = found("lamp", both)
    assert "declares no publisher 'lamp': it declares ticks" in message


BASE = """RosSystem { Name yard RosComponents (
    ComponentInterface { name 'crane' FromRosNode 'yards.crane.py.crane'
        RosActionServers { RosActionServer 'lift_box' { RefServer 'yards.crane.py.crane.lift_box' } }
        RosPublishers { RosPublisher 'crane/load' { RefPublisher 'yards.crane.py.crane.~load' } } },
    ComponentInterface { name 'stacker' FromRosNode 'yards.stacker.py.stacker' } ) }"""
RUNNING = """PackageSet { CatkinPackage yards {
    Artifact crane.py { Node { name crane ActionServers { ActionServer { name lift_box action 'actionlib.Test' } }
        Publishers { Publisher { name 'crane/load' message 'std_msgs.Float32' } } } },
    Artifact stacker.py { Node { name stacker } } } }"""
SOURCE = """PackageSet { CatkinPackage yards { Artifact stacker.py { Node { name stacker_node
    ActionClients { ActionClient { name '/lift_box' action 'actionlib.Test' } }
    Subscribers { Subscriber { name '/crane/load' message 'std_msgs.Float32' },
        Subscriber { name '~weight' message 'std_msgs.Float32' } } } } } }"""
SETTINGS = """package: yards
base: yard.rossystem
variants:
  component: stacker
  table: v.csv
  connections:
    how:
      by_crane: [CONNECTION]
      by_hand: []
functions: {f: {designs: all}}
quality_attributes: {speed: {direction: higher_is_better}}
utility: speed
objectives: {o: {function: f}}
components: {}
"""


@pytest.fixture
def yard(tmp_path, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}:{SOURCES}")
    installed_module._packages.cache_clear()

    def write(connection):
        (tmp_path / "package.xml").write_text(
            "<package format='2'><name>yards</name><version>0.1.0</version><description>x</description>"
            "<maintainer email='a@b.example'>a</maintainer><license>x</license></package>"
        )
        for name in ("crane.py", "stacker.py"):
            (tmp_path / name).write_text("#!/usr/bin/env python3\n")
            (tmp_path / name).chmod(0o755)
        models = tmp_path / "models"
        models.mkdir(exist_ok=True)
        for name, text in (("yard.rossystem", BASE), ("running.ros", RUNNING), ("source.ros", SOURCE)):
            (models / name).write_text(text)
        (models / "v.csv").write_text("name,how\nlifting,by_crane\nhoisting,by_crane\nbare,by_hand\n")
        (models / "metacontrol.yaml").write_text(SETTINGS.replace("CONNECTION", connection))
        return models

    yield write
    installed_module._packages.cache_clear()


@pytest.mark.parametrize(
    "connection",
    [
        "crane.lift_box",
        "crane./lift_box",
        "{from: crane.lift_box, to: stacker.lift_box}",
        "{from: crane./lift_box, to: stacker./lift_box}",
        "crane.crane/load",
        "crane.~load",
        "crane./crane/load",
        "{from: crane.~load, to: stacker./crane/load}",
        "{from: crane.~load, to: stacker.~weight}",
        "{from: crane.crane/load, to: stacker.stacker/weight}",
    ],
)
def test_connection_may_name_its_ports_in_any_way_that_resolves_to_them(run, yard, tmp_path, connection):
    models = yard(connection)
    status, out, _ = run("check", models)
    assert (status, "error" in out, "warning" in out) == (0, False, False)
    assert load_project(models).required_components()["lifting"] == {"crane"}
    assert run("generate", "launch", models, "-o", tmp_path)[0] == 0


def test_wrong_connection_is_told_once_where_it_is_written_and_generate_refuses_it(run, yard, tmp_path):
    models = yard("{from: crane.lift_box, to: stacker.lift_bex}")
    status, out, _ = run("check", models)
    told = [line for line in out.splitlines() if "error" in line]
    place = f"{models}/metacontrol.yaml:8:18"
    assert status == 1
    assert told == [
        f"{place}: error: 'yards.stacker.py.stacker' declares no action client 'lift_bex': did you mean '/lift_box'?"
    ]
    status, out, err = run("generate", "all", models, "-o", tmp_path)
    assert (status, out) == (2, "")
    assert err.startswith(f"rosmodel: {place}: 'yards.stacker.py.stacker' declares no action client 'lift_bex'")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["crane.py", "models", "package.xml", "stacker.py"]


@pytest.mark.parametrize(
    ("connection", "message"),
    [
        ("crane.lift_bix", "lift_bix is no publisher or server in MODELS/yard.rossystem: did you mean 'crane.l"),
        ("{from: crane.lift_box, to: /lift_box}", "[0].to: is '/lift_box', must be COMPONENT.PORT, as camera.image"),
    ],
)  # fmt: skip
def test_connection_that_begins_or_ends_nowhere_is_told_with_a_remedy(run, yard, connection, message):
    models = yard(connection)
    status, out, _ = run("check", models)
    assert status == 1
    assert message.replace("MODELS", str(models)) in out


REMAPPED = """RosSystem { Name x RosComponents ( ComponentInterface { name hoist FromRosNode 'cranes.hoist.py.hoist'
    RosPublishers { RosPublisher tf { RefPublisher 'cranes.hoist.py.hoist./tf' } }
    RosSubscribers { RosSubscriber 'hook/load' { RefSubscriber 'cranes.hoist.py.hoist.CODE' } } } ) }"""
SEEN = """// The running system. Written by rosmodel snapshot.
PackageSet { CatkinPackage cranes { Artifact hoist.py { Node { name hoist
    Publishers { Publisher { name '/tf' message 'tf2_msgs.TFMessage' } }
    Subscribers { Subscriber { name 'CODE' message 'std_msgs.Float32' } } } } } }"""
WRITTEN = """PackageSet { CatkinPackage cranes { Artifact hoist.py { Node { name main
    Subscribers { Subscriber { name '~load' message 'std_msgs.Float32' } } } } } }"""


@pytest.mark.parametrize(
    ("code", "sources", "warned"),
    [
        ("/hook/load", [WRITTEN], True),
        ("weight", [WRITTEN], True),
        ("hook/load", [WRITTEN], False),  # not remapped
        ("~load", [WRITTEN], False),
        ("hoist/load", [WRITTEN], False),
        ("/hook/load", [], False),
        ("/hook/load", [WRITTEN.replace("hoist.py", "tower.py")], False),
    ],
)
def test_remapped_name_that_only_a_snapshot_declares_is_a_warning(run, tmp_path, code, sources, warned):
    for name, text in (("x.rossystem", REMAPPED), ("seen.ros", SEEN), *(("w.ros", text) for text in sources)):
        (tmp_path / name).write_text(text.replace("CODE", code))
    status, out, _ = run("check", tmp_path / "x.rossystem")
    message = f"warning: the source of 'cranes.hoist.py' declares no subscriber '{code}': it declares ~load."
    told = [line for line in out.splitlines() if "the source of" in line]
    assert ["x.rossystem:3:" in line and message in line for line in told] == [True] * warned
    assert status == int("error:" in out)
