"""The checker across files: references to what `.ros` models declare, the types of connected ports, families."""

import json
import os
from pathlib import Path

import pytest
from ros_model.checks.families import check_family, families
from ros_model.checks.packages import check_packages
from ros_model.checks.systems import check_system
from ros_model.cli.rosmodel import main
from ros_model.io.installed import InstalledPackages
from ros_model.language.library import Library, NothingInstalled
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system

CORPUS = os.environ.get("MROS_CORPUS")

NOTHING = "nothing is wrong\n"
PACKAGES = """PackageSet { CatkinPackage arm { Artifact arm_node { Node { name arm
    Publishers { Publisher { name joints message 'sensor_msgs.JointState' },
        Publisher { name odom message 'nav_msgs.Odometry' } }
    Subscribers { Subscriber { name joints_in message 'sensor_msgs.JointState' } }
    ServiceServers { ServiceServer { name reset service 'std_srvs.Trigger' } }
    ServiceClients { ServiceClient { name ask service 'std_srvs.SetBool' },
        ServiceClient { name again service 'std_srvs.Trigger' } }
    ActionServers { ActionServer { name move action 'actionlib.Test' } }
    ActionClients { ActionClient { name go action 'move_base_msgs.MoveBase' } }
    Parameters { Parameter { name rate type Double }, Parameter { name axes type List { String, String } } }
} } } }"""

SYSTEM = """RosSystem { Name x RosComponents ( ComponentInterface { name a FromRosNode 'arm.arm_node.arm'
    RosPublishers { RosPublisher joints { RefPublisher 'arm.arm_node.arm.joints' },
        RosPublisher odom { RefPublisher 'arm.arm_node.arm.odom' } }
    RosSubscribers { RosSubscriber joints_in { RefSubscriber 'arm.arm_node.arm.joints_in' } }
    RosSrvServers { RosServiceServer reset { RefServer 'arm.arm_node.arm.reset' } }
    RosSrvClients { RosServiceClient ask { RefClient 'arm.arm_node.arm.ask' },
        RosServiceClient again { RefClient 'arm.arm_node.arm.again' } }
    RosActionServers { RosActionServer move { RefServer 'arm.arm_node.arm.move' } }
    RosActionClients { RosActionClient go { RefClient 'arm.arm_node.arm.go' } }
    RosParameters { RosParameter rate { RefParameter 'arm.arm_node.arm.rate' value 5 } }
} )
TopicConnections { TopicConnection joints { From ( 'a.joints' ) To ( 'a.joints_in' ) } }
ServiceConnections { ServiceConnection reset { From ( 'a.reset' ) To 'a.again' } }
}"""


def library(*texts):
    return Library((package for text in texts for package in parse_packages(text).packages), InstalledPackages())


def found(text, *models):
    return [
        str(finding) for finding in check_system(parse_system(text, "m"), library=library(*(models or (PACKAGES,))))
    ]


def faults(text, *others):
    packages = parse_packages(text, "p")
    return [str(finding) for finding in check_packages(packages, library(text, *others))]


def test_sound_system_has_no_findings():
    assert found(SYSTEM) == []


