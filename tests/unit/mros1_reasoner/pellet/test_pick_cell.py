"""A pick cell, from its models by way of `rosmodel` to Pellet: two drivers that each of three variants requires."""

import pytest
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge import vocabulary as v
from mros1_reasoner.knowledge.model import Facts

CELL = """RosSystem { Name cell
    RosComponents (
        ComponentInterface { name arm FromRosNode 'p.arm.arm'
            RosPublishers { RosPublisher joints { RefPublisher 'p.arm.arm.joints' } } },
        ComponentInterface { name camera FromRosNode 'p.camera.camera'
            RosPublishers { RosPublisher image { RefPublisher 'p.camera.camera.image' } } },
        ComponentInterface { name picker FromRosNode 'p.picker.picker'
            RosActionServers { RosActionServer pick { RefServer 'p.picker.picker.pick' } }
            RosSubscribers {
                RosSubscriber joints { RefSubscriber 'p.picker.picker.joints' },
                RosSubscriber image { RefSubscriber 'p.picker.picker.image' } }
            RosParameters { RosParameter speed { RefParameter 'p.picker.picker.speed' value 0.5 } } }
    )
    TopicConnections {
        TopicConnection joints { From ( 'arm.joints' ) To ( 'picker.joints' ) },
        TopicConnection image { From ( 'camera.image' ) To ( 'picker.image' ) }
    }
}"""
DRIVERS = ("arm", "camera")


@pytest.fixture
def knowledge_base(run, tmp_path):
    """Pick cell as `rosmodel init` makes it, with two more rows in each of its tables."""
    models = tmp_path / "pick_cell" / "models"
    models.mkdir(parents=True)
    (models / "cell.rossystem").write_text(CELL)
    assert run("init", models / "cell.rossystem")[0] == 0
    for table in ("variants.csv", "qa.csv"):
        path = models / table
        header, row = path.read_text().splitlines()
        first = row.split(",")[0]
        path.write_text("\n".join([header, row, row.replace(first, "slow"), row.replace(first, "slower"), ""]))
    status, out, err = run("generate", "tomasys", models, "-o", models.parent)
    assert (status, err) == (0, ""), out
    return read_knowledge_base([models / "cell.owl"])


def test_every_variant_can_run_and_suffers_from_every_driver(knowledge_base, reasoner):
    designs = {name: design.components for name, design in knowledge_base.designs.items()}
    assert list(designs.values()) == [frozenset(DRIVERS)] * 3
    (objective,) = knowledge_base.objectives
    for running in designs:
        works = Facts((objective,), {objective.name: running})
        assert knowledge_base.analyse(works, reasoner).unrealisable == {}
        for driver in DRIVERS:
            broken = Facts((objective,), {objective.name: running}, components={driver: v.FAILED})
            analysis = knowledge_base.analyse(broken, reasoner)
            assert analysis.unrealisable == dict.fromkeys(designs, (driver,))
            assert analysis.objectives[objective.name].status == v.IN_ERROR_COMPONENT
