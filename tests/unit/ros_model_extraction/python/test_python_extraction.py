"""rospy nodes from their source."""

from __future__ import annotations

import re
import textwrap
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ros_model.language.metamodel import PortKind, Position
from ros_model_extraction.io.python_modules import Library
from ros_model_extraction.node_facts import FoundParameter, NodeSource, SourceError
from ros_model_extraction.packages.package_source import ExtractedPackage, extract_package
from ros_model_extraction.python.node_reader import read_python_node

MANIFEST = """<package format="2"><name>demo</name><version>0.1.0</version><description>d</description>
<maintainer email="a@b.example">m</maintainer><license>MIT</license><exec_depend>rospy</exec_depend>
<exec_depend>numpy</exec_depend>{}</package>
"""


@pytest.fixture
def package(tmp_path: Path):
    """Makes the package `demo` of a script and modules, and reads it."""

    def make(script: str, export: str = "", **modules: str) -> ExtractedPackage:
        (tmp_path / "package.xml").write_text(MANIFEST.format(export))
        (tmp_path / "nodes").mkdir(exist_ok=True)
        node = tmp_path / "nodes" / "talker"
        node.write_text("#!/usr/bin/env python3\n" + textwrap.dedent(script))
        node.chmod(0o755)
        source = tmp_path / "src" / "demo"
        source.mkdir(parents=True, exist_ok=True)
        (source / "__init__.py").touch()
        for name, text in modules.items():
            (source / f"{name}.py").write_text(textwrap.dedent(text))
        return extract_package(tmp_path)

    return make


@pytest.fixture
def node(package):
    def make(script: str, **modules: str) -> NodeSource:
        return package(f"import rospy\nfrom std_msgs.msg import String\n{textwrap.dedent(script)}", **modules).nodes[
            "talker"
        ]

    return make


def found(node: NodeSource) -> set[tuple[str, str, str]]:
    return {(port.kind.value, port.name, port.type) for port in node.ports}


def names(node: NodeSource) -> set[str]:
    return {port.name for port in node.ports}


def remarks(node: NodeSource) -> str:
    return "\n".join(map(str, node.remarks))


def test_every_kind_of_interface_is_found(node):
    result = node(
        """
        import actionlib
        import message_filters
        import tf2_ros
        from move_base_msgs.msg import MoveBaseAction
        from std_srvs.srv import Empty
        rospy.init_node("hello")
        rospy.Publisher("chatter", String, queue_size=1)
        rospy.Subscriber(name="heard", data_class=String, callback=print)
        rospy.Service("~reset", Empty, print)
        rospy.ServiceProxy("/clear", service_class=Empty)
        actionlib.SimpleActionServer("serve", MoveBaseAction, auto_start=False)
        actionlib.SimpleActionClient("ask", MoveBaseAction)
        message_filters.Subscriber("filtered", String)
        tf2_ros.TransformBroadcaster()
        tf2_ros.TransformListener(tf2_ros.Buffer())
        rospy.wait_for_message("once", String)
        """
    )
    assert result.name == "hello"
    assert found(result) == {
        ("publisher", "chatter", "std_msgs/String"),
        ("subscriber", "heard", "std_msgs/String"),
        ("service server", "~reset", "std_srvs/Empty"),
        ("service server", "~tf2_frames", "tf2_msgs/FrameGraph"),
        ("service client", "/clear", "std_srvs/Empty"),
        ("action server", "serve", "move_base_msgs/MoveBaseAction"),
        ("action client", "ask", "move_base_msgs/MoveBaseAction"),
        ("subscriber", "filtered", "std_msgs/String"),
        ("publisher", "/tf", "tf2_msgs/TFMessage"),
        ("subscriber", "/tf", "tf2_msgs/TFMessage"),
        ("subscriber", "/tf_static", "tf2_msgs/TFMessage"),
        ("subscriber", "once", "std_msgs/String"),
    }
    assert result.remarks == ()


def test_few_lines_that_call_the_main_of_a_module_are_followed(package):
    result = package(
        "from demo.talker_node import main\nmain()\n",
        talker_node="""
            import rospy
            from demo import names
            from std_msgs.msg import String

            def main():
                rospy.init_node("talker")
                rospy.Publisher(names.TOPIC, String, queue_size=1)

            def never_called():
                rospy.Publisher("never", String, queue_size=1)

            if __name__ == "__main__":
                rospy.Publisher("only_as_script", String, queue_size=1)
            """,
        names="PREFIX = 'a'\nTOPIC = f'{PREFIX}/b'\n",
    )
    assert names(result.nodes["talker"]) == {"a/b"}
    assert result.nodes["talker"].ports[0].position.file == "src/demo/talker_node.py"
    assert result.nodes["talker"].ports[0].position.line == 8


