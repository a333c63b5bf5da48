"""Families of variants: what the columns of a table set, from CSV and YAML, and how the parts make a whole again."""

import itertools

import pytest
from ros_model.checks.systems import check_system
from ros_model.errors import ModelError
from ros_model.generators.launch import launch_file
from ros_model.io.project import read_table
from ros_model.language.metamodel import ConnectionKind, PortPath, compose
from ros_model.language.system_reader import parse_system
from ros_model.project.columns import parse_columns
from ros_model.project.variants import make_systems, without

BASE = parse_system(
    """RosSystem { Name base
    RosComponents (
        ComponentInterface { name robot FromRosNode 'p.robot.robot'
            RosPublishers { RosPublisher odom { RefPublisher 'p.robot.robot.odom' } }
            RosSubscribers { RosSubscriber cmd { RefSubscriber 'p.robot.robot.cmd' } } },
        ComponentInterface { name laser FromRosNode 'p.laser.laser'
            RosPublishers { RosPublisher scan { RefPublisher 'p.laser.laser.scan' } } },
        ComponentInterface { name filter FromRosNode 'p.filter.filter'
            RosPublishers { RosPublisher clean { RefPublisher 'p.filter.filter.clean' } }
            RosSubscribers { RosSubscriber raw { RefSubscriber 'p.filter.filter.raw' } }
            RosParameters { RosParameter width { RefParameter 'p.filter.filter.width' value 3 } } },
        ComponentInterface { name maps FromRosNode 'p.maps.maps'
            RosSrvServers { RosServiceServer get_map { RefServer 'p.maps.maps.get_map' } } },
        ComponentInterface { name nav FromRosNode 'n.nav.nav'
            RosPublishers { RosPublisher cmd { RefPublisher 'n.nav.nav.cmd' } }
            RosSubscribers { RosSubscriber odom { RefSubscriber 'n.nav.nav.odom' }, RosSubscriber scan { RefSubscriber 'n.nav.nav.scan' } }
            RosParameters { RosParameter speed { RefParameter 'n.nav.nav.speed' value 1.0 } } },
        ComponentInterface { name stop FromRosNode 'n.stop.stop'
            RosSubscribers { RosSubscriber scan { RefSubscriber 'n.stop.stop.scan' } } }
    )
    TopicConnections {
        TopicConnection odom { From ( 'robot.odom' ) To ( 'nav.odom' ) },
        TopicConnection scan { From ( 'laser.scan' ) To ( 'nav.scan', 'stop.scan', 'filter.raw' ) },
        TopicConnection cmd { From ( 'nav.cmd' ) To ( 'robot.cmd' ) }
    }
    Parameters { Parameter { name floor type Integer value 2 } }
}""",  # noqa: E501
    "base.rossystem",
)
SECTION = {
    "component": "nav",
    "parameters": {
        "speed_mps": ["speed", {"name": "acceleration", "factor": 12}],
        "width": [{"name": "width", "component": "filter"}],
    },
    "connections": {
        "sensor": {
            "raw": ["laser.scan"],
            "clean": [{"from": "filter.clean", "to": "nav.scan"}],
            "none": [],
        },
        "map": {"served": ["maps.get_map"], "unknown": []},
    },
    "components": {"guarded": ["stop"]},
    "expected": {"risk": "safety"},
    "ignore": ["note"],
}  # fmt: skip
HEADER = "name,speed_mps,width,sensor,map,guarded,risk,note\n"


@pytest.fixture
def table(tmp_path):
    numbers = itertools.count()

    def write(text, suffix=".csv"):
        path = tmp_path / f"table{next(numbers)}{suffix}"
        path.write_text(text)
        return read_table(path)

    return write


@pytest.fixture
def systems(table):
    def make(*rows, section=SECTION):
        return make_systems(BASE, parse_columns(section), table(HEADER + "".join(f"{row}\n" for row in rows)))

    return make


def values(system, component):
    return {parameter.key: parameter.value for parameter in system.component(component).parameters}


def ends(system, kind=ConnectionKind.TOPIC):
    return {
        (connection.name, str(source), str(target))
        for connection in system.connections
        if connection.kind is kind
        for source in connection.sources
        for target in connection.targets
    }


ROWS = [
    ",".join(["v", *cells])
    for cells in itertools.product(
        ["0.3", ""], ["5"], ["raw", "clean", "none"], ["served", "unknown"], ["true", "false"], ["0.1"], ["x"]
    )
]