def test_what_several_models_declare_of_a_node_is_known_together():
    running = PACKAGES.replace("name joints ", "name '/joints' ").replace("name rate", "name '/rate'")
    both = SYSTEM.replace(".arm.joints'", ".arm./joints'")
    assert found(both, PACKAGES, running) == found(both, running, PACKAGES) == []
    assert "value 'fast' of 'rate' is no Double" in found(SYSTEM.replace("value 5", "value fast"), running, PACKAGES)[0]


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        (
            "FromRosNode 'arm.",
            "FromRosNode 'amr.",
            "m:1:76: error: no .ros model declares package 'amr': did you mean 'arm'?",
        ),
        (
            "FromRosNode 'arm.arm_node",
            "FromRosNode 'arm.arm_nod",
            "package 'arm' declares no artifact 'arm_nod': did you mean 'arm_node'?",
        ),
        (
            "FromRosNode 'arm.arm_node.arm",
            "FromRosNode 'arm.arm_node.leg",
            "artifact 'arm.arm_node' declares no node 'leg'",
        ),
        ("arm.odom'", "arm.odm'", "'arm.arm_node.arm' declares no publisher 'odm': did you mean 'odom'?"),
        (
            "RefPublisher 'arm.arm_node.arm.odom'",
            "RefPublisher 'arm.arm_node.arm.joints_in'",
            "'joints_in' as a subscriber, not a publisher",
        ),
        ("arm.rate'", "arm.speed'", "m:10:54: error: 'arm.arm_node.arm' declares no parameter 'speed'"),
        ("value 5", "value fast", "m:10:84: error: the value 'fast' of 'rate' is no Double, as it is declared"),
        ("FromRosNode 'arm.arm_node.arm", "FromRosNode 'arm./arm.arm", "package 'arm' declares no artifact '/arm'"),
        (
            "arm.rate' value 5",
            "arm.axes' value {x}",
            "the value ['x'] of 'axes' has 1 member, List { String, String } has 2, as",
        ),
        (
            "From ( 'a.joints' )",
            "From ( 'a.odom' )",
            "m:12:68: error: connection 'joints': 'a.joints_in' is sensor_msgs/JointState, but 'a.odom' is nav_msgs",
        ),
        (
            "From ( 'a.joints' )",
            "From ( 'a.joints', 'a.odom' )",
            "'a.odom' is nav_msgs/Odometry, but 'a.joints' is sensor_msgs/JointState",
        ),
        (
            "To 'a.again'",
            "To 'a.ask'",
            "m:13:70: error: connection 'reset': 'a.ask' is std_srvs/SetBool, but 'a.reset' is std_srvs/Trigger",
        ),
        (
            "ServiceConnections {",
            "ActionConnections { ActionConnection move { From 'a.move' To 'a.go' } } ServiceConnections {",
            "'a.go' is move_base_msgs/MoveBase, but 'a.move' is actionlib/Test",
        ),
    ],
)
def test_reference_that_leads_astray_is_found(old, new, finding):
    assert old in SYSTEM
    (message,) = found(SYSTEM.replace(old, new, 1))
    assert finding in message


def test_unknown_package_that_is_installed_is_a_warning():
    (message,) = found(
        "RosSystem { Name x RosComponents ( ComponentInterface { name a FromRosNode 'std_msgs.a.n' } ) }"
    )
    assert "warning: no .ros model declares the installed package 'std_msgs'" in message


def test_one_unknown_package_of_a_component_is_told_once():
    (message,) = found(SYSTEM, "PackageSet { Package leg { } }")
    assert "no .ros model declares package 'arm'" in message


def test_without_any_model_it_is_told_that_references_are_not_followed():
    (message,) = [str(finding) for finding in check_system(parse_system(SYSTEM), library=Library())]
    assert "warning: no .ros model is known" in message


def test_port_that_its_node_does_not_declare_is_told_once_and_not_again_by_its_connection():
    (message,) = found(
        SYSTEM.replace(
            "RosServiceClient again { RefClient 'arm.arm_node.arm.again' }",
            "RosServiceClient again { RefClient 'arm.arm_node.arm.agian' }",
        )
    )
    assert message.startswith("m:7:")
    assert "declares no service client 'agian': did you mean 'again'?" in message


def test_packages_may_be_declared_in_parts():
    first, second = (f"PackageSet {{ CatkinPackage p {{ Artifact {n} {{ Node {{ name {n} }} }} }} }}" for n in "ab")
    text = "RosSystem { Name x RosComponents ( ComponentInterface { name a FromRosNode 'p.b.b' } ) }"
    assert found(text, first, second) == []


def node(inside):
    return f"PackageSet {{ CatkinPackage p {{ Artifact a {{ Node {{ name n {inside} }} }} }} }}"


def message(fields, package="p", name="T"):
    return f"PackageSet {{ Package {package} {{ Specs {{ TopicSpec {name} {{ message {{ {fields} }} }} }} }} }}"


