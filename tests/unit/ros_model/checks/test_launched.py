"""What the checker finds in launch files."""

import pytest
from ros_model.checks.launched import LaunchedNode, LaunchFile, check_launch_file
from ros_model.io.installed import InstalledPackages


def findings(address="arm-pc", machine="arm", executable="no_such_executable"):
    node = LaunchedNode("/arm/grasp", "move_base", executable, machine)
    launch = LaunchFile("x.launch", (node,), {"arm": address, "own": "localhost"})
    return [(finding.rule, finding.message) for finding in check_launch_file(launch, InstalledPackages())]


@pytest.mark.parametrize("address", ["arm-pc", "arm_pc", "arm.local.", "192.0.2.7", "fe80::7", "a"])
def test_names_and_addresses_of_hosts_are_right(address):
    assert findings(address) == []


@pytest.mark.parametrize(
    "address",
    [
        "",
        "robot@arm-pc",
        "arm-pc:22",
        "http://arm-pc",
        "arm pc",
        "::",
        "255.255.255.255",
        "224.0.0.1",
        "192.0.2.300",
    ],
)
def test_address_that_no_host_can_have_is_named(address):
    ((rule, message),) = findings(address)
    assert rule == "host"
    assert f"x.launch: machine 'arm' has the address '{address}', which no host can have" in message


def test_machine_that_is_not_declared_is_named_with_its_node():
    ((rule, message),) = findings(machine="arn")
    assert (rule, "node /arm/grasp is for machine 'arn', which is not declared" in message) == ("host", True)


@pytest.mark.parametrize("machine", ["", "own"])
def test_executable_is_looked_for_where_this_host_starts_the_node(machine):
    ((rule, message),) = findings(machine=machine)
    assert rule == "executable"
    assert "node /arm/grasp: roslaunch finds no executable 'no_such_executable'" in message
    assert findings(machine=machine, executable="move_base") == []


def test_command_checks_a_launch_file_that_is_named(run, tmp_path):
    path = tmp_path / "arm.launch"
    node = '<node name="grasp" pkg="move_base" type="move_base" machine="arm"/>'
    path.write_text(f"<launch>{node}</launch>")
    status, told, _ = run("check", path)
    assert (status, told.count("\n")) == (1, 1)
    assert f"error: {path}: node /grasp is for machine 'arm', which is not declared" in told
    path.write_text(f'<launch><machine name="arm" address="arm-pc"/>{node}</launch>')
    assert run("check", path) == (0, "nothing is wrong\n", "")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<launch>", "roslaunch refuses it"),
        ('<launch><arg name="x" default="$(eval 1/0)"/></launch>', "division by zero"),
        ("<!DOCTYPE launch []><launch/>", "no DOCTYPE"),
        ('<launch><node name="x" type="y"/></launch>', "roslaunch refuses it"),
    ],
)
def test_launch_file_that_cannot_be_read_is_told_in_one_line(run, tmp_path, text, words):
    path = tmp_path / "bad.launch"
    path.write_text(text)
    status, told, _ = run("check", path)
    assert (status, told.count("\n")) == (2, 1)
    assert str(path) in told
    assert words in told


def test_node_without_a_name_is_named_by_its_program(run, tmp_path):
    path = tmp_path / "arm.launch"
    path.write_text('<launch><node name="" pkg="move_base" type="move_base"/></launch>')
    for command in ("check", "extract"):
        status, told, warned = run(command, path)
        assert status != 0
        assert f"{path}: a node of move_base/move_base has no name: give it one" in told + warned