@pytest.mark.parametrize("row", ROWS)
def test_part_composed_with_what_is_always_there_is_the_whole(systems, row):
    ((whole, part),) = systems(row)
    again = compose(without(BASE, {"stop"}), part)
    assert {component.name: component for component in again.components} == {
        component.name: component for component in whole.components
    }
    for kind in ConnectionKind:
        assert ends(again, kind) == ends(whole, kind)
    assert check_system(whole) == ()
    assert check_system(part, again) == ()


def test_value_of_a_column_chooses_among_connections(systems):
    topics = [
        ends(part)
        for _, part in systems(*(f"{name},1,3,{name},unknown,false,0.1," for name in ("raw", "clean", "none")))
    ]
    fixed = {("odom", "robot.odom", "nav.odom"), ("cmd", "nav.cmd", "robot.cmd"), ("scan", "laser.scan", "filter.raw")}
    assert topics == [
        fixed | {("scan", "laser.scan", "nav.scan")},
        fixed | {("clean", "filter.clean", "nav.scan")},
        fixed,
    ]  # fmt: skip


def test_port_that_nothing_connects_any_more_goes(systems):
    ((_, part),) = systems("v,1,3,none,unknown,false,0.1,")
    assert part.component("nav").port("scan") is None


def test_service_is_connected_to_a_client_that_is_made_for_it(systems):
    ((_, part),) = systems("v,1,3,raw,served,false,0.1,")
    assert ends(part, ConnectionKind.SERVICE) == {("get_map", "maps.get_map", "nav.get_map")}
    assert str(part.component("nav").port("get_map").reference) == "n.nav.nav.get_map"


def test_component_is_there_where_the_column_is_true(systems):
    (with_stop, part), (lacking, _) = systems("a,1,3,raw,unknown,true,0.1,", "b,1,3,raw,unknown,false,0.1,")
    assert ("scan", "laser.scan", "stop.scan") in ends(part)
    assert part.component("stop") == with_stop.component("stop") == BASE.component("stop")
    assert lacking.component("stop") is None
    assert not any("stop" in target for _, _, target in ends(lacking))


def test_factor_is_exact_and_an_empty_cell_leaves_the_base(systems):
    (fast, _), (as_base, _) = systems("a,0.3,3,raw,unknown,true,0.1,", "b,,,raw,unknown,true,0.1,")
    assert values(fast, "nav") == {"speed": 0.3, "acceleration": 3.6}
    assert values(as_base, "nav") == {"speed": 1.0}
    assert values(as_base, "filter") == {"width": 3}


def test_integer_is_a_double_where_the_base_or_another_row_has_one(systems):
    (first, _), (second, _) = systems("a,1,3,raw,unknown,true,0.1,", "b,2,3.5,raw,unknown,true,0.1,")
    assert [type(value) for value in values(first, "nav").values()] == [float, float]
    assert (repr(values(first, "filter")), values(second, "filter")) == ("{'width': 3.0}", {"width": 3.5})


def test_expected_level_may_stand_in_the_table_itself(systems):
    ((whole, part),) = systems("v,1,3,raw,unknown,true,0.25,a note")
    assert part.expected_qas == {"safety": 0.25}
    assert [parameter.name for parameter in whole.parameters] == ["floor", "qa_safety"]


def test_column_may_name_its_parameter_itself(table):
    rows = table("name,nav.speed,nav.group/gain,qa_safety\nv,2,high,0.5\n")
    ((_, part),) = make_systems(BASE, parse_columns({}), rows)
    assert values(part, "nav") == {"speed": 2.0, "group/gain": "high"}
    assert part.expected_qas == {"safety": 0.5}


@pytest.mark.parametrize(
    "text",
    [
        "v: {nav.speed: 0.5, nav.sources: [a, b], nav.on: true, nav.limits: {low: 1}, nav.id: '15', nav.rest: }\n",
        "- {name: v, nav.speed: 0.5, nav.sources: [a, b], nav.on: true, nav.limits: {low: 1}, nav.id: '15'}\n",
    ],
)
def test_table_in_yaml_keeps_types(table, text):
    rows = table(text, ".yaml")
    ((_, part),) = make_systems(BASE, parse_columns({}), rows)
    found = values(part, "nav")
    assert found == {"speed": 0.5, "sources": ["a", "b"], "on": True, "limits": {"low": 1}, "id": "15"}
    assert rows.rows[0].position.line == 1