@pytest.mark.parametrize(
    ("code", "expected"),
    [
        ("t = 'x'\nrospy.Publisher(t, String)", {"x"}),
        ("rospy.Publisher('a' + '/' + 'b', String)", {"a/b"}),
        ("rospy.Publisher('%s/%d' % ('a', 2), String)", {"a/2"}),
        ("rospy.Publisher('{}/b'.format('a'), String)", {"a/b"}),
        ("rospy.Publisher('/'.join(['a', 'b']).rstrip('/'), String)", {"a/b"}),
        ("for t in ['x', 'y']:\n    rospy.Publisher(t, String)", {"x", "y"}),
        ("[rospy.Publisher(f'arm_{i}', String) for i in range(2)]", {"arm_0", "arm_1"}),
        ("for i, (t, k) in enumerate([('x', String)]):\n    rospy.Publisher(f'{t}{i}', k)", {"x0"}),
        ("TOPICS = {'a': 'x', 'b': 'y'}\nrospy.Publisher(TOPICS['b'], String)", {"y"}),
        ("t = 'x'\nt = 'y'\nrospy.Publisher(t, String)\nt = 'z'", {"y"}),
        ("t = 'x' if rospy.has_param('~a') else 'y'\nrospy.Publisher(t, String)", {"x", "y"}),
        ("if rospy.has_param('~a'):\n    t = 'x'\nelse:\n    t = 'y'\nrospy.Publisher(t, String)", {"x", "y"}),
        ("rospy.Publisher(rospy.get_name() + '/x', String)", {"~x"}),
        ("rospy.Publisher(rospy.resolve_name('x'), String)", {"x"}),
        ("Publish = rospy.Publisher\nPublish('x', String)", {"x"}),
        ("from functools import partial\nmake = partial(rospy.Publisher, queue_size=1)\nmake('x', String)", {"x"}),
        ("from rospy import Publisher as P\nP('x', String)", {"x"}),
        ("import rospy.topics\nrospy.topics.Publisher('x', String)", {"x"}),
        ("a, (b, c) = 'x', ('y', 'z')\nrospy.Publisher(c, String)", {"z"}),
        ("rospy.Publisher((lambda: 'x')(), String)", {"{(lambda: 'x')()}@nodes/talker:4"}),
        ("class K:\n    T = 'x'\nrospy.Publisher(K.T, String)", {"x"}),
        ("import enum\nclass K(enum.Enum):\n    T = 'x'\nrospy.Publisher(K.T.value, String)", {"x"}),
        ("def name(a, b='y'):\n    return f'{a}/{b}'\nrospy.Publisher(name('x'), String)", {"x/y"}),
        ("t = 'x'\ndef go():\n    rospy.Publisher(t, String)\ngo()", {"x"}),
        ("def go():\n    global t\n    t = 'x'\ngo()\nrospy.Publisher(t, String)", {"x"}),
    ],
)
def test_names_are_resolved(node, code, expected):
    assert names(node(code)) == expected


def test_arguments_of_one_call_stay_together(node):
    result = node(
        """
        from std_msgs.msg import Int32
        def listen(topic, kind, *rest, **more):
            rospy.Subscriber(topic, kind, *rest, **more)
        listen("a", String, print)
        listen("b", kind=Int32)
        for topic, kind in (("c", String), ("d", Int32)):
            listen(topic, kind)
        """
    )
    assert found(result) == {
        ("subscriber", "a", "std_msgs/String"),
        ("subscriber", "b", "std_msgs/Int32"),
        ("subscriber", "c", "std_msgs/String"),
        ("subscriber", "d", "std_msgs/Int32"),
    }


