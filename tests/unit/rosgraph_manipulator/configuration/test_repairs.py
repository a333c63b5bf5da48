"""The section `repairs` of the configuration."""

import re

import pytest
from rosgraph_manipulator.configuration.configurations import Configuration, ConfigurationError, ManipulatorOptions
from rosgraph_manipulator.configuration.repairs import parse_repairs
from rosgraph_manipulator.io.configuration_file import options_from


def find(uri, anywhere):
    assert not anywhere
    return f"/found/{uri}"


def parse(entries, configurations=None):
    return parse_repairs(entries, configurations or {}, find)


def test_component_is_repaired_by_a_service():
    repair = parse({"gate": {"service": "/yard/gate/reset"}})["gate"]
    assert (repair.component, repair.service, repair.driver) == ("gate", "/yard/gate/reset", None)


def test_component_is_repaired_by_a_launch_file_of_a_package():
    args = {"port": "/dev/gate", "rate": 2.5, "retries": 3, "dry": True}
    launch = {"package": "yard", "file": "launch/gate.launch", "args": args}
    driver = parse({"gate": {"launch": launch}})["gate"].driver
    words = ("port:=/dev/gate", "rate:=2.5", "retries:=3", "dry:=true")
    path = "/found/package://yard/launch/gate.launch"
    assert driver == Configuration("repair_of_gate", "repair_of_gate", path, words)


def test_launch_file_without_a_package_is_a_path():
    assert (
        parse({"gate": {"launch": {"file": "/opt/gate.launch"}}})["gate"].driver.launch_file
        == "/found//opt/gate.launch"
    )


def test_drivers_are_no_configurations_of_functions():
    configurations = {"a": Configuration("a", "f", "a.launch")}
    repairs = parse({"gate": {"launch": {"file": "g"}}, "lamp": {"service": "lamp/reset"}}, configurations)
    options = ManipulatorOptions(configurations, repairs=repairs)
    assert options.all_functions == ("f",)
    assert options.drivers == {"repair_of_gate": repairs["gate"].driver}


@pytest.mark.parametrize("nothing", [None, {}])
def test_there_may_be_no_repairs(nothing):
    assert parse(nothing) == {}


@pytest.mark.parametrize(
    ("entries", "line"),
    [
        (["gate"], r"parameter 'repairs' must be of the form \{COMPONENT: .*give 'service: NAME' or"),
        ({"gate": "reset"}, "repairs/gate is 'reset': give 'service: NAME' or"),
        ({"gate": {}}, "repairs/gate: neither of service and launch given: give"),
        ({"gate": {"service": "a", "launch": {"file": "b"}}}, "repairs/gate: both of service and launch given: give"),
        ({"gate": {"service": "a", "attempts": 2}}, "repairs/gate: unknown key 'attempts'; known are: service, launch"),
        ({"gate": {"service": None}}, "repairs/gate/service is None: it must be the name of a service"),
        ({"gate": {"service": "my gate"}}, "repairs/gate/service is 'my gate'"),
        ({"gate": {"service": "gate//reset"}}, "repairs/gate/service is 'gate//reset'"),
        ({"gate": {"service": "~reset"}}, "repairs/gate/service is '~reset'"),
        ({"gate": {"launch": "gate.launch"}}, "repairs/gate/launch is 'gate.launch': give"),
        ({"gate": {"launch": {"package": "yard"}}}, "repairs/gate/launch: 'file' must name a launch file"),
        ({"gate": {"launch": {"file": 3}}}, "repairs/gate/launch: 'file' must name a launch file"),
        ({"gate": {"launch": {"file": "a", "package": 3}}}, "repairs/gate/launch: .* and 'package' a package"),
        (
            {"gate": {"launch": {"file": "a", "path": "b"}}},
            "repairs/gate/launch: unknown key 'path'; known are: package",
        ),
        ({"gate": {"launch": {"file": "a", "args": ["b:=c"]}}}, "repairs/gate/launch/args must be of the form"),
        ({"gate": {"launch": {"file": "a", "args": {"b": ["c"]}}}}, r"repairs/gate/launch/args/b is \['c'\]"),
        ({"gate": {"launch": {"file": "a", "args": {"b c": 1}}}}, "repairs/gate/launch/args/b c is 1"),
    ],
)
def test_entry_that_cannot_be_used_is_refused_with_the_place(entries, line):
    with pytest.raises(ConfigurationError, match=line) as refusal:
        parse(entries)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    "taken", [Configuration("repair_of_gate", "f", "a.launch"), Configuration("a", "repair_of_gate", "a.launch")]
)
def test_name_of_the_drivers_function_must_be_free(taken):
    with pytest.raises(ConfigurationError, match="repairs/gate: the name repair_of_gate is that of a configuration"):
        parse({"gate": {"launch": {"file": "a"}}}, {taken.name: taken})


@pytest.mark.parametrize(
    ("launch", "line"),
    [
        (
            {"file": "/no/such/gate.launch"},
            "repairs/gate/launch: there is no launch file /no/such/gate.launch: correct",
        ),
        ({"package": "no_such_package", "file": "gate.launch"}, "repairs/gate/launch: .*no_such_package"),
        ({"package": "rosgraph_manipulator", "file": "../../secret"}, "repairs/gate/launch: .*must name a file inside"),
    ],
)
def test_launch_file_that_is_missing_leaves_the_other_repairs(tmp_path, launch, line):
    file = tmp_path / "a.launch"
    file.write_text("<launch/>")
    repairs = {"gate": {"launch": launch}, "lamp": {"launch": {"file": str(file)}}}
    options = options_from({"configurations": {"a": {"launch": str(file)}}, "repairs": repairs})
    assert not options.repairs["lamp"].driver.problem
    assert re.match(line, options.repairs["gate"].driver.problem)
