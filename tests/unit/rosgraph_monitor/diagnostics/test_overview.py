"""Tables for a terminal, and names for the aggregator."""

import pytest
from click.testing import CliRunner
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding
from node_kit.parts import Sign
from rich.console import Console
from ros_model.graph.snapshot import build_snapshot
from rosgraph_monitor.cli import snapshot
from rosgraph_monitor.cli.snapshot import lines
from rosgraph_monitor.diagnostics.aggregator_names import unique_name
from rosgraph_monitor.diagnostics.overview import Overview, of_robot, thresholds


def status(name, message, *values, level=0):
    return DiagnosticStatus(level, name, message, "", [KeyValue(key, value) for key, value in values])


def shown(overview, now, nodes=("/laser",), parameters=None):
    console = Console(width=160)
    with console.capture() as capture:
        console.print(overview.render(nodes, parameters or {}, now))
    return capture.get()


def test_board_shows_nodes_qualities_with_thresholds_and_findings():
    overview = Overview()
    overview.take(
        [
            status("laser", "Component status", ("laser", "TRUE")),
            status("laser", "CPU Usage", ("laser", "12.50")),
            status("", "QA status", ("safety", "0.25")),
            status("camera", "Missing node", ("reason", "dead: gone"), level=2),
        ],
        10.0,
    )
    text = shown(overview, 11.0, parameters={"reasoner": {"nfr_safety": 0.6}})
    for expected in ("laser", "TRUE", "12.50", "safety", "0.25", "0.6", "Missing node", "dead: gone"):
        assert expected in text


def test_board_shows_what_each_function_runs():
    overview = Overview()
    assert "Functions" not in shown(overview, 0.0), "there may be no manipulator"
    groundings = [FunctionGrounding("f_move", "careful", "STABLE"), FunctionGrounding("f_arm", "", "RECONFIGURING")]
    overview.take_configuration(ActiveConfiguration(functions=groundings))
    text = shown(overview, 0.0)
    for expected in ("f_move", "careful", "STABLE", "f_arm", "RECONFIGURING"):
        assert expected in text
    overview.take_configuration(ActiveConfiguration())
    assert "f_move" not in shown(overview, 0.0)


def test_finding_that_is_not_repeated_is_over():
    overview = Overview()
    overview.take([status("camera", "Missing node", ("reason", "dead"), level=2)], 10.0)
    assert "Missing node" in shown(overview, 12.0)
    assert "Missing node" not in shown(overview, 14.0)


def test_markup_in_names_is_shown_as_it_is():
    overview = Overview()
    overview.take([status("[red]x", "Odd [/]", ("k", "[bold]"), level=77)], 0.0)
    assert "[red]x" in shown(overview, 0.0, nodes=("/[/nope]",))


@pytest.mark.parametrize("value", ["[/]", "\x1b]0;owned\x07\x1b[2J", "[link=http://evil]x[/link]", "\x9b2J"])
@pytest.mark.parametrize(
    ("message", "level"), [("CPU Usage", 0), ("Memory Usage", 0), ("Component status", 0), ("QA status", 0), ("Odd", 2)]
)
def test_what_others_say_neither_styles_a_table_nor_controls_the_terminal(value, message, level):
    overview = Overview()
    overview.take([status("laser", message, ("laser", value), level=level)], 0.0)
    text = shown(overview, 0.0)
    assert value.encode("unicode_escape").decode() in text
    assert not {"\x1b", "\x07", "\x9b"} & set(text)


def cells(text, name):
    """The cells of the row that begins with a name, or has it in its second column."""
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in text.splitlines() if "│" in line]
    return next(row for row in rows if name in row[:2])


def test_board_that_hears_no_monitor_says_that_nobody_watches():
    text = shown(Overview(), 0.0)
    assert cells(text, "monitor") == ["monitor", "", "not heard: nobody watches what is below"]
    assert cells(text, "laser")[1] == "registered, not watched"