def test_objects_are_told_apart_by_where_they_are_made(node):
    result = node(
        """
        from dataclasses import dataclass
        @dataclass
        class Side:
            name: str
            depth: int = 3
        class Arm:
            KIND = String
            def __init__(self, side, prefix="arms"):
                self._side = side
                self._prefix = prefix
                self._advertise("state")
            def _advertise(self, what):
                self._publisher = rospy.Publisher(f"{self.base}/{what}", self.KIND, queue_size=1)
            @property
            def base(self):
                return f"{self._prefix}/{self._side.name}"
        Arm(Side("left"))
        Arm(Side(name="right"), prefix="a")
        """
    )
    assert names(result) == {"arms/left/state", "a/right/state"}


def test_subclass_of_a_ros_class_is_that_class(node):
    result = node(
        """
        import actionlib
        from move_base_msgs.msg import MoveBaseAction
        class Server(actionlib.ActionServer):
            def __init__(self, *arguments, extra=None, **options):
                super().__init__(*arguments, auto_start=False, **options)
        class Publisher(rospy.Publisher):
            pass
        class Old(rospy.Subscriber):
            def __init__(self, name):
                rospy.Subscriber.__init__(self, name, String)
        Server("serve", MoveBaseAction, extra=1)
        Publisher("x", String, queue_size=1)
        Old("y")
        """
    )
    assert found(result) == {
        ("action server", "serve", "move_base_msgs/MoveBaseAction"),
        ("publisher", "x", "std_msgs/String"),
        ("subscriber", "y", "std_msgs/String"),
    }


def test_what_is_not_known_is_marked_with_its_place_and_the_rest_of_the_name_kept(node):
    result = node(
        """
        import sys
        action = sys.argv[1]
        rospy.Publisher(f"{action}/goal", sys.argv[2], queue_size=1)
        """
    )
    (port,) = result.ports
    assert (port.name, port.type, port.is_resolved) == ("{action}/goal@nodes/talker:7", "", False)
    assert "nodes/talker:7:1: publisher: its name is not known: {action}/goal" in remarks(result)
    assert "nodes/talker:7:1: publisher: its type is not known: {sys.argv[2]}" in remarks(result)


def test_ros_function_that_is_handed_on_is_told(node):
    result = node("def make(what): what('x', String)\nmake(rospy.Publisher)\n")
    assert "rospy.Publisher is handed on as a value" in remarks(result)


def test_callback_whose_callers_are_not_known_leaves_its_parameters_unknown(node):
    result = node(
        """
        def listen(topic):
            rospy.Subscriber(topic, String, print)
        listen("a")
        rospy.Timer(1.0, listen)
        """
    )
    assert names(result) == {"a", "{topic}@nodes/talker:6"}


def test_parameters_come_with_types_and_defaults(node):
    result = node(
        """
        rospy.get_param("~rate", 10.0)
        rospy.get_param("~names", ["a", "b"])
        rospy.get_param("frame", default="map")
        rospy.get_param("/robot/mass")
        rospy.get_param("~rate")
        rospy.has_param("~fast")
        for side in ("left", "right"):
            rospy.get_param(f"~{side}/gain", 1)
        rospy.get_param("~")
        """
    )
    declared = {p.name: (p.type.kind if p.type else None, p.value) for p in result.declared().parameters}
    assert declared == {
        "rate": ("Double", 10.0),
        "names": ("Array", ["a", "b"]),
        "/frame": ("String", "map"),
        "/robot/mass": (None, None),
        "fast": (None, None),
        "left/gain": ("Integer", 1),
        "right/gain": ("Integer", 1),
    }
    assert "reads all parameters of ~" in remarks(result)


def test_name_from_a_parameter_is_its_default_and_that_is_said(node):
    result = node("rospy.Subscriber(rospy.get_param('~topic', 'scan'), String)")
    assert names(result) == {"scan"}
    assert "subscriber scan: the default of the parameter ~topic" in remarks(result)


def test_name_from_a_parameter_without_default_is_not_known(node):
    assert names(node("rospy.Subscriber(rospy.get_param('~topic'), String)")) == {
        "{rospy.get_param('~topic')}@nodes/talker:4"
    }


def test_dynamic_reconfigure_makes_its_three_interfaces(node):
    result = node(
        """
        from dynamic_reconfigure.server import Server
        from dynamic_reconfigure.client import Client
        Server(object, print)
        Server(object, print, namespace="inner")
        Client("other")
        """
    )
    servers = {name for kind, name, _ in found(result) if kind == "service server"}
    assert servers == {"~set_parameters", "~inner/set_parameters"}
    assert ("publisher", "~inner/parameter_updates", "dynamic_reconfigure/Config") in found(result)
    assert ("service client", "other/set_parameters", "dynamic_reconfigure/Reconfigure") in found(result)
    assert ("subscriber", "other/parameter_updates", "dynamic_reconfigure/Config") in found(result)


