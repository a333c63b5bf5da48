"""Observers by name."""

import sys

import pytest
from rosgraph_monitor.observers.energy import EnergyQualityObserver
from rosgraph_monitor.observers.plugins import PluginError, available, make
from rosgraph_monitor.parser import ModelParser


def test_exported_observers_are_found():
    assert available()["EnergyQualityObserver"] == "rosgraph_monitor.observers.energy:EnergyQualityObserver"


def test_observer_by_name_and_by_class():
    assert isinstance(make("EnergyQualityObserver"), EnergyQualityObserver)
    assert isinstance(make("rosgraph_monitor.observers.energy:EnergyQualityObserver"), EnergyQualityObserver)


@pytest.mark.parametrize("name", ["Nobody", "os:system", "no.such.module:X", "rosgraph_monitor.observer:X", "../x:Y"])
def test_what_is_no_observer_is_refused(name):
    with pytest.raises(PluginError, match="observer"):
        make(name)


PUBLISHED = """from rosgraph_monitor.observer import TopicObserver
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
{imports}

class GripObserver(TopicObserver):
    def __init__(self, name):
        super(GripObserver, self).__init__(name, 10, [])

    def calculate_attr(self, msgs):
        return DiagnosticStatus(message="QA status", values=[KeyValue("grip", str({level}))])
"""
MODEL = """RosSystem { Name cell RosComponents ( ComponentInterface { name /arm
    RosPublishers { RosPublisher state { RefPublisher 'p.arm.arm.state' } }
    RosParameters { RosParameter limits { RefParameter 'p.arm.arm.limits' value { 1, 2 } } } } )
    Parameters { Parameter { name rate type Integer value 5 } } }"""


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Write an observer with its siblings as a package; gives the package's name."""

    def write(imports: str, level: str, **siblings: str) -> str:
        package = f"grip_{len(list(tmp_path.iterdir()))}_{tmp_path.name}"
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").touch()
        (tmp_path / package / "grip.py").write_text(PUBLISHED.format(imports=imports, level=level))
        for name, text in siblings.items():
            (tmp_path / package / f"{name}.py").write_text(text)
        return f"{package}.grip:GripObserver"

    monkeypatch.syspath_prepend(tmp_path)
    return write


def level(target: str) -> str:
    return make(target).evaluate(0.0)[0].values[0].value


@pytest.mark.parametrize(
    "imports",
    [
        "from rosgraph_monitor.parser import ModelParser as Parser",
        "from ros_model_parser.rossystem_parser import RosSystemModelParser as Parser",
    ],
)
def test_observer_that_imports_the_published_parser_runs(written, tmp_path, imports):
    (tmp_path / "cell.rossystem").write_text(MODEL)
    system = f"Parser('{tmp_path}/cell.rossystem').parse()"
    assert level(written(imports, f"{system}.interfaces[0].parameters[0].param_value[0][1]")) == "2"


def test_parsed_system_has_the_published_attributes():
    system = ModelParser(MODEL, isFile=False).parse()
    (arm,) = system.interfaces
    assert (system.system_name, arm.interface_name, arm.publishers[0].pub_name) == (["cell"], ["/arm"], ["state"])
    assert (arm.parameters[0].param_name, arm.parameters[0].param_value) == (["limits"], [[1, 2]])
    assert (list(arm.services), list(system.topic_connections), system.nothing) == ([], [], "")
    assert system.global_parameters[0].param_value == [5]


def test_observer_that_imports_the_published_generator_runs(written):
    imports = (
        "from ros_model_parser.rossystem_parser import RosSystemModelParser\n"
        "from ros_model_generator.rossystem_generator import RosSystemModelGenerator\n"
        "PARTS = {'/arm': {'parameters': {'/arm/rate': [7, int]}, 'publishers': {'/state': 'std_msgs/Bool'}},\n"
        "         'global_parameters': {'/x': [1.5, float]}}\n"
        "TEXT = RosSystemModelGenerator('cell').create_ros_system_model_list(PARTS)[1]\n"
        "MODEL = RosSystemModelParser(TEXT, isFile=False).parse()"
    )
    assert level(written(imports, "MODEL.interfaces[0].parameters[0].param_value[0]")) == "7"


def test_observer_finds_the_modules_beside_it_as_python_2_did(written):
    first = written("from base import LEVEL", "LEVEL", base="from deeper import LEVEL", deeper="LEVEL = 0.25")
    second = written("from base import LEVEL", "LEVEL", base="LEVEL = 0.75")
    assert [level(target) for target in (first, second)] == ["0.25", "0.75"]
    assert "base" not in sys.modules


def test_what_is_nowhere_is_told(written):
    with pytest.raises(PluginError, match="ModuleNotFoundError: No module named 'no_such_module'"):
        make(written("import no_such_module", "0"))
    with pytest.raises(PluginError, match="No module named 'no_such_module'"):
        make(written("import base", "0", base="import no_such_module"))