def test_part_that_gives_no_sign_of_life_is_shown_as_silent_and_nodes_as_not_watched():
    overview = Overview()
    for part in ("monitor", "reasoner"):
        overview.parts.hear(Sign(f"/rover/{part}_1", part, "http://a:1", 300.0), 10.0)
    text = shown(overview, 11.0)
    assert cells(text, "/rover/monitor_1") == ["monitor", "/rover/monitor_1", "runs"]
    assert cells(text, "laser")[1] == "registered" and "nobody watches" not in text
    overview.parts.hear(Sign("/rover/reasoner_1", "reasoner", "http://a:1", 300.0), 16.0)
    text = shown(overview, 17.0)
    assert cells(text, "/rover/monitor_1") == ["monitor", "/rover/monitor_1", "silent for 7 s"]
    assert cells(text, "/rover/reasoner_1")[2] == "runs"
    assert cells(text, "laser")[1] == "registered, not watched"
    assert "not heard: nobody watches what is below" in text


def test_what_the_monitor_has_said_is_shown_whoever_watches():
    overview = Overview()
    overview.take([status("laser", "Component status", ("laser", "FALSE"), ("reason", "hangs"), level=2)], 0.0)
    assert cells(shown(overview, 0.0), "laser")[1] == "FALSE: hangs"


def test_thresholds_are_found_wherever_they_stand():
    tree = {"a": {"reasoner": {"nfr_energy": 1, "nfr_word": "x"}}, "nfr_safety": 0.5}
    assert thresholds(tree) == {"energy": 1.0, "safety": 0.5}


@pytest.mark.parametrize(
    ("given", "name"),
    [
        (status("laser", "Component status", ("laser_resender", "TRUE")), "Component laser_resender"),
        (status("", "QA status", ("safety", "0.5")), "Quality safety"),
        (status("fg_1", "QA stale", ("safety", "x")), "Quality safety of fg_1"),
        (status("laser", "Missing node", ("reason", "x")), "Graph laser: Missing node"),
        (status("laser", "Missing port", ("port", "scan")), "Graph laser: Missing port scan"),
        (status("scan", "Silent topic"), "Graph scan: Silent topic"),
        (status("laser", "CPU Usage", ("laser", "1")), "Usage laser: CPU Usage"),
        (status("ROS Graph", "running OK"), "Graph ROS Graph"),
        (status("driver: status", "fine"), "driver: status"),
        (status("odd", "QA status"), "odd"),
    ],
)
def test_each_thing_has_a_name_of_its_own(given, name):
    assert unique_name(given) == name


def test_board_of_a_robot_in_a_namespace_has_its_own_nodes_and_thresholds():
    parameters = {"cell_1": {"reasoner": {"nfr_hits": 0.6}}, "cell_2": {"reasoner": {"nfr_hits": 0.9}}, "rate": 3}
    names, own = of_robot(["/cell_1/arm/driver", "/cell_2/eye", "/rosout"], parameters, "/cell_1/")
    assert (names, thresholds(own)) == (["arm/driver"], {"hits": 0.6})
    assert of_robot(["/eye"], parameters, "/") == (["eye"], parameters)
    assert of_robot([], parameters, "/cell_3") == ([], {})
    assert of_robot([], parameters, "/rate") == ([], {})


def test_same_component_of_two_robots_has_two_names_for_the_aggregator():
    names = set()
    for robot in ("robot:/cell_1", "robot:/cell_2"):
        given = status("gripper", "Component status", ("gripper", "TRUE"))
        given.hardware_id = robot
        names.add(unique_name(given))
    assert names == {"Component gripper in /cell_1", "Component gripper in /cell_2"}


def test_snapshot_in_lines():
    graph = build_snapshot(
        [[["/scan", ["/laser"]]], [["/scan", ["/nav"]]], [["/nav/clear", ["/nav"]]]],
        [["/scan", "sensor_msgs/LaserScan"]],
        {},
        {"/laser": "http://a:1/", "/nav": "http://a:2/"},
    )
    assert list(lines(graph)) == [
        "/laser http://a:1/",
        "  publishes /scan sensor_msgs/LaserScan",
        "/nav http://a:2/",
        "  subscribes /scan sensor_msgs/LaserScan",
        "  serves /nav/clear",
    ]


def test_name_of_a_node_controls_no_terminal(monkeypatch):
    graph = build_snapshot([[["/scan", ["/a\x9b2J\nb"]]], [], []], [], {}, {"/a\x9b2J\nb": "http://a:1/"})
    monkeypatch.setattr(snapshot, "take_snapshot", lambda *_: graph)
    output = CliRunner().invoke(snapshot.main).output
    assert output.splitlines() == ["/a\\x9b2J\\nb http://a:1/", "  publishes /scan"]
