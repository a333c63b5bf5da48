"""The settings of a mission."""

import pytest
from metacontrol_experiments.mission.routes import Route
from metacontrol_experiments.mission.settings import Settings
from robot_formulas.geometry import Pose


def test_launch_command_gives_the_requirements_to_the_reasoner_only(tmp_path):
    route = Route("r1", Pose(-1.5, 2.0, 0.5), Pose(3.0, 4.0, 0.0))
    command = Settings(route, tmp_path).launch_command(4000)
    assert command[:5] == ["roslaunch", "-p", "4000", "metacontrol_sim", "metacontrol_sim_reasoner.launch"]
    assert "initial_pose_x:=-1.5" in command and "nfr_safety:=0.6" in command
    baseline = Settings(route, tmp_path, manager="none").launch_command(4000)
    assert baseline[4] == "MVP_metacontrol_world.launch"
    assert not any(argument.startswith("nfr_") for argument in baseline)


@pytest.mark.parametrize(
    ("manager", "spares", "known"),
    [("mros", True, True), ("rules", True, True), ("rules", False, False), ("as_published", True, False)],
)
def test_what_adapts_knows_spares_unless_the_mission_or_the_published_system_has_none(tmp_path, manager, spares, known):
    route = Route("r1", Pose(-1.5, 2.0, 0.5), Pose(3.0, 4.0, 0.0))
    settings = Settings(route, tmp_path, manager=manager, spares=spares)
    assert f"spares:={str(known).lower()}" in settings.launch_command(4000)
    assert settings.describe().get("spares") == ("true" if known else None)
    baseline = Settings(route, tmp_path, manager="none")
    assert not any(text.startswith("spares:=") for text in baseline.launch_command(4000))


@pytest.mark.parametrize(("manager", "told"), [("mros", None), ("none", None), ("rules", "rules")])
def test_start_of_the_mission_names_a_manager_that_metacontrol_does_not_tell(tmp_path, manager, told):
    route = Route("r1", Pose(-1.5, 2.0, 0.5), Pose(3.0, 4.0, 0.0))
    values = Settings(route, tmp_path, manager=manager).describe()
    assert values.get("manager") == told and values["metacontrol"] == str(manager != "none").lower()


@pytest.mark.parametrize(
    ("manager", "environment", "observed"),
    [("mros", True, True), ("rules", True, True), ("mros", False, False), ("as_published", True, False)],
)
def test_surroundings_are_observed_unless_the_mission_or_the_published_reasoner_has_none(
    tmp_path, manager, environment, observed
):
    route = Route("r1", Pose(-1.5, 2.0, 0.5), Pose(3.0, 4.0, 0.0))
    settings = Settings(route, tmp_path, manager=manager, environment=environment)
    assert f"environment:={str(observed).lower()}" in settings.launch_arguments
    assert settings.describe().get("environment") == ("true" if observed else None)