def test_same_input_gives_the_same_family(systems):
    assert systems(*ROWS[:1]) == systems(*ROWS[:1])


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("v,fast,3,raw,served,true,0.1,", "2:1: column 'speed_mps' is 'fast', must be a number: it is scaled by 12"),
        ("v,1,3,sonar,served,true,0.1,", "2:1: column 'sensor' is 'sonar', must be raw or clean or none"),
        ("v,1,3,,served,true,0.1,", "2:1: column 'sensor' is '', must be raw or clean or none"),
        ("v,1,3,raw,served,maybe,0.1,", "2:1: column 'guarded' is 'maybe', must be true or false"),
        ("v,1,3,raw,served,true,,", "2:1: column 'risk' is None, must be a number"),
        ("../v,1,3,raw,served,true,0.1,", "2:1: variant '../v' can't name a file"),
        ("a/b,1,3,raw,served,true,0.1,", "2:1: variant 'a/b' can't name a file"),
        (".v,1,3,raw,served,true,0.1,", "2:1: variant '.v' can't name a file"),
        ("$(x),1,3,raw,served,true,0.1,", "2:1: variant '$(x)' can't name a file"),
        ('"v\nw",1,3,raw,served,true,0.1,', "3:1: variant 'v\\nw' can't name a file"),
        (",1,3,raw,served,true,0.1,", "2:1: variant '' can't name a file"),
    ],
)
def test_bad_row_is_refused_at_its_line(systems, row, message):
    with pytest.raises(ModelError) as caught:
        systems(row)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"parameters": {"speed_mps": ["speed"]}}, "says no component"),
        ({"component": "arm"}, "'arm' is no component"),
        ({**SECTION, "components": {"guarded": ["arm"]}}, "'arm' is no component"),
        ({**SECTION, "connections": {"sensor": {"raw": ["nav.odom"]}}}, "nav.odom is no publisher or server"),
        (
            {**SECTION, "connections": {"sensor": {"raw": [{"from": "laser.scan", "to": "arm.x"}]}}},
            "'arm' is no component",
        ),
        ({**SECTION, "parameters": {**SECTION["parameters"], "map": ["speed"]}}, "both set speed of nav"),
        ({**SECTION, "expected": {"danger": "safety"}}, "nothing says what column 'risk' sets"),
        ({**SECTION, "parameters": {**SECTION["parameters"], "gain": ["gain"]}}, "column 'gain' is missing"),
        ({**SECTION, "connections": {"sensor": {"raw": ["stop.scan"]}}}, "stop.scan is no publisher or server"),
    ],
)  # fmt: skip
def test_columns_that_do_not_fit_the_base_are_refused(systems, section, message):
    with pytest.raises(ModelError) as caught:
        systems("v,1,3,raw,unknown,true,0.1,", section=section)
    assert message in str(caught.value)


def test_every_column_and_every_cell_that_is_wrong_is_told(systems):
    section = {**SECTION, "ignore": [], "components": {}, "expected": {"danger": "safety"}}
    with pytest.raises(ModelError) as caught:
        systems("v,fast,3,sonar,served,maybe,0.1,x", section=section)
    assert [error.message.partition(": ")[0] for error in caught.value.all] == [
        "nothing says what column 'guarded' sets",
        "nothing says what column 'risk' sets",
        "nothing says what column 'note' sets",
        "the mapped column 'danger' is missing",
    ]
    with pytest.raises(ModelError) as caught:
        systems("v,fast,3,sonar,served,maybe,low,x")
    assert [error.message.split()[1] for error in caught.value.all] == [
        "'risk'",
        "'guarded'",
        "'sensor'",
        "'speed_mps'",
    ]
    section = {**SECTION, "parameters": {"speed_mps": [{"name": "speed", "component": "leg"}]}, "component": "arm"}
    with pytest.raises(ModelError) as caught:
        systems("v,1,3,raw,served,true,0.1,x", section=section)
    assert [error.message.split()[0] for error in caught.value.all] == ["'arm'", "'leg'"]


def test_connection_of_a_component_that_the_variant_lacks_is_refused(systems):
    section = {**SECTION, "components": {"guarded": ["filter"]}}
    with pytest.raises(ModelError, match="2:1: connects 'filter', which this variant lacks"):
        systems("v,1,3,clean,unknown,false,0.1,", section=section)


