"""Repairs of metacontrol.yaml, by way of the generated ontology to what the reasoner knows of them."""

import pytest
import yaml
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.tomasys_generator import generate
from mros1_reasoner.knowledge.model import Repair
from ros_model.errors import ModelError
from ros_model.io.project import load_project

# A sprayer in a greenhouse: its pump feeds the boom, which the variants bring; a fan serves no design.
BASE = """RosSystem { Name sprayer RosComponents (
    ComponentInterface { name pump NameSpace tank FromRosNode 'spray.pump.pump'
        RosPublishers { RosPublisher pressure { RefPublisher 'spray.pump.pump.pressure' } } },
    ComponentInterface { name fan FromRosNode 'spray.fan.fan' },
    ComponentInterface { name boom FromRosNode 'spray.boom.boom'
        RosSubscribers { RosSubscriber pressure { RefSubscriber 'spray.boom.boom.pressure' } } } )
    TopicConnections { TopicConnection pressure { From ( 'pump.pressure' ) To ( 'boom.pressure' ) } } }"""
SETTINGS = {
    "package": "sprayer",
    "base": "sprayer.rossystem",
    "variants": {"component": "boom", "table": "boom.csv", "parameters": {"width": ["width"]}},
    "functions": {"f_spray": {"designs": "all"}},
    "quality_attributes": {"dose": {"direction": "higher_is_better"}},
    "utility": "dose",
    "objectives": {"o_spray": {"function": "f_spray"}},
}


@pytest.fixture
def knowledge_base(tmp_path):
    def make(**components):
        (tmp_path / "sprayer.rossystem").write_text(BASE)
        (tmp_path / "boom.csv").write_text("name,width\nnarrow,1\nwide,4\n")
        (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(SETTINGS | {"components": components}))
        (path,) = generate(load_project(tmp_path), tmp_path)
        return read_knowledge_base([path], utility="dose")

    return make


def test_reasoner_knows_what_a_repair_takes_and_not_by_what_means(knowledge_base):
    found = knowledge_base(
        pump={"repair": {"service": "tank/prime", "duration": 0.1, "success": 0.65, "attempts": 5}},
        fan={"repair": {"launch": {"file": "fan.launch"}, "duration": 4}},
        water={"topic": "level", "below": 0.1, "repair": {"service": "refill", "duration": 90, "success": 1}},
    )
    assert found.repairs == {
        "tank/pump": Repair("tank/pump", 0.1, 0.65, 5),
        "fan": Repair("fan", 4.0),
        "water": Repair("water", 90.0, 1.0),
    }
    assert found.designs["wide"].components == {"tank/pump"}
    saved = found.rdf_xml().decode()
    assert "prime" not in saved and "fan.launch" not in saved


def test_repairs_change_nothing_of_what_is_reasoned_about(knowledge_base):
    plain = knowledge_base(pump={"node": "tank/pump"})
    repairable = knowledge_base(pump={"node": "tank/pump", "repair": {"service": "prime", "duration": 1}})
    assert set(repairable.repairs) == {"pump"}
    assert repairable.ontology == plain.ontology


def test_name_that_is_that_of_a_repair_is_refused(knowledge_base):
    with pytest.raises(ModelError, match="'repair_of_fan' names a component and a repair: rename one"):
        knowledge_base(repair_of_fan={"topic": "fan/hours"}, fan={"repair": {"service": "fan/reset", "duration": 1}})
