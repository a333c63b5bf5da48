"""`rosmodel variants`: families from a base, a table and options, or from two sections of metacontrol.yaml."""

import shutil
from pathlib import Path

import pytest
from ros_model.checks.systems import check_system
from ros_model.cli.rosmodel import main
from ros_model.io.models import read_system

D2 = Path(__file__).parents[4] / "catkin_ws" / "src" / "metacontrol_sim" / "models"
BASE = D2 / "d2.rossystem"
COSTMAPS = ("local_costmap", "global_costmap")
OPTIONS = [
    *("--component", "move_base", "--qa", D2 / "qa.csv"),
    *("--set", "controller_frequency_hz=controller_frequency"),
    *("--set", "controller_frequency_hz=planner_frequency*0.2"),
    *("--set", "controller_frequency_hz=global_costmap/update_frequency*0.2"),
    *("--set", "controller_frequency_hz=local_costmap/update_frequency*0.5"),
    *(o for end in ("max", "min") for o in ("--set", f"{end}_vel_x_mps=TrajectoryPlannerROS/{end}_vel_x")),
    *("--set", "max_vel_mps=TrajectoryPlannerROS/max_vel_y"),
    *(o for axis in "xy" for o in ("--set", f"max_vel_mps=TrajectoryPlannerROS/acc_lim_{axis}*12")),
    *(o for c in COSTMAPS for o in ("--set", f"inflation_radius_m={c}/inflater_layer/inflation_radius")),
    *(o for c in COSTMAPS for o in ("--set", f"observation_source={c}/obstacles_layer/observation_sources")),
    *("--connect", "observation_source:scan=front_laser.front/scan"),
    *("--connect", "observation_source:rear_scan=rear_laser.rear/scan"),
    *("--connect", "observation_source:point_cloud=camera.camera/depth/points"),
]  # fmt: skip


@pytest.fixture
def run(capsys):
    def run_command(*arguments):
        with pytest.raises(SystemExit) as done:
            main([str(argument) for argument in ("variants", *arguments)])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return done.value.code, captured.out, captured.err

    return run_command


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_options_alone_make_all_of_d2_from_its_base(run, tmp_path):
    status, out, err = run(BASE, D2 / "variants.csv", "-o", tmp_path, *OPTIONS)
    assert (status, out, err) == (0, f"variants: 39 files in {tmp_path}\n", "")
    assert contents(tmp_path) == contents(D2 / "variants")


def test_two_sections_of_metacontrol_yaml_are_enough(run, tmp_path):
    text = (D2 / "metacontrol.yaml").read_text()
    models = tmp_path / "models"
    models.mkdir()
    (models / "metacontrol.yaml").write_text(text[text.index("base:") : text.index("functions:")])
    for name in ("d2.rossystem", "variants.csv", "qa.csv"):
        shutil.copy(D2 / name, models)
    assert run(models)[0] == 0
    assert contents(models / "variants") == contents(D2 / "variants")


def test_table_in_place_of_that_of_the_project(run, tmp_path):
    table = tmp_path / "other.yaml"
    table.write_text(
        "crawl: {controller_frequency_hz: 5, max_vel_mps: 0.1, inflation_radius_m: 1, observation_source: scan, "
        "max_vel_x_mps: 0.1, min_vel_x_mps: null}"
    )
    qa = tmp_path / "qa.csv"
    qa.write_text("name,safety,source,safety_spread,missions,seeds\ncrawl,0.1,measured,0.02,30,1-5\n")
    assert run(D2, table, "--qa", qa, "-o", tmp_path / "out")[0] == 0
    system = read_system(tmp_path / "out" / "crawl.rossystem")
    assert system.expected_qas == {"safety": 0.1}


def test_whole_systems_check_clean_by_themselves(run, tmp_path):
    assert run(D2, "--whole", "-o", tmp_path)[0] == 0
    for path in tmp_path.iterdir():
        system = read_system(path)
        assert check_system(system) == ()
        assert {component.name for component in system.components} == {
            component.name for component in read_system(BASE).components
        }


def test_columns_that_name_their_parameters_need_no_options(run, tmp_path):
    (tmp_path / "t.csv").write_text("name,move_base.controller_frequency,qa_safety\nslow,5,0.1\n")
    assert run(BASE, tmp_path / "t.csv", "-o", tmp_path / "out")[0] == 0
    (component,) = read_system(tmp_path / "out" / "slow.rossystem").components
    assert {parameter.key: parameter.value for parameter in component.parameters} == {"controller_frequency": 5}


def test_presence_other_components_and_targets_by_option(run, tmp_path):
    (tmp_path / "t.csv").write_text("name,rate,seen,sensor,note\na,5,true,lidar,x\nb,6,false,none,y\n")
    options = [
        *("--set", "rate=camera:rate*2", "--present", "seen=camera", "--ignore", "note"),
        *("--connect", "sensor:lidar=front_laser.front/scan->battery_load_control.scan", "--connect", "sensor:none="),
    ]
    assert run(BASE, tmp_path / "t.csv", "-o", tmp_path / "out", *options)[0] == 0
    a, b = (read_system(tmp_path / "out" / f"{name}.rossystem") for name in "ab")
    assert [component.name for component in a.components] == ["camera", "battery_load_control"]
    assert [component.name for component in b.components] == ["battery_load_control"]
    assert a.components[0].parameters[0].value == 10.0
    assert a.component("battery_load_control").port("scan")
    assert b.component("battery_load_control").port("scan") is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([BASE], "Missing argument 'TABLE'"),
        ([D2, "--component", "x"], "metacontrol.yaml says what columns set: take out --component"),
        ([BASE, "{table}", "--set", "rate"], "--set 'rate' is not COLUMN="),
        ([BASE, "{table}", "--set", "rate=a*2*3"], "is not COLUMN="),
        ([BASE, "{table}", "--set", "rate=a*e"], "is no number"),
        ([BASE, "{table}", "--connect", "rate=a.b"], "is not COLUMN:VALUE="),
        ([BASE, "{table}", "--connect", "rate:x=ab"], "connections.rate.x[0]: is 'ab', must be COMPONENT.PORT"),
        ([BASE, "{table}", "--set", "rate=a"], "says no component"),
        ([BASE, "{table}"], "t.csv:1:1: nothing says what column 'rate' sets"),
        ([BASE, "{table}.txt"], "is neither .csv nor .yaml"),
        (["{table}"], "t.csv is a table: give the base .rossystem before it, or the folder of metacontrol.yaml"),
        (["none.rossystem", "{table}"], "none.rossystem: No such file"),
    ],
)
def test_wrong_arguments_are_refused(run, tmp_path, arguments, message):
    (tmp_path / "t.csv").write_text("name,rate\na,5\n")
    status, _, err = run(*(str(argument).format(table=tmp_path / "t.csv") for argument in arguments))
    assert status == 2
    assert message in err


def test_name_that_leads_outside_is_refused_and_nothing_written(run, tmp_path):
    (tmp_path / "t.csv").write_text("name,move_base.rate\na,5\n../b,6\n")
    status, _, err = run(BASE, tmp_path / "t.csv", "-o", tmp_path / "out")
    assert status == 2
    assert "t.csv:3:1: variant '../b' can't name a file" in err
    assert not (tmp_path / "out").exists()