def test_interactive_markers_are_below_their_namespace(node):
    code = """
        from interactive_markers.interactive_marker_server import InteractiveMarkerServer
        InteractiveMarkerServer("marks")
        """
    assert {name for _, name, _ in found(node(code))} == {"marks/update", "marks/update_full", "marks/feedback"}


def test_star_import_of_messages_resolves_by_the_installed_package(node):
    assert found(node("from sensor_msgs.msg import *\nrospy.Publisher('x', LaserScan)")) == {
        ("publisher", "x", "sensor_msgs/LaserScan")
    }


def test_numpy_messages_and_messages_of_any_type(node):
    result = node(
        """
        from rospy.numpy_msg import numpy_msg
        rospy.Subscriber("a", numpy_msg(String))
        rospy.Subscriber("b", rospy.AnyMsg)
        """
    )
    assert found(result) == {("subscriber", "a", "std_msgs/String"), ("subscriber", "b", "")}
    assert "messages of any type" in remarks(result)


def test_plug_in_that_a_package_exports_to_itself_is_followed(package):
    result = package(
        """
        import rospy
        from demo.host import run
        rospy.init_node("host")
        run()
        """,
        export='<export><demo observer="demo.plugins:Light"/></export>',
        host="""
            import importlib
            import rospy
            from demo.base import Observer

            def run():
                observer: Observer = getattr(importlib.import_module(rospy.get_param("~m")), "x")()
                for topic, kind in observer.topics:
                    rospy.Subscriber(topic, kind)
            """,
        base="""
            class Observer:
                def __init__(self, topics):
                    self._topics = list(topics)
                @property
                def topics(self):
                    return self._topics
            """,
        plugins="""
            from std_msgs.msg import Float32
            from demo.base import Observer
            class Light(Observer):
                def __init__(self):
                    super().__init__([("light", Float32)])
            """,
    ).nodes["talker"]
    assert found(result) == {("subscriber", "light", "std_msgs/Float32")}
    assert "only with the plug-in demo.plugins:Light" in remarks(result)
    assert "imports a module whose name is not known" in remarks(result)


def test_module_chosen_from_a_table_is_followed(package):
    result = package(
        """
        import importlib
        import sys
        COMMANDS = {"a": "demo.first:run", "b": "demo.second:run"}
        module, function = COMMANDS[sys.argv[1]].split(":")
        getattr(importlib.import_module(module), function)()
        """,
        first="import rospy\nfrom std_msgs.msg import String\ndef run(): rospy.Publisher('x', String)\n",
        second="import rospy\nfrom std_msgs.msg import String\ndef run(): rospy.Publisher('y', String)\n",
    )
    assert names(result.nodes["talker"]) == {"x", "y"}


def test_function_that_a_decorator_registers_is_followed(node):
    result = node("import click\n@click.command()\ndef run():\n    rospy.Publisher('x', String)\n")
    assert names(result) == {"x"}


def test_recursive_and_circular_code_ends(node):
    result = node(
        """
        def f(x): return g(x) + "a"
        def g(x): return f(x)
        class A:
            def __init__(self): self.b = B(self)
        class B:
            def __init__(self, a): self.a = a; self.name = a.b.name
        class C(C): pass
        t = t + "x"
        rospy.Publisher(f("x"), String)
        rospy.Publisher(A().b.name, String)
        rospy.Publisher(t, String)
        rospy.Publisher(C().x, String)
        """
    )
    assert len(result.ports) == 4
    assert not any(port.is_resolved for port in result.ports)