def test_sound_packages_have_no_findings():
    assert faults(PACKAGES) == []


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        (
            node("Publishers { Publisher { name x message 'std_msgs.Strin' } }"),
            "p:1:72: error: publisher 'x': package 'std_msgs' declares no message 'Strin'",
        ),
        (
            node("Publishers { Publisher { name x message String } }"),
            "'String' names no message type: write package.Type",
        ),
        (node("Publishers { Publisher { name x message 'std_msgs/../x' } }"), "'std_msgs/../x' names no message type"),
        (
            node("Publishers { Publisher { name x message 'unheard_of.X' } }"),
            "warning: publisher 'x': no .ros model or installed package",
        ),
        (node("ServiceServers { ServiceServer { name x service 'std_msgs.String' } }"), "declares no service 'String'"),
        (
            node("Parameters { Parameter { name r type Integer default fast } }"),
            "the default 'fast' of 'r' is no Integer",
        ),
        (node("Parameters { Parameter { name r type Integer value fast } }"), "the value 'fast' of 'r' is no Integer"),
        (node("Publishers { Publisher { name x }, Publisher { name x } }"), "publisher 'x' stands twice"),
        (node("Parameters { Parameter { name x }, Parameter { name x } }"), "parameter 'x' stands twice"),
        ("PackageSet { Package p { }, Package p { } }", "p:1:29: error: package 'p' stands twice"),
        ("PackageSet { CatkinPackage p { Artifact a { }, Artifact a { } } }", "artifact 'a' stands twice"),
        (
            "PackageSet { Package p { Specs { TopicSpec T { message { int8 a int8 a } } } } }",
            "field of the message 'a' stands twice",
        ),
        (
            "PackageSet { Package p { Specs { TopicSpec T { message { Unheard a } } } } }",
            "package 'p' declares no message 'Unheard'",
        ),
        (
            "PackageSet { Package p { Specs { TopicSpec T { } TopicSpec T { } } } }",
            "specification 'topic T' stands twice",
        ),
        (
            "PackageSet { Package std_msgs { Specs { TopicSpec String { message { int8 data } } } } }",
            "warning: the message of 'String' is not that of the installed",
        ),
        (
            "PackageSet { Package std_srvs { Specs { ServiceSpec SetBool { response { bool ok } } } } }",
            "warning: the response of 'SetBool'",
        ),
        (
            "PackageSet { CatkinPackage p { Dependencies { PackageDependency nowhere } } }",
            "warning: package 'p' needs 'nowhere'",
        ),
        (
            node("ServiceClients { ServiceClient { name s service 'p.T' } }").replace(
                "Artifact", "Specs { TopicSpec T { } } Artifact"
            ),
            "'p/T' is a message type, must be a service",
        ),
    ],
)
def test_fault_of_a_package_is_found(text, finding):
    (message,) = faults(text)
    assert finding in message


@pytest.mark.parametrize(
    "text",
    [
        node("Publishers { Publisher { name x message 'p.T' } }").replace(
            "Artifact", "Specs { TopicSpec T { } } Artifact"
        ),
        *(
            node(interface).replace("Artifact", "Specs { ActionSpec T { } } Artifact")
            for interface in (
                "ActionServers { ActionServer { name x action 'p.T' } }",
                "ActionServers { ActionServer { name x action 'p.TAction' } }",
                "Publishers { Publisher { name x message 'p.TActionGoal' } }",
                "Publishers { Publisher { name x message 'p.TResult' } }",
            )
        ),
        node("ActionServers { ActionServer { name x action 'move_base_msgs.MoveBase' } }"),
        node("ActionServers { ActionServer { name x action 'move_base_msgs.MoveBaseAction' } }"),
        node("Publishers { Publisher { name x message 'metacontrol_msgs.MvpReconfigurationGoal' } }"),
        node("Publishers { Publisher { name x } }"),
        message("uint32 seq time stamp string frame_id", "std_msgs", "Header"),
        message("Header h 'geometry_msgs.Pose'[] poses T[3] nested"),
    ],
)
def test_known_types_are_no_fault(text):
    assert faults(text) == []


def variant(name, qualities, component="nav"):
    settings = ", ".join(f"Parameter {{ name {quality} value 0.5 }}" for quality in qualities)
    return parse_system(
        f"RosSystem {{ Name {name} RosComponents ( ComponentInterface {{ name {component} }} )"
        f" Parameters {{ {settings} }} }}",
        name,
    )


