"""The YAML examples of the READMEs: they are valid, and say what the text around them says."""

import re
from pathlib import Path

import pytest
import yaml
from ros_model.checks.whole_projects import check_project
from ros_model.generators.deployment import manipulator
from ros_model.io.project import load_project
from ros_model.project.requirements import requirement_lines

ROOT = Path(__file__).parents[4]
README = ROOT / "catkin_ws" / "src" / "ros_model" / "README.md"
PORTS = {
    "RosPublishers": ("RosPublisher", "RefPublisher"),
    "RosSubscribers": ("RosSubscriber", "RefSubscriber"),
    "RosSrvServers": ("RosServiceServer", "RefServer"),
    "RosActionServers": ("RosActionServer", "RefServer"),
    "RosParameters": ("RosParameter", "RefParameter"),
}


def component(name, **ports):
    sections = " ".join(
        f"{section} {{ {PORTS[section][0]} '{port}' {{ {PORTS[section][1]} 'carts.{name}.py.{name}.{port}' }} }}"
        for section, port in ports.items()
    )
    return f"ComponentInterface {{ name {name} FromRosNode 'carts.{name}.py.{name}' {sections} }}"


CART = f"""RosSystem {{ Name cart RosComponents (
    {component("base", RosPublishers="odom", RosSubscribers="cmd_vel")},
    {component("laser", RosPublishers="scan")}, {component("camera", RosPublishers="points")},
    {component("map_server", RosSrvServers="static_map")}, {component("beacon", RosPublishers="tf")},
    {component("lift")}, {component("picker", RosActionServers="pick")},
    {component("left_arm", RosActionServers="follow_trajectory")},
    {component("right_arm", RosActionServers="follow_trajectory")},
    ComponentInterface {{ name navigator FromRosNode 'carts.navigator.py.navigator'
        RosPublishers {{ RosPublisher cmd_vel {{ RefPublisher 'carts.navigator.py.navigator.cmd_vel' }} }}
        RosSubscribers {{ RosSubscriber odom {{ RefSubscriber 'carts.navigator.py.navigator.odom' }},
            RosSubscriber tf {{ RefSubscriber 'carts.navigator.py.navigator.tf' }} }}
        RosActionServers {{ RosActionServer move_base {{ RefServer 'carts.navigator.py.navigator.move_base' }} }} }} )
    TopicConnections {{
        TopicConnection odom {{ From ( 'base.odom' ) To ( 'navigator.odom' ) }},
        TopicConnection tf {{ From ( 'beacon.tf' ) To ( 'navigator.tf' ) }},
        TopicConnection cmd_vel {{ From ( 'navigator.cmd_vel' ) To ( 'base.cmd_vel' ) }} }} }}"""
FILES = {
    "cart.rossystem": CART,
    "navigator.csv": "name,speed,sensor,map\ncareful,0.2,laser,served\nbrisk,0.9,laser,served\n"
    "by_camera,0.4,camera,none\n",
    "navigator_qa.csv": "name,safety,performance\ncareful,0.1,0.2\nbrisk,0.5,0.9\nby_camera,0.4,0.4\n",
    "picker.csv": "name,arm\nleft_handed,left\nright_handed,right\n",
}  # fmt: skip


def examples(document):
    return re.findall(r"^```yaml\n(.*?)^```", document.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.fixture
def cart(tmp_path):
    """Load the cart of the README, with the sections of another example in place of its own."""

    def load(**sections):
        models = tmp_path / "models"
        models.mkdir(exist_ok=True)
        for name, text in FILES.items():
            (models / name).write_text(text)
        (tmp_path / "launch").mkdir(exist_ok=True)
        (tmp_path / "launch" / "left_arm.launch").write_text("<launch/>")
        settings = yaml.safe_load(examples(README)[0]) | sections
        (models / "metacontrol.yaml").write_text(yaml.safe_dump(settings))
        project = load_project(models)
        assert not [
            finding.message for finding in check_project(project, project.library) if "metacontrol" in str(finding)
        ]
        return project

    return load


@pytest.mark.parametrize("document", [README, ROOT / "README.md"], ids=["ros_model", "root"])
def test_examples_are_there_and_check_clean(cart, document):
    found = examples(document)
    assert found
    for text in found:
        cart(**yaml.safe_load(text))


def test_every_document_with_an_example_is_checked():
    """The how-tos are about robots of their own; their blocks were tried with these."""
    documents = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("catkin_ws/src/*/*.md")]
    assert {path for path in documents if examples(path)} == {README, ROOT / "README.md"}


def test_example_with_two_functions_keeps_the_goal_of_each(cart):
    functions = manipulator(cart())["functions"]
    assert {name: entry["save_action"] for name, entry in functions.items()} == {
        "f_drive": "move_base",
        "f_pick": "pick",
    }


def test_example_connects_topics_a_service_and_actions(cart):
    required = cart(components={}).required_components()
    assert required == {
        "careful": {"base", "laser", "map_server"},
        "brisk": {"base", "laser", "map_server"},
        "by_camera": {"base", "camera"},
        "left_handed": {"left_arm"},
        "right_handed": {"right_arm"},
    }


def test_requirements_are_shown_as_in_the_readme(cart):
    lines = "\n".join(f"    {line}" for line in requirement_lines(cart(components={})) if line)
    sample = re.search(r"^    by_camera requires:\n(?:    .*\n)+", README.read_text(), re.MULTILINE)[0]
    assert sample in lines


def test_words_of_the_examples_correct_what_is_required(cart):
    required = cart().required_components()
    assert "lift" in required["left_handed"]
    assert "map_server" not in required["careful"]
    assert "map_server" in required["brisk"]
    second = cart(**yaml.safe_load(examples(README)[1])).required_components()
    assert second["by_camera"] == {"base", "camera", "beacon"}
    assert second["brisk"] == {"base", "laser"}
    root = cart(**yaml.safe_load(examples(ROOT / "README.md")[0])).required_components()
    assert all("beacon" in names for names in root.values())
    assert root["careful"] == {"base", "beacon", "laser"}


def test_example_of_spares_has_one_for_each_hand_and_eye(cart):
    sections = next(yaml.safe_load(text) for text in examples(README) if "\nspares:" in text)
    roles = cart(**sections).roles
    assert roles.filled["right_handed"] == {"hand": "right_arm"}
    assert roles.filled["by_camera"] == {"sight": "camera"}
    assert roles.components["careful"] == roles.components["by_camera"] == {"base"}
    assert roles.components["brisk"] >= {"laser"}


def test_example_of_repairs_tells_the_manipulator_by_what_means(cart):
    sections = next(yaml.safe_load(text) for text in examples(README) if "repair:" in text)
    assert manipulator(cart(**sections))["repairs"] == {
        "laser": {"service": "laser/reset"},
        "left_arm": {
            "launch": {"package": "my_cart", "file": "launch/left_arm.launch", "args": {"port": "/dev/ttyUSB0"}}
        },
    }
