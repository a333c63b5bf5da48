"""Families as published: no wiring, parameters with doubled labels, the degree of safety in place of the risk."""

import os
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml
from helpers import launch_files
from mros1_reasoner.io.ontology_files import read_knowledge_base
from ros_model.cli.rosmodel import main
from ros_model.io.project import load_project

CORPUS = os.environ.get("MROS_CORPUS")
SOURCES = Path(__file__).parents[4] / "catkin_ws" / "src"
NODE = "move_base.move_base.move_base"
SETTINGS = {
    "package": "published",
    "base": "robot.rossystem",
    "variants": {},
    "functions": {"f_navigate": {"designs": "all", "requires": {}}},
    "quality_attributes": {
        "safety": {"direction": "higher_is_better"},
        "energy": {"direction": "lower_is_better"},
        "performance": {"direction": "higher_is_better"},
    },
    "utility": "performance",
    "objectives": {"o_navigate": {"function": "f_navigate", "nfrs": {"safety": 0.4, "energy": 0.62}}},
    "components": {"front_laser": {"node": "front_laser"}, "camera": {"node": "camera"}},
    "requires": {"observation_sources": {"scan": "front_laser", "point_cloud": "camera"}},
}


def system(name, source):
    parameters = ", ".join(
        f"RosParameter '{label}' {{ RefParameter '{NODE}.{costmap}/{parameter}' value {value} }}"
        for costmap in ("local_costmap", "global_costmap")
        for label, parameter, value in (
            ("inflation_radius", "inflater_layer/inflation_radius", 0.5),
            ("observation_sources", "obstacles_layer/observation_sources", source),
        )
    )
    return f"""RosSystem {{ Name '{name}'
        RosComponents ( ComponentInterface {{ name move_base RosParameters {{ {parameters} }} }} )
        Parameters {{
            Parameter {{ name qa_safety type Double value 0.7 }},
            Parameter {{ name qa_energy type Double value 0.3 }} }} }}"""


@pytest.fixture
def models(tmp_path):
    folder = tmp_path / "models"
    (folder / "variants").mkdir(parents=True)
    (folder / "robot.rossystem").write_text("RosSystem { Name robot }")
    (folder / "metacontrol.yaml").write_text(yaml.safe_dump(SETTINGS))
    for name, source in (("slow", "scan"), ("slow_k", "point_cloud"), ("both", "'scan point_cloud'")):
        (folder / "variants" / f"{name}.rossystem").write_text(system(name, source))
    return folder


def generate(folder):
    with pytest.raises(SystemExit) as done:
        main(["generate", "all", str(folder), "-o", str(folder.parent)])
    assert done.value.code == 0


def required_by(owl):
    tomasys, rdf, mros = (f"{{{uri}#}}" for uri in (
        "http://metacontrol.org/tomasys", "http://www.w3.org/1999/02/22-rdf-syntax-ns", "http://ros/mros"))  # fmt: skip
    return {
        component.attrib[f"{rdf}about"]: {link.attrib[f"{rdf}resource"] for link in component.iter(f"{mros}requiredBy")}
        for component in ET.parse(owl).iter(f"{tomasys}Component")  # noqa: S314
    }


def test_values_of_parameters_say_what_variants_require(models):
    generate(models)
    assert required_by(models / "robot.owl") == {
        "#front_laser": {"#slow", "#both"},
        "#camera": {"#slow_k", "#both"},
        "#move_base": set(),  # the variants bring it themselves
    }


def test_both_costmaps_get_their_value(models):
    generate(models)
    config = launch_files.read(models.parent / "launch/variants/slow.launch")
    assert config.params["/move_base/local_costmap/obstacles_layer/observation_sources"].value == "scan"
    assert config.params["/move_base/global_costmap/inflater_layer/inflation_radius"].value == 0.5
    assert config.params["/qa_safety"].value == 0.7


def test_hierarchy_of_functions_reaches_the_ontology(models):
    settings = SETTINGS | {
        "functions": {
            "f_pick": {"designs": ["slow", "both"], "requires": {"slow": ["f_move"]}},
            "f_move": {"designs": ["slow_k"]},
        },
        "objectives": {"o_pick": {"function": "f_pick"}},
    }
    (models / "metacontrol.yaml").write_text(yaml.safe_dump(settings))
    generate(models)
    designs = read_knowledge_base([models / "robot.owl"]).designs
    assert {name: (design.function, design.requires) for name, design in designs.items()} == {
        "slow": ("f_pick", ("f_move",)),
        "both": ("f_pick", ()),
        "slow_k": ("f_move", ()),
    }


@pytest.mark.skipif(not CORPUS, reason="MROS_CORPUS names no folder of published models")
def test_published_variants_give_a_whole_deployment(models):
    for path in (models / "variants").iterdir():
        path.unlink()
    for path in Path(CORPUS or "").glob("rossystem/f?_v?_r*.rossystem"):
        shutil.copy(path, models / "variants")
    generate(models)
    project = load_project(models)
    assert len(project.variants) >= 8
    required = required_by(models / "robot.owl")
    for variant in project.variants:
        assert f"#{variant.name}" in required["#camera" if variant.name.endswith("_k") else "#front_laser"]
        config = launch_files.read(models.parent / f"launch/variants/{variant.name}.launch")
        assert [(node.package, node.type, node.name) for node in config.nodes] == [("move_base",) * 3]
        assert f"{variant.name}_safety" in (models / "robot.owl").read_text()