@pytest.mark.parametrize(
    ("text", "suffix", "message"),
    [
        ("name,a,a\nv,1,2\n", ".csv", "1:1: column 'a' is empty or stands twice"),
        ("name,a,b,a,b\nv,1,2,3,4\n", ".csv", "1:1: column 'a' is empty or stands twice"),
        ('name,a\nv,"1\n', ".csv", "unexpected end of data"),
        ("name\nv\n", ".txt", "is neither .csv nor .yaml"),
        ("3", ".yaml", "1:1: must be a list of rows"),
        ("- 3", ".yaml", "1:3: a row must be a mapping"),
        ("- {a: 1}", ".yaml", "a row's name must be text, not None"),
        ("1: {a: 1}", ".yaml", "a row's name must be text, not 1"),
        ("v: {a: 2001-01-01}", ".yaml", "column 'a' is datetime.date"),
        ("v: {a: .inf}", ".yaml", "column 'a' is inf"),
        (f"v: {{a: 1{'0' * 400}}}", ".yaml", "1:8: a number is too large"),
        ("v: {a: 1}\nw: {a: 1}\nv: {a: 2}", ".yaml", "3:1: the key 'v' stands twice"),
    ],
)
def test_what_is_no_table_is_refused(table, text, suffix, message):
    with pytest.raises(ModelError) as caught:
        table(text, suffix)
    assert message in str(caught.value)


def test_wired_port_keeps_its_reference(systems):
    ((_, part),) = systems("v,1,3,clean,unknown,false,0.1,")
    assert part.component("nav").port("scan").reference == BASE.component("nav").port("scan").reference
    assert PortPath("nav", "scan") in {end for connection in part.connections for end in connection.targets}


CONNECTED = "TopicConnections { TopicConnection 'NAME' { From ( 'compass.SOURCE' ) To ( 'logger.x' ) } }"
VESSEL = """RosSystem { Name vessel RosComponents (
    ComponentInterface { name compass NameSpace '/ship' FromRosNode 'v.compass.compass'
        RosPublishers { RosPublisher 'SOURCE' { RefPublisher 'v.compass.compass.SOURCE' } } },
    ComponentInterface { name logger FromRosNode 'v.logger.logger'
        RosSubscribers { RosSubscriber x { RefSubscriber 'v.logger.logger.x' } } },
    ComponentInterface { name pilot NameSpace '/ship' FromRosNode 'v.pilot.pilot' SUBSCRIBERS } ) CONNECTED }"""
SUBSCRIBER = "RosSubscribers { RosSubscriber 'TARGET' { RefSubscriber 'v.pilot.pilot.TARGET' } }"


@pytest.mark.parametrize(
    ("source", "connection", "target", "found"),
    [
        ("imu/data", "ship/imu/data", "imu/data", ("ship/imu/data", "imu/data")),
        ("imu/data", "ship/imu/data", "/ship/imu/data", ("ship/imu/data", "/ship/imu/data")),
        ("imu/data", "ship/imu/data", None, ("ship/imu/data", "imu/data")),
        ("imu/data", None, "imu/data", ("ship/imu/data", "imu/data")),
        ("imu/data", None, None, ("ship/imu/data", "imu/data")),
        ("/imu/data", None, "/imu/data", ("/imu/data", "/imu/data")),
        ("~data", None, "compass/data", ("ship/compass/data", "compass/data")),
        ("imu/data", "imu/data", "imu/data", ("imu/data", "imu/data")),
    ],
)
def test_port_at_the_other_end_of_a_connection_in_a_namespace_is_that_of_the_same_topic(
    table, source, connection, target, found
):
    text = VESSEL.replace("CONNECTED", CONNECTED.replace("NAME", connection) if connection else "")
    text = text.replace("SUBSCRIBERS", SUBSCRIBER.replace("TARGET", target) if target else "")
    base = parse_system(text.replace("SOURCE", source), "vessel.rossystem")
    section = {"component": "pilot", "connections": {"by": {"compass": [f"compass.{source}"], "eye": []}}}
    ((whole, _), _) = make_systems(base, parse_columns(section), table("name,by\na,compass\nb,eye\n"))
    topic, port = found
    assert (topic, f"compass.{source}", f"pilot.{port}") in ends(whole)
    assert [p.name for p in whole.component("pilot").ports] == [port]


@pytest.mark.parametrize("port", ["heading", None])
def test_new_connection_from_a_namespace_to_the_root_has_the_topic_and_the_port_the_name_in_the_code(table, port):
    text = VESSEL.replace("CONNECTED", "").replace("name pilot NameSpace '/ship'", "name pilot")
    text = text.replace("SUBSCRIBERS", SUBSCRIBER.replace("TARGET", port) if port else "")
    base = parse_system(text.replace("SOURCE", "heading"), "vessel.rossystem")
    section = {"component": "pilot", "connections": {"by": {"compass": ["compass.heading"]}}}
    ((whole, part),) = make_systems(base, parse_columns(section), table("name,by\na,compass\n"))
    assert ends(whole) == {("ship/heading", "compass.heading", "pilot.heading")}
    assert '<remap from="heading" to="ship/heading" />' in launch_file(part, whole)
