"""D2's models: what is generated from them is what the repository holds."""

from pathlib import Path

import pytest
import yaml
from mros1_reasoner.io.ontology_files import read_knowledge_base
from mros1_reasoner.knowledge.model import Need
from pybullet_simulator.robot.laser_and_camera import FULL_LIGHT
from ros_model.cli.rosmodel import main
from ros_model.io.files import resolve
from ros_model.io.models import read_system
from ros_model.io.project import load_project
from ros_model.language.system_writer import write_system
from roslaunch.config import ROSLaunchConfig
from roslaunch.xmlloader import XmlLoader

PACKAGE = Path(__file__).parents[3] / "catkin_ws" / "src" / "metacontrol_sim"
MODELS = PACKAGE / "models"


@pytest.fixture(scope="module")
def project():
    return load_project(MODELS)


def test_committed_artefacts_are_those_of_the_models(tmp_path, capsys):
    with pytest.raises(SystemExit) as done:
        main(["generate", "all", str(MODELS), "-o", str(tmp_path)])
    assert done.value.code == 0, capsys.readouterr().err
    generated = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*") if path.is_file())
    assert [path for path in generated if (PACKAGE / path).read_bytes() != (tmp_path / path).read_bytes()] == []
    for folder in ("models/variants", "launch/variants"):
        committed = sorted(path.relative_to(PACKAGE) for path in (PACKAGE / folder).iterdir())
        assert committed == [path for path in generated if path.parent == Path(folder)]


def test_beside_the_thirty_variants_there_are_nine_on_the_rear_laser(project):
    names = {variant.name for variant in project.variants}
    backwards = {name for name in names if name.endswith("_b")}
    assert len(names - backwards) == 30
    assert backwards == {f"{name}_b" for name in names if "_v1_" in name and name[-2:] not in {"_k", "_b"}}
    assert sum("camera" in required for required in project.required_components().values()) == 3


def test_variant_on_the_rear_laser_differs_by_sensor_and_direction_alone(project):
    parameters = {
        variant.name: {parameter.key: parameter.value for parameter in variant.components[0].parameters}
        for variant in project.variants
    }
    for name in (name for name in parameters if name.endswith("_b")):
        ahead, back = parameters[name.removesuffix("_b")], parameters[name]
        changed = {key: back[key] for key in back if back[key] != ahead.get(key)}
        assert changed == {
            "TrajectoryPlannerROS/max_vel_x": -0.1,
            "TrajectoryPlannerROS/min_vel_x": -0.3,
            "local_costmap/obstacles_layer/observation_sources": "rear_scan",
            "global_costmap/obstacles_layer/observation_sources": "rear_scan",
        }


def test_variant_requires_the_sensor_it_is_wired_to_and_the_battery_if_it_is_fast(project):
    required = project.required_components()
    for variant in project.variants:
        sensor = {"k": "camera", "b": "rear_laser"}.get(variant.name.rpartition("_")[2], "front_laser")
        battery = set() if "_v1_" in variant.name else {"battery"}
        assert required[variant.name] == {"simulator", sensor} | battery


def test_variants_on_the_camera_need_light():
    knowledge = read_knowledge_base([MODELS / "d2.owl"])
    needing = {name: design.needs for name, design in knowledge.designs.items() if design.needs}
    assert needing == dict.fromkeys(("f1_v1_r3_k", "f1_v3_r1_k", "f2_v1_r3_k"), (Need("light", least=FULL_LIGHT),))


def test_models_are_sound_with_all_references_known_and_requirements_shown(capsys):
    with pytest.raises(SystemExit) as done:
        main(["check", str(MODELS)])
    told = capsys.readouterr().out
    assert done.value.code == 0
    assert not any(severity in told for severity in ("error", "warning"))
    assert "  front_laser -> front/scan -> move_base" in told


def test_base_is_in_canonical_form():
    assert write_system(read_system(MODELS / "d2.rossystem")) == (MODELS / "d2.rossystem").read_text()


def test_derived_parameters_follow_the_table(project):
    variant = next(variant for variant in project.variants if variant.name == "f3_v1_r2")
    values = {parameter.key: parameter.value for parameter in variant.components[0].parameters}
    assert values["controller_frequency"] == 25
    assert values["planner_frequency"] == values["global_costmap/update_frequency"] == 5.0
    assert values["local_costmap/update_frequency"] == 12.5
    assert values["TrajectoryPlannerROS/acc_lim_x"] == 3.6
    assert values["local_costmap/inflater_layer/inflation_radius"] == 0.65


def test_every_launch_file_loads_and_starts_only_move_base(project):
    for variant in project.variants:
        config = ROSLaunchConfig()
        XmlLoader(resolve_anon=False).load(str(PACKAGE / "launch/variants" / f"{variant.name}.launch"), config)
        assert [(node.package, node.type, node.name) for node in config.nodes] == [("move_base",) * 3]
        (component,) = variant.components
        for parameter in component.parameters:
            assert config.params[f"/move_base/{parameter.key}"].value == parameter.value


def test_configurations_name_files_that_exist(project):
    manipulator, reasoner, monitor = (
        yaml.safe_load((PACKAGE / "config" / f"{name}.yaml").read_text())
        for name in ("rosgraph_manipulator", "reasoner", "rosgraph_monitor")
    )
    assert set(manipulator["configurations"]) == {variant.name for variant in project.variants}
    for entry in manipulator["configurations"].values():
        assert resolve(entry["launch"]).is_file()
    assert resolve(reasoner["model_file"]).is_file()
    assert resolve(monitor["desired_rossystem"]).is_file()
    assert resolve(monitor["variants"]).is_dir()
