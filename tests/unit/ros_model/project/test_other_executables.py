"""Variants whose component is another node: its ports are wired by their names, and what both have stays."""

import pytest
from ros_model.errors import ModelError
from ros_model.io.project import read_table
from ros_model.language.library import Library
from ros_model.language.metamodel import PortPath
from ros_model.language.packages_reader import parse_packages
from ros_model.language.system_reader import parse_system
from ros_model.project.columns import parse_columns
from ros_model.project.executables import alternatives
from ros_model.project.variants import make_systems

BASE = parse_system(
    """RosSystem { Name yard
    RosComponents (
        ComponentInterface { name camera NameSpace 'north' FromRosNode 'cameras.camera.camera'
            RosPublishers { RosPublisher 'image' { RefPublisher 'cameras.camera.camera.image' },
                            RosPublisher 'depth' { RefPublisher 'cameras.camera.camera.depth' } }
            RosSrvServers { RosServiceServer 'light' { RefServer 'cameras.camera.camera.~light' } } },
        ComponentInterface { name tracker NameSpace 'north' FromRosNode 'trackers.fine.tracker'
            RosPublishers { RosPublisher 'people' { RefPublisher 'trackers.fine.tracker.targets' } }
            RosSubscribers { RosSubscriber 'image' { RefSubscriber 'trackers.fine.tracker.image' } }
            RosParameters { RosParameter 'rate' { RefParameter 'trackers.fine.tracker.rate' value 10.0 },
                            RosParameter 'model' { RefParameter 'trackers.fine.tracker.model' value 'big' } } },
        ComponentInterface { name gate FromRosNode 'gates.gate.gate'
            RosSubscribers { RosSubscriber 'north/people' { RefSubscriber 'gates.gate.gate.people' } } }
    )
    TopicConnections {
        TopicConnection image { From ( 'camera.image' ) To ( 'tracker.image' ) },
        TopicConnection people { From ( 'tracker.people' ) To ( 'gate.north/people' ) }
    } }""",
    "yard.rossystem",
)
MODELS = """PackageSet { CatkinPackage trackers {
    Artifact fine { Node { name tracker
        Publishers { Publisher { name 'targets' message 'a.A' }, Publisher { name 'debug' message 'a.A' } }
        Subscribers { Subscriber { name 'image' message 'a.A' } }
        Parameters { Parameter { name 'rate' type Double }, Parameter { name 'model' type String } } } },
    Artifact coarse { Node { name tracker
        Publishers { Publisher { name 'targets' message 'a.A' }, Publisher { name '~state' message 'a.A' },
                     Publisher { name 'debug' message 'a.A' } }
        Subscribers { Subscriber { name 'depth' message 'a.A' } }
        ServiceClients { ServiceClient { name 'light' service 'a.S' } }
        Parameters { Parameter { name 'rate' type Double } } } },
    Artifact free { Node { name tracker
        Publishers { Publisher { name 'targets' message 'a.A' } }
        Subscribers { Subscriber { name '{topic}@free.cpp:3' message 'a.A' } }
        Parameters { Parameter { name '{key}@free.cpp:4' } } } },
    Artifact plain { Node { name tracker Publishers { Publisher { name 'targets' message 'a.A' } } } }
} }"""
FINE, COARSE, FREE, PLAIN = (f"trackers.{name}.tracker" for name in ("fine", "coarse", "free", "plain"))


@pytest.fixture
def variants(tmp_path):
    """Return a function that makes the variants of a table, by their names."""

    def make(*rows, nodes=None, header="name,tracker"):
        path = tmp_path / "variants.csv"
        path.write_text("\n".join((header, *rows)) + "\n")
        chosen = nodes or {"fine": FINE, "coarse": COARSE, "free": FREE, "plain": PLAIN}
        section = {"component": "tracker", "nodes": {"tracker": chosen}}
        library = Library(parse_packages(MODELS, "trackers.ros").packages)
        made = make_systems(BASE, parse_columns(section), read_table(path), library=library)
        return {whole.name: (whole, part) for whole, part in made}

    return make


def ends(system):
    return {(source, target) for c in system.connections for source in c.sources for target in c.targets}


def test_node_of_the_base_stays_as_it_is(variants):
    whole, _ = variants("a,fine")["a"]
    assert (whole.components, whole.connections) == (BASE.components, BASE.connections)


def test_other_node_has_its_own_ports_and_is_wired_by_their_names(variants):
    _, part = variants("a,coarse")["a"]
    (tracker,) = part.components
    assert str(tracker.node) == COARSE
    assert {port.name for port in tracker.ports} == {"people", "tracker/state", "depth", "light"}
    assert ends(part) == {
        (PortPath("tracker", "people"), PortPath("gate", "north/people")),  # remapped as before
        (PortPath("camera", "depth"), PortPath("tracker", "depth")),
        (PortPath("camera", "light"), PortPath("tracker", "light")),
    }


def test_values_of_parameters_stay_that_both_nodes_have(variants):
    whole, _ = variants("a,coarse")["a"]
    assert [(p.key, p.value) for p in whole.component("tracker").parameters] == [("rate", 10.0)]


def test_row_may_set_a_parameter_of_the_other_node(variants):
    whole, _ = variants("a,coarse,2.0", header="name,tracker,tracker.rate")["a"]
    (rate,) = whole.component("tracker").parameters
    assert (rate.value, str(rate.reference)) == (2.0, "trackers.coarse.tracker.rate")


def test_node_without_parameters_gets_none(variants):
    whole, _ = variants("a,plain")["a"]
    assert whole.component("tracker").parameters == ()


def test_executable_that_runs_elsewhere_in_the_system_is_no_alternative_by_its_types_alone():
    camera = """PackageSet { CatkinPackage cameras { Artifact camera { Node { name camera
        Publishers { Publisher { name 'raw' message 'a.A' } } } } } }"""
    packages = (package for text in (MODELS, camera) for package in parse_packages(text).packages)
    found = alternatives(BASE, BASE.component("tracker"), Library(packages))
    assert {reference.artifact for reference in found} == {"coarse", "free", "plain"}


def test_what_the_model_of_the_other_node_does_not_know_stays(variants):
    _, part = variants("a,free")["a"]
    (tracker,) = part.components
    assert {port.name for port in tracker.ports} == {"people", "image"}
    assert {p.key for p in tracker.parameters} == {"rate", "model"}
    assert (PortPath("camera", "image"), PortPath("tracker", "image")) in ends(part)


def test_value_without_a_node_takes_the_component_out_of_the_variant(variants):
    whole, part = variants("a,none", nodes={"coarse": COARSE, "none": []})["a"]
    assert {component.name for component in whole.components} == {"camera", "gate"}
    assert (part.components, part.connections) == ((), ())


@pytest.mark.parametrize(
    ("row", "nodes", "message"),
    [
        ("a,other", None, "column 'tracker' is 'other', must be fine or coarse or free or plain"),
        ("a,odd", {"odd": "trackers.odd.tracker"}, "declares no artifact 'odd': `rosmodel extract`"),
        ("a,odd", {"odd": "trackers.odd"}, "write PACKAGE.EXECUTABLE.NODE"),
    ],
)
def test_what_is_wrong_is_told(variants, row, nodes, message):
    with pytest.raises(ModelError, match=message):
        variants(row, nodes=nodes)
