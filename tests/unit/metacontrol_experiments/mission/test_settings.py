"""The settings of a mission."""

from metacontrol_experiments.mission.routes import Route
from metacontrol_experiments.mission.settings import Settings
from robot_formulas.geometry import Pose


def test_launch_command_gives_the_requirements_to_the_reasoner_only(tmp_path):
    route = Route("r1", Pose(-1.5, 2.0, 0.5), Pose(3.0, 4.0, 0.0))
    command = Settings(route, tmp_path).launch_command(4000)
    assert command[:5] == ["roslaunch", "-p", "4000", "metacontrol_sim", "metacontrol_sim_reasoner.launch"]
    assert "initial_pose_x:=-1.5" in command and "nfr_safety:=0.6" in command
    baseline = Settings(route, tmp_path, metacontrol=False).launch_command(4000)
    assert baseline[4] == "MVP_metacontrol_world.launch"
    assert not any(argument.startswith("nfr_") for argument in baseline)
