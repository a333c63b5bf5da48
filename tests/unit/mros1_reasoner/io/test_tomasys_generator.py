import copy
from dataclasses import replace
from pathlib import Path

import pytest
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.io.tomasys_generator import generate
from mros1_reasoner.knowledge.model import Direction, Need, Quality
from ros_model.generators import find_generators
from ros_model.io.project import load_project

SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
D2 = SOURCES / "metacontrol_sim" / "models"


@pytest.fixture(scope="module")
def project():
    return load_project(D2)


@pytest.fixture
def written(project, tmp_path):
    (path,) = generate(project, tmp_path)
    return path


def test_generator_is_found_through_the_export(project, tmp_path):
    (path,) = find_generators()["tomasys"](project, tmp_path)
    assert path == tmp_path / "models" / "d2.owl"


def test_committed_model_is_the_generated_one(written):
    assert written.read_text() == (D2 / "d2.owl").read_text(), "run rosmodel generate tomasys"


def test_every_variant_is_a_design_with_its_levels_and_components(project, written):
    knowledge_base = read_knowledge_base([written])
    assert set(knowledge_base.designs) == {variant.name for variant in project.variants}
    required = project.required_components()
    for variant in project.variants:
        design = knowledge_base.designs[variant.name]
        assert design.function == "f_navigate"
        assert design.expected == variant.expected_qas
        assert design.components == required[variant.name]


def test_every_design_deploys_the_nodes_of_its_variant_and_requires_none_of_them(written):
    knowledge_base = read_knowledge_base([written])
    assert knowledge_base.own_nodes == {"move_base"}
    for design in knowledge_base.designs.values():
        assert design.nodes == {"move_base"}
        assert not design.nodes & design.components


def test_laser_variants_require_the_laser_and_camera_variants_the_camera(written):
    designs = read_knowledge_base([written]).designs.values()
    assert all(("front_laser" in d.components) != d.name.endswith(("_k", "_b")) for d in designs)
    assert all(("rear_laser" in d.components) == d.name.endswith("_b") for d in designs)
    assert all(("camera" in d.components) == d.name.endswith("_k") for d in designs)


def test_objectives_and_directions_are_those_of_metacontrol_yaml(written):
    knowledge_base = read_knowledge_base([written])
    assert [(o.name, o.function, dict(o.limits)) for o in knowledge_base.objectives] == [
        ("o_navigate", "f_navigate", {"safety": 0.6, "energy": 0.62})
    ]
    assert knowledge_base.qualities["performance"].direction is Direction.HIGHER_IS_BETTER
    assert knowledge_base.qualities["energy"].direction is Direction.LOWER_IS_BETTER


def test_ranges_and_comparisons_are_those_of_metacontrol_yaml(project, tmp_path):
    settings = {**project.settings, "quality_attributes": {**project.settings["quality_attributes"]}}
    settings["quality_attributes"]["energy"] = {
        "direction": "lower_is_better",
        "range": [0.0, 2.5],
        "reaching_violates": True,
    }
    settings["objectives"] = {"o_go": {"function": "f_navigate", "always_improve": True}}
    (path,) = generate(replace(project, settings=settings), tmp_path)
    knowledge_base = read_knowledge_base([path])
    assert knowledge_base.qualities["energy"] == Quality(Direction.LOWER_IS_BETTER, True, 0.0, 2.5)
    assert knowledge_base.qualities["safety"] == Quality(Direction.LOWER_IS_BETTER, False, 0.0, 1.0)
    assert knowledge_base.objectives[0].always_improve is True


@pytest.mark.parametrize(("band", "limits"), [([0.2, 0.6], {"safety_min": 0.2, "safety": 0.6})])
def test_band_becomes_two_limits(project, tmp_path, band, limits):
    content = copy.deepcopy(project.settings)
    content["objectives"]["o_navigate"]["nfrs"] = {"safety": band}
    (path,) = generate(replace(project, settings=content), tmp_path)
    (objective,) = read_knowledge_base([path]).objectives
    assert objective.limits == limits


def test_surroundings_are_needed_by_designs_that_require_a_component_and_by_variants(project, tmp_path):
    content = copy.deepcopy(project.settings)
    content["environment"] = {"light": {"required_by": {"camera": {"least": 0.25}, "f1_v1_r1": {"most": 0.9}}}}
    (path,) = generate(replace(project, settings=content), tmp_path)
    designs = read_knowledge_base([path]).designs
    seeing = {name for name, components in project.required_components().items() if "camera" in components}
    assert {name for name, design in designs.items() if Need("light", least=0.25) in design.needs} == seeing
    assert Need("light", most=0.9) in designs["f1_v1_r1"].needs