def test_variant_without_a_quality_of_its_siblings_is_found():
    systems = [
        variant("v1", ["qa_safety", "qa_energy"]),
        variant("v2", ["qa_safety"]),
        variant("v3", ["qa_safety", "qa_energy"]),
    ]
    (family,) = families(systems)
    (finding,) = check_family(family)
    assert str(finding) == "v2:1:1: error: variant 'v2' has no value for 'qa_energy', as 'v1', 'v3' have: add one"


def test_systems_of_other_components_are_no_siblings():
    assert families([variant("v1", ["qa_safety"]), variant("other", [], "arm")]) == []


# The command


@pytest.fixture
def check(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ros").mkdir()
    (tmp_path / "ros" / "arm.ros").write_text(PACKAGES)
    (tmp_path / "ok.rossystem").write_text(SYSTEM)
    (tmp_path / "bad.rossystem").write_text(SYSTEM.replace("value 5", "value 'a,\\n%'"))
    monkeypatch.setattr(InstalledPackages, "missing_executable", NothingInstalled.missing_executable)

    def run(*arguments):
        with pytest.raises(SystemExit) as done:
            main(["check", *arguments])
        return done.value.code, capsys.readouterr().out

    return run


def test_models_are_found_by_path(check):
    assert check("--path", "ros", "ok.rossystem") == (0, NOTHING)


def test_models_are_found_beside_the_file(check, tmp_path):
    (tmp_path / "arm.ros").write_text(PACKAGES)
    assert check("ok.rossystem") == (0, NOTHING)


def test_folder_is_checked_with_all_its_models(check):
    status, out = check(".")
    assert status == 1
    assert [line.split(":")[0] for line in out.splitlines() if ": error: " in line] == ["bad.rossystem"]


def test_packages_are_known_by_their_first_word(check, tmp_path):
    (tmp_path / "arm.txt").write_text(PACKAGES)
    assert check("arm.txt", "ok.rossystem") == (0, NOTHING)


def test_variant_is_checked_with_the_base_of_its_project(check, tmp_path):
    models = Path(__file__).parents[4] / "catkin_ws" / "src" / "metacontrol_sim" / "models"
    assert check(str(models / "variants" / "f1_v1_r1.rossystem")) == (0, NOTHING)
    text = (models / "variants" / "f1_v1_r1.rossystem").read_text()
    (tmp_path / "alone.rossystem").write_text(text)
    assert check("alone.rossystem")[0] == 1


def test_broken_model_on_the_path_is_told_once(check, tmp_path):
    (tmp_path / "ros" / "broken.ros").write_text("PackageSet { CatkinPackage }")
    status, out = check("--path", "ros", "ok.rossystem", "ros")
    assert status == 2
    assert out.count("broken.ros:1:28: error: expected a name or value or a string near '}'") == 1


@pytest.mark.parametrize("arguments", [["nothing.rossystem"], ["--path", "nowhere", "ok.rossystem"], ["empty"]])
def test_what_is_not_there_can_not_be_read(check, tmp_path, arguments):
    (tmp_path / "empty").mkdir()
    assert check(*arguments)[0] == 2


def test_json(check):
    status, out = check("--format", "json", "--path", "ros", "ok.rossystem", "bad.rossystem")
    assert status == 1
    assert json.loads(out) == [
        {
            "file": "bad.rossystem",
            "line": 10,
            "column": 84,
            "severity": "error",
            "rule": "value",
            "message": "the value 'a,\\n%' of 'rate' is no Double, as it is declared",
        }
    ]


def test_json_of_no_findings_is_an_empty_list(check):
    assert check("--format", "json", "--path", "ros", "ok.rossystem") == (0, "[]\n")


def test_github_annotations_escape_what_is_special(check):
    _, out = check("--format", "github", "--path", "ros", "bad.rossystem")
    assert out == (
        "::error file=bad.rossystem,line=10,col=84,title=value::"
        "the value 'a,\\n%25' of 'rate' is no Double, as it is declared\n"
    )


@pytest.mark.parametrize(("form", "told"), [("text", NOTHING), ("github", "")])
def test_only_people_are_told_that_nothing_is_wrong(check, form, told):
    assert check("--format", form, "--path", "ros", "ok.rossystem") == (0, told)


def test_warning_is_not_nothing(check):
    status, out = check("ok.rossystem")
    assert (status, "warning:" in out, NOTHING in out) == (0, True, False)


def test_sarif(check):
    _, out = check("--format", "sarif", "--path", "ros", "bad.rossystem")
    log = json.loads(out)
    assert log["version"] == "2.1.0"
    (run,) = log["runs"]
    (result,) = run["results"]
    assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == result["ruleId"] == "value"
    assert result["level"] == "error"
    assert result["locations"][0]["physicalLocation"] == {
        "artifactLocation": {"uri": "bad.rossystem"},
        "region": {"startLine": 10, "startColumn": 84},
    }


@pytest.mark.parametrize("written", ["{here}/deep er/../bad.rossystem", "bad.rossystem", "./bad.rossystem"])
def test_paths_below_the_working_folder_are_relative_to_it(check, tmp_path, written):
    (tmp_path / "deep er").mkdir()
    path = written.format(here=tmp_path)
    assert "::error file=bad.rossystem,line=10," in check("--format", "github", "--path", "ros", path)[1]
    assert _uri_of(check("--format", "sarif", "--path", "ros", path)) == "bad.rossystem"


def test_paths_elsewhere_are_whole(check, tmp_path, monkeypatch):
    (tmp_path / "deep er").mkdir()
    (tmp_path / "deep er/bad.rossystem").write_text((tmp_path / "bad.rossystem").read_text())
    monkeypatch.chdir(tmp_path / "ros")
    path = f"{tmp_path}/deep er/bad.rossystem"
    assert f"::error file={path},line=10," in check("--format", "github", "--path", ".", path)[1]
    uri = Path(path).as_uri()
    assert uri.startswith("file:///")
    assert _uri_of(check("--format", "sarif", "--path", ".", path)) == uri
    assert _uri_of(check("--format", "sarif", "--path", ".", "../deep er/bad.rossystem")) == uri


def _uri_of(answer):
    (result,) = json.loads(answer[1])["runs"][0]["results"]
    return result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]


