"""Whose a diagnostic is, where several robots share a master or a bag."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_bags.bag import read_record
from metacontrol_bags.ownership import hardware_id_of, is_of_another, is_own, marked, robot_of, robots_inside

NAMES = st.text("ab_1", min_size=1, max_size=3)
NAMESPACES = st.lists(NAMES, max_size=3).map(lambda parts: "/" + "/".join(parts))
FOREIGN = st.sampled_from(["", "none", "Hokuyo H0905365", "/dev/ttyUSB0", "192.168.0.10", "robot"])


@pytest.mark.parametrize(
    ("namespace", "publisher", "hardware_id", "expected"),
    [
        ("/cell_1", "/cell_1/rosgraph_monitor", "", True),
        ("/cell_1/", "/cell_1/arm/driver", "Hokuyo H0905365", True),
        ("cell_1", "/cell_1/driver", "none", True),
        ("/cell_1", "/cell_2/driver", "", False),
        ("/cell_1", "/cell_10/driver", "", False),
        ("/cell_1", "/driver", "/dev/ttyUSB0", False),
        ("/cell_1", "/driver", "cell_1", True),
        ("/cell_1", "/driver", "/cell_1/gripper", True),
        ("/cell_1", "/play_17", "robot:/cell_1", True),
        ("/cell_1", "/cell_1/relay", "robot:/cell_2", False),
        ("/cell_1", "/cell_1/arm/rosgraph_monitor", "robot:/cell_1/arm", False),
        ("/", "/cell_2/driver", "/dev/ttyUSB0", True),
        ("/", "/cell_2/rosgraph_monitor", "robot:/cell_2", False),
        ("/", "/rosgraph_monitor", "robot:/", True),
    ],
)
def test_publisher_and_hardware_tell_whose_a_status_is(namespace, publisher, hardware_id, expected):
    assert is_own(namespace, publisher, hardware_id) is expected


@pytest.mark.parametrize(
    ("namespace", "nodes", "expected"),
    [
        ("/", ["/rosgraph_monitor", "/rosgraph_manipulator", "/arm/driver", "/arm/reasoner"], set()),
        ("/", ["/cell_2/rosgraph_monitor", "/cell_3/rosgraph_manipulator", "/cell_4/driver"], {"/cell_2", "/cell_3"}),
        ("/cell_1/", ["/cell_1/rosgraph_monitor", "/cell_2/rosgraph_monitor"], set()),
        ("/cell_1", ["/cell_1/arm/rosgraph_monitor", "/cell_10/rosgraph_monitor"], {"/cell_1/arm"}),
        ("/cell_1", ["/rosgraph_monitor"], set()),
    ],
)
def test_namespace_with_a_meta_controller_is_another_robots(namespace, nodes, expected):
    assert robots_inside(namespace, nodes) == expected


def test_node_is_of_the_robot_whose_namespace_it_is_in():
    assert is_of_another("/cell_2/arm/driver", {"/cell_2"})
    assert not is_of_another("/cell_20/driver", {"/cell_2"})
    assert not is_of_another("/driver", set())


def test_topic_of_another_name_is_the_robots_own():
    assert is_own("/cell_1", "/driver", "", topic="/cell_1/diagnostics")
    assert not is_own("/cell_1", "/driver", "robot:/cell_2", topic="/all_diagnostics")


@given(NAMESPACES, st.lists(NAMES, min_size=1, max_size=2), FOREIGN)
def test_lone_robot_in_the_root_heeds_every_foreign_driver(namespace, name, hardware_id):
    assert is_own("/", f"{namespace}/{'/'.join(name)}".replace("//", "/"), hardware_id)


@given(NAMESPACES, NAMESPACES, FOREIGN)
def test_two_robots_beside_each_other_never_heed_the_same_status(one, two, hardware_id):
    if f"{one}/".startswith(f"{two}/") or f"{two}/".startswith(f"{one}/") or "/" in (one, two):
        return
    publisher = f"{one}/node"
    assert is_own(one, publisher, hardware_id)
    assert not is_own(two, publisher, hardware_id)


@given(NAMESPACES, NAMESPACES, NAMESPACES)
def test_what_a_meta_controller_says_is_heeded_by_its_own_robot_alone(namespace, other, publisher):
    said = hardware_id_of(namespace)
    assert robot_of(said) == namespace
    assert is_own(other, publisher, said) is (namespace == other)


@given(NAMESPACES, st.one_of(FOREIGN, NAMESPACES))
def test_status_of_an_unknown_publisher_is_heeded_unless_it_names_another_robot(namespace, hardware_id):
    assert is_own(namespace, "", hardware_id)


def test_record_of_a_mission_lacks_what_other_robots_say(mission_bag, tmp_path):
    before = read_record(mission_bag.write(tmp_path / "alone.bag"))
    mission_bag.diagnostic(13.0, "Component status", "gripper", "FALSE", hardware_id="robot:/cell_2")
    mission_bag.diagnostic(13.0, "Component status", "wheel", "FALSE", hardware_id="Acme wheel 7")
    after = read_record(mission_bag.write(tmp_path / "beside.bag"))
    components = [{report.component for report in record.components} for record in (before, after)]
    assert components[1] - components[0] == {"wheel"}


def test_observers_of_two_robots_are_told_apart_in_a_bag_that_a_third_node_plays():
    player = "/play_1764"
    amber, root = marked("FreshnessObserver", "/amber/"), marked("FreshnessObserver", "/")
    assert is_own("/amber", player, amber)
    assert not is_own("/basil", player, amber)
    assert not is_own("/", player, amber)
    assert is_own("/", player, root)
    assert not is_own("/amber", player, root)
    assert marked("", "/amber") == marked("robot:/amber", "/") == "robot:/amber"
    assert root == "FreshnessObserver"