def test_modules_that_import_a_name_from_each_other_end(package):
    result = package(
        "import rospy\nfrom std_msgs.msg import String\nfrom demo.one import NAME\nrospy.Publisher(NAME, String)\n",
        one="from demo.two import NAME\n",
        two="from demo.one import NAME\n",
    )
    assert names(result.nodes["talker"]) == {"{NAME}@nodes/talker:5"}


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_source_that_was_cut_up_is_read_or_refused_without_a_traceback(tmp_path, data):
    sources = sorted(
        (Path(__file__).parents[4] / "catkin_ws/src/rosgraph_monitor/src/rosgraph_monitor/ros").glob("*.py")
    )
    lines = data.draw(st.sampled_from(sources)).read_text().splitlines()
    start = data.draw(st.integers(0, len(lines)))
    length = data.draw(st.integers(0, 20))
    moved = data.draw(st.integers(0, len(lines)))
    piece = lines[start : start + length]
    del lines[start : start + length]
    lines[moved:moved] = piece
    (tmp_path / "cut.py").write_text("\n".join(lines))
    try:
        result = read_python_node(tmp_path / "cut.py", Library([tmp_path], tmp_path))
    except SourceError as error:
        assert "cut.py:" in str(error)
    else:
        # The place may be in a module of the package that the cut one imports.
        assert all(port.is_resolved or re.search(r"}.*@\S+\.py:\d+$", port.name) for port in result.ports)


def test_hard_code_costs_no_more_than_a_bound(node):
    calls = "\n".join(
        f"def f{i}(x): return f{i + 1}(x) + f{i + 1}(x) if rospy.x{i} else f{i + 1}('b')" for i in range(40)
    )
    result = node(f"{calls}\ndef f40(x): return x\nrospy.Publisher(f0('a'), String)\n")
    assert len(result.ports) >= 1


def test_broken_module_is_a_remark_with_its_place_and_the_rest_is_read(package):
    result = package(
        "import rospy\nfrom std_msgs.msg import String\nimport demo.broken\nrospy.Publisher('x', String)\n",
        broken="def f(:\n    pass\n",
    )
    assert names(result.nodes["talker"]) == {"x"}
    (remark,) = result.unread
    assert str(remark) == "src/demo/broken.py:1:7: not read: no Python 3: invalid syntax"


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"#!/usr/bin/python\nprint 'old'\n", "nodes/talker:2:1: not read: no Python 3: Missing parentheses"),
        (b"#!/usr/bin/python\n\0\0", "nodes/talker:2:1: not read: it is no text but binary"),
        (b"#!/usr/bin/python\n" + b"(" * 100_000, "not read: no Python 3: too many nested parentheses"),
        (b"#!/usr/bin/python\nx = '\xff'\n", "not read: no Python 3: (unicode error)"),
        (b"#!/usr/bin/python\n" + b"-" * 20_000 + b"1\n", "not read: no Python 3"),
        (b"#!/usr/bin/python\n" + b"#" * 5_000_000, "nodes/talker:1:1: not read: 5000018 bytes are too many"),
    ],
    ids=["python2", "binary", "brackets", "encoding", "nesting", "huge"],
)
def test_bad_script_is_told_in_one_line(tmp_path, package, content, said):
    package("")
    (tmp_path / "nodes" / "talker").write_bytes(content)
    result = extract_package(tmp_path)
    assert result.nodes == {}
    (remark,) = result.unread
    assert said in str(remark) and "\n" not in str(remark)


@pytest.mark.parametrize(
    "code",
    [
        f"t = {' + '.join(['x'] * 500)}",
        "t = 'a'" + "".join(f"\nt{i} = t{i - 1 if i else ''} + 'b'" for i in range(900)) + "\nt = t899",
        "".join(f"def f{i}(x): return f{i + 1}([x])\n" for i in range(900)) + "t = f0('a')",
        f"t = {'[' * 90}'a'{']' * 90}",
    ],
    ids=["sum", "assignments", "calls", "lists"],
)
def test_deep_code_does_not_exhaust_the_stack(node, code):
    result = node(f"{code}\nrospy.Publisher(t, String)\n")
    (port,) = result.ports
    assert not port.is_resolved


def doubled(first, line):
    return first + "".join(f"\nt{i + 1} = {line.replace('T', f't{i}')}" for i in range(25)) + "\nt = t25"


@pytest.mark.parametrize(
    "code",
    [
        doubled("t0 = 'aaaa'", "T + T"),
        doubled("t0 = [1]", "[T, T]"),
        doubled("t0 = 9999", "T * T"),
        doubled("t0 = f'{x}a'", "f'{T}{T}'"),
        doubled("t0 = 1", "{1: T, 2: T}"),
        "t = 'a%0300000000d' % 1",
        "t = 'a%*d' % (300000000, 1)",
        "t = 'a{:300000000}'.format(1)",
        "t = 'a{:{}}'.format(1, 300000000)",
        f"t = {'a' * 9000!r}.replace('a', {'b' * 9000!r})",
        f"t = {'a' * 9000!r}.join({'b' * 9000!r})",
    ],
)
def test_value_that_grows_without_bound_is_not_known(node, code):
    result = node(f"{code}\nrospy.get_param('~p', t)\nrospy.Publisher(t, String)\n")
    (port,) = result.ports
    assert not port.is_resolved
    assert len(port.name) < 100_000
    assert result.parameters[0].default is None