@pytest.mark.skipif(not CORPUS, reason="MROS_CORPUS names no folder of published models")
def test_invalid_published_file_gives_its_errors_at_their_lines(check):
    status, out = check(
        "--format", "json", "--path", f"{CORPUS}/ros", f"{CORPUS}/rossystem/invalid_test_error.rossystem"
    )
    assert status == 1
    assert [(finding["line"], finding["rule"]) for finding in json.loads(out)] == [
        (29, "wrong-kind"),
        (30, "wrong-kind"),
        (31, "wrong-kind"),
        (32, "unknown-reference"),
        (34, "type-mismatch"),
    ]


@pytest.mark.skipif(not CORPUS, reason="MROS_CORPUS names no folder of published models")
def test_published_files_whose_references_are_there_are_clean(check):
    files = [*Path(CORPUS, "rossystem").glob("f1_*"), Path(CORPUS, "rossystem/AcmlStandard.rossystem")]
    assert len(files) == 9
    assert check("--path", f"{CORPUS}/ros", *map(str, files)) == (0, NOTHING)


def test_names_that_the_source_does_not_tell_are_asked_for():
    text = """PackageSet { CatkinPackage demo { Artifact a { Node { name a
        Publishers { Publisher { name '{topic}@src/a.cpp:12' message 'std_msgs.String' } }
        Parameters { Parameter { name '{key}/rate@src/a.cpp:14' type Double } Parameter { name rate type Double } }
    } } } }"""
    asked = [finding for finding in faults(text) if "the source does not tell this name" in finding]
    assert ["publisher '{topic}@src/a.cpp:12'" in asked[0], "parameter '{key}/rate@src/a.cpp:14'" in asked[1]] == [
        True,
        True,
    ]
    assert [": warning: " in finding for finding in asked] == [True, True]


def test_many_names_that_the_source_does_not_tell_are_asked_for_at_once():
    """Other people's code has hundreds of them."""
    names = " ".join(f"Parameter {{ name '{{p{n}}}@src/a.cpp:{n}' type Double }}" for n in range(1, 41))
    text = f"PackageSet {{ CatkinPackage demo {{ Artifact a {{ Node {{ name a Parameters {{ {names} }} }} }} }} }}"
    (asked,) = [finding for finding in faults(text) if ": warning: " in finding]
    assert "40 names in this file are not told by the source, of which this is the first: parameter '{p1}" in asked
