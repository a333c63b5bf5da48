"""What differs between two models, whatever the order, the spelling and the names of connections."""

import pytest
from ros_model.cli.rosmodel import main
from ros_model.language.difference import differences
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

SYSTEM = """RosSystem { Name x RosComponents (
    ComponentInterface { name arm NameSpace left FromRosNode 'p.arm.arm'
        RosPublishers { RosPublisher joints { RefPublisher 'p.arm.arm.joints' } }
        RosParameters { RosParameter r { RefParameter 'p.arm.arm.rate' value 50 } } },
    ComponentInterface { name plan RosSubscribers { RosSubscriber joints { RefSubscriber 'p.plan.plan.joints' } } } )
    TopicConnections { TopicConnection c { From ( 'arm.joints' ) To ( 'plan.joints' ) } }
    Parameters { Parameter { name qa_speed type Double value 0.5 } } }"""
PACKAGES = """PackageSet { CatkinPackage p {
    Specs { TopicSpec T { message { int8 a } } }
    Artifact a { Node { name n
        Publishers { Publisher { name x message 'std_msgs.String' } }
        Parameters { Parameter { name r type Double default 1.0 } } } }
    Dependencies { PackageDependency roscpp } } }"""


def changes(old, new, text=SYSTEM, parse=parse_system):
    assert text.count(old) >= 1
    return [str(difference) for difference in differences(parse(text), parse(text.replace(old, new)))]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("Name x", "Name y"),
        ("TopicConnection c", "TopicConnection other"),
        ("RosPublisher joints", "RosPublisher '/joints'"),
        ("value 50", "value 50.0"),
        ("name qa_speed", "name '/qa_speed'"),
    ],
)
def test_names_of_connections_and_spellings_are_no_difference(old, new):
    assert changes(old, new) == []


def test_namespace_may_be_part_of_the_name():
    other = SYSTEM.replace("name arm NameSpace left", "name '/left/arm'").replace("'arm.joints'", "'/left/arm.joints'")
    assert differences(parse_system(SYSTEM), parse_system(other)) == ()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("value 50", "value 25", ["~ component 'left/arm', parameter 'rate': 50 -> 25"]),
        ("value 50", "value '50'", ["~ component 'left/arm', parameter 'rate': 50 -> '50'"]),
        ("value 50", "value true", ["~ component 'left/arm', parameter 'rate': 50 -> true"]),
        ("value 50", "", ["~ component 'left/arm', parameter 'rate': 50 -> nothing"]),
        ("'p.arm.arm'", "'p.arm.other'", ["~ component 'left/arm': p.arm.arm -> p.arm.other"]),
        (
            "'p.arm.arm.joints'",
            "'p.arm.arm.state'",
            ["~ component 'left/arm', publisher 'joints': 'joints' -> 'state'"],
        ),
        (
            "RosPublisher joints {",
            "RosPublisher state {",
            ["- component 'left/arm', publisher 'joints'", "+ component 'left/arm', publisher 'state'"],
        ),
        ("value 0.5", "value 0.6", ["~ parameter 'qa_speed': Double 0.5 -> Double 0.6"]),
        (
            "From ( 'arm.joints' )",
            "From ( 'plan.joints' )",
            [
                "- topic connection 'left/arm.joints' to 'plan.joints'",
                "+ topic connection 'plan.joints' to 'plan.joints'",
            ],
        ),
        ("name plan ", "name planner ", ["- component 'plan'", "+ component 'planner'"]),
    ],
)
def test_difference_of_systems(old, new, expected):
    assert changes(old, new) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("std_msgs.String", "std_msgs.Bool", ["publisher 'x': std_msgs/String -> std_msgs/Bool"]),
        ("default 1.0", "default 2.0", ["parameter 'r': Double default 1.0 -> Double default 2.0"]),
        ("Publisher {", "Publisher { name y }, Publisher {", ["publisher 'y'"]),
        ("Artifact a", "Artifact b", ["- package 'p', artifact 'a'", "+ package 'p', artifact 'b'"]),
        ("int8 a", "int8 b", ["topic specification 'T': message { int8 a } -> message { int8 b }"]),
        ("roscpp", "rospy", ["- package 'p', dependency 'roscpp'", "+ package 'p', dependency 'rospy'"]),
        ("CatkinPackage p", "CatkinPackage q", ["- package 'p'", "+ package 'q'"]),
    ],
)
def test_difference_of_packages(old, new, expected):
    found = changes(old, new, PACKAGES, parse_packages)
    assert len(found) == len(expected)
    assert all(text.endswith(end) for text, end in zip(found, expected, strict=True))


@pytest.fixture
def diff(capsys, tmp_path):
    def run(first, second, names=("a.rossystem", "b.rossystem")):
        for name, text in zip(names, (first, second), strict=True):
            (tmp_path / name).write_text(text)
        with pytest.raises(SystemExit) as done:
            main(["diff", *(str(tmp_path / name) for name in names)])
        captured = capsys.readouterr()
        return done.value.code, captured.out, captured.err

    return run


def test_command_tells_lines_and_status_1(diff):
    status, out, _ = diff(SYSTEM, SYSTEM.replace("value 50", "value 25"))
    assert (status, out) == (1, "~ component 'left/arm', parameter 'rate': 50 -> 25\n")


def test_command_is_silent_where_nothing_differs(diff):
    assert diff(SYSTEM, SYSTEM) == (0, "", "")


def test_command_compares_packages(diff):
    status, out, _ = diff(PACKAGES, PACKAGES.replace("1.0", "2.0"), ("a.ros", "b.ros"))
    assert status == 1
    assert "artifact 'a', node 'n', parameter 'r'" in out


def test_models_of_two_languages_are_refused(diff):
    status, _, err = diff(SYSTEM, PACKAGES, ("a.rossystem", "b.ros"))
    assert status == 2
    assert "are not in one language" in err