@pytest.mark.parametrize(
    "value",
    [
        *("'%d' % 1e999", "'%c' % -1", "'%c' % 99999999", "'{:c}'.format(-1)"),
        *("int(1e999)", f"float(1{'0' * 400})", f"len(range(1{'0' * 400}))", "str(b'a', 'nope')"),
        *("'a'.split('')", "os.path.join()", f"str(0x{'f' * 5000})", f"f'{{0x{'f' * 5000}}}'"),
        *("{[]: 1}", "{{}: 1}", "{(1, []): 2}", "{print: 1}"),
    ],
)
def test_expression_that_fails_is_not_known(node, value):
    result = node(f"import os\nrospy.get_param('~p', {value})\nrospy.Publisher({value}, String)\n")
    (port,) = result.ports
    assert not port.is_resolved
    assert [(parameter.name, parameter.default) for parameter in result.parameters] == [("~p", None)]


@pytest.mark.parametrize("value", [10**400, "9" * 400, 1e999])
def test_default_without_notation_is_left_out_of_the_declaration(value):
    default = int(value) if isinstance(value, str) else value
    parameters = tuple(FoundParameter(f"~{kind or 'p'}", default, Position(), kind) for kind in ("", "Double"))
    assert [parameter.value for parameter in NodeSource("n", (), parameters).declared().parameters] == [None, None]


def test_import_of_many_parts_costs_little(package):
    start = time.process_time()
    package(f"import rospy\nimport {'.'.join('a' * 10_000)}\nrospy.init_node('a')\n")
    assert time.process_time() - start < 5


def test_model_says_what_could_not_be_resolved(package):
    result = package(
        "import rospy, sys\nfrom std_msgs.msg import String\nrospy.init_node('a')\nrospy.Publisher(sys.x, String)\n"
    )
    header = result.model().header
    assert "nodes/talker:5:1: publisher: its name is not known: {sys.x}" in header
    (declared,) = result.package.artifacts[0].nodes[0].ports
    assert (declared.kind, declared.name) == (PortKind.PUBLISHER, "{sys.x}@nodes/talker:5")
    assert result.package.dependencies == ("rospy",) and result.package.external_dependencies == ("numpy",)


def test_buffer_without_debugging_has_no_service(node):
    result = node("import tf2_ros\nrospy.init_node('a')\ntf2_ros.Buffer(debug=False)\n")
    assert found(result) == set()


def test_functions_of_ros_are_known_where_all_names_of_a_module_are_imported(node):
    result = node(
        """
        from interactive_markers.interactive_marker_server import *
        from rospy import *
        init_node("a")
        InteractiveMarkerServer("handles")
        get_param("~rate", 10)
        """
    )
    assert result.name == "a"
    assert names(result) == {"handles/update", "handles/update_full", "handles/feedback"}
    assert [(p.name, p.default) for p in result.parameters] == [("~rate", 10)]


def test_server_of_dynamic_reconfigure_has_the_parameters_of_its_cfg_file(package, tmp_path):
    (tmp_path / "cfg").mkdir()
    (tmp_path / "cfg" / "Drive.cfg").write_text(
        "from dynamic_reconfigure.parameter_generator_catkin import *\n"
        "gen = ParameterGenerator()\n"
        "gen.add('speed', double_t, 0, 'm/s', 1, 0, 2)\n"
        "exit(gen.generate('demo', 'demo', 'Drive'))\n"
    )
    script = """
        import rospy
        from dynamic_reconfigure.server import Server
        from demo.cfg import DriveConfig
        rospy.init_node("a")
        Server(DriveConfig, print)
        Server(DriveConfig, print, "left")
        """
    result = package(textwrap.dedent(script)).nodes["talker"]
    assert [(p.name, p.default, p.kind) for p in result.parameters] == [
        ("~speed", 1, "Double"),
        ("~left/speed", 1, "Double"),
    ]
