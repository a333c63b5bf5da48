"""Expected levels from bags of a robot unlike D2: pumps, with a level that is better when it is higher."""

import csv

import numpy as np
import pytest
from click.testing import CliRunner
from helpers.mission_bags import BagBuilder
from metacontrol_experiments.campaign.definition import Definition
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_msgs.msg import ActiveConfiguration, FunctionGrounding
from ros_model.io.project import load_project
from std_msgs.msg import Float32

SETTINGS = """package: plant
base: plant.rossystem
variants: {table: variants.csv, qa: qa.csv}
functions: {f_pump: {designs: all}}
quality_attributes:
  noise: {direction: lower_is_better, range: [0, 100]}
  flow: {direction: higher_is_better, range: [0, 10]}
  use: {direction: higher_is_better, range: [0, 1]}
utility: use
objectives: {o_pump: {function: f_pump}}
"""
SYSTEM = "RosSystem { Name plant RosComponents ( ComponentInterface { name pump FromRosNode 'plant.pump.pump' } ) }"
NODE = "PackageSet { CatkinPackage plant { Artifact pump { Node { name pump } } } }"
LEVELS = "name,noise,flow,use,source\nquiet,30,2,0.3,estimated\nstrong,60,5,0.9,estimated\nspare,50,4,0.5,estimated\n"


class Plant(BagBuilder):
    """A bag of the plant."""

    def __init__(self, namespace=""):
        super().__init__()
        self.namespace = namespace

    def runs(self, stamp, configuration, state="STABLE"):
        running = [FunctionGrounding("f_pump", configuration, state)] if configuration else []
        running.append(FunctionGrounding("f_light", "lamp", "STABLE"))
        topic = f"{self.namespace}/rosgraph_manipulator/active_configuration"
        self.add(stamp, topic, ActiveConfiguration(functions=running))

    def observes(self, start, end, quality, *levels):
        """One level a second, over and over."""
        for number in range(int(end - start)):
            level = levels[number % len(levels)]
            owner = f"robot:{self.namespace or '/'}"
            self.diagnostic(start + number, "QA status", quality, level, hardware_id=owner)


@pytest.fixture
def plant(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    models = tmp_path / "models"
    models.mkdir()
    files = {"metacontrol.yaml": SETTINGS, "plant.rossystem": SYSTEM, "plant.ros": NODE, "qa.csv": LEVELS}
    files["variants.csv"] = "name,pump.speed\nquiet,1\nstrong,3\nspare,2\n"
    for name, text in files.items():
        (models / name).write_text(text)
    return models


def a_bag(path, namespace="", quiet=(20, 30), strong=(60, 70), flow=(1, 2, 3)):
    """Quiet for 20 s, a change of 5 s in which it is very loud, strong for 30 s."""
    bag = Plant(namespace)
    bag.runs(100.0, "quiet")
    bag.observes(100, 120, "noise", *quiet)
    bag.runs(120.0, "strong", "RECONFIGURING")
    bag.observes(120, 125, "noise", 99)
    bag.runs(125.0, "strong")
    bag.observes(125, 155, "noise", *strong)
    bag.observes(100, 155, "flow", *flow)
    bag.add(155.0, "/elsewhere", Float32(1.0))
    return bag.write(path)


def calibrate(*arguments):
    return CliRunner().invoke(metacontrol, ["calibrate", "--bags", *map(str, arguments)])


def rows(path="qa.csv"):
    with open(path) as file:
        return {(row["name"], row.get("quality", "")): row for row in csv.DictReader(file)}


def test_levels_are_those_of_the_time_in_which_each_variant_ran(plant, tmp_path):
    bags = [
        a_bag(tmp_path / "1.bag"),
        a_bag(tmp_path / "2.bag", quiet=(22, 32)),
        a_bag(tmp_path / "3.bag", quiet=(24, 34)),
    ]
    told = calibrate(*bags, "--project", plant)
    assert told.exit_code == 0, told.output
    written = rows()
    assert written["quiet", ""] == {
        **{"name": "quiet", "noise": "27.000", "flow": "1.950", "use": "0.300", "source": "measured", "missions": "3"},
        **{"noise_spread": "2.000", "flow_spread": "0.000", "use_spread": ""},
    }
    assert (written["strong", ""]["noise"], written["strong", ""]["source"]) == ("65.000", "measured")
    assert (written["spare", ""]["noise"], written["spare", ""]["source"]) == ("50.000", "kept")
    found = rows("qa_intervals.csv")["quiet", "noise"]
    assert (found["level"], found["bags"], found["seconds"]) == ("27.0000", "3", "60.0")
    assert 25.0 <= float(found["low"]) < 27.0 < float(found["high"]) <= 29.0
    assert "2 variants ran; spare keep their levels" in told.output
    assert "nobody observes use: levels stay as they are in the project" in told.output


def test_levels_are_read_as_the_project_needs_them(plant, tmp_path):
    told = calibrate(a_bag(tmp_path / "1.bag"), "--project", plant, "--levels", plant / "qa.csv")
    assert told.exit_code == 0, told.output
    (strong,) = [variant for variant in load_project(plant).variants if variant.name == "strong"]
    assert {p.name: p.value for p in strong.parameters if p.name.startswith("qa_")}["qa_noise"] == 65.0


def test_quantile_is_that_of_the_definition_in_the_direction_of_the_quality(plant, tmp_path):
    bag = a_bag(tmp_path / "1.bag", quiet=(*(20,) * 17, 50, 50, 50), flow=(5,) * 10 + (1,))
    calibrate(bag, "--project", plant, "--quantile", "noise=0.8", "--quantile", "flow=0.85")
    assert (rows()["quiet", ""]["noise"], rows()["quiet", ""]["flow"]) == ("20.000", "5.000")
    calibrate(bag, "--project", plant, "--quantile", "noise=0.95", "--quantile", "flow=0.96")
    assert (rows()["quiet", ""]["noise"], rows()["quiet", ""]["flow"]) == ("50.000", "1.000")


@pytest.mark.parametrize("text", ["noise", "0.95", "noise=0", "noise=2", "noise=much", "noise=nan"])
def test_quantile_that_makes_no_sense_is_refused(plant, tmp_path, text):
    refused = calibrate(tmp_path / "1.bag", "--project", plant, "--quantile", text)
    assert refused.exit_code == 2 and f"{text!r}: " in refused.output and refused.output.count("\n") == 1


def test_same_definition_serves_bags_and_simulation():
    levels, durations = np.arange(100.0), np.ones(100)
    assert Definition().level("safety", levels, durations) == 94.0
    assert Definition().level("energy", levels, durations) == 97.0
    assert Definition().level("noise", levels, durations) == 49.5
    assert Definition({"flow": 0.95}).level("flow", levels, durations, higher_is_better=True) == 5.0
    assert Definition().level("safety", levels[:0], durations[:0]) is None


def test_robot_in_a_namespace_is_told_from_others_in_the_same_bag(plant, tmp_path):
    bag = a_bag(tmp_path / "1.bag", "/hall")
    assert calibrate(bag, "--project", plant, "--namespace", "/hall").exit_code == 0
    assert rows()["quiet", ""]["noise"] == "25.000"
    refused = calibrate(bag, "--project", plant)
    assert refused.exit_code == 2 and "or give --namespace" in refused.output


def test_bag_without_configurations_is_of_the_one_that_is_named(plant, tmp_path):
    bag = Plant()
    bag.observes(0, 30, "noise", 40)
    path = bag.write(tmp_path / "1.bag")
    told = calibrate(path, "--project", plant, "--initial", "spare")
    assert told.exit_code == 0 and rows()["spare", ""]["noise"] == "40.000"
    assert "only spare ran; quiet, strong keep their levels" in told.output
    assert "a variant that ran in one bag only has no interval" in told.output
    refused = calibrate(path, "--project", plant, "--initial", "mighty")
    assert refused.exit_code == 2 and "--initial: no variant 'mighty' in the project; there are quiet" in refused.output


def test_silence_of_an_observer_is_no_level(plant, tmp_path):
    bag = Plant()
    bag.runs(0.0, "quiet")
    bag.observes(0, 20, "noise", 20)
    bag.observes(100, 120, "noise", 40)  # the last one before the pause holds for 5 s
    told = calibrate(bag.write(tmp_path / "1.bag"), "--project", plant)
    assert told.exit_code == 0
    assert float(rows()["quiet", ""]["noise"]) == pytest.approx((20 * 24 + 40 * 19) / 43, abs=1e-3)


def bad_bags(folder):
    """Bags that cannot be used, and what is said of them."""
    foreign = BagBuilder()
    foreign.add(1.0, "/temperature", Float32(20.0))
    foreign.diagnostic(1.0, "QA status", "comfort", 0.5)
    unknown = Plant()
    unknown.observes(0, 30, "noise", 40)
    other = Plant()
    other.runs(0.0, "turbo")
    other.observes(0, 30, "noise", 40)
    (folder / "text.bag").write_text("no bag at all")
    return {
        foreign.write(
            folder / "foreign.bag"
        ): "tells no level of noise, flow, use (but of comfort): record /diagnostics",
        unknown.write(folder / "unknown.bag"): "tells of no configuration: record rosgraph_manipulator/active_configur",
        other.write(folder / "other.bag"): "lamp, turbo: no variant of the project: left out",
        folder / "text.bag": "text.bag: ",
        folder / "none.bag": "none.bag: ",
    }


def test_bags_that_cannot_be_used_get_a_line_each_and_the_others_count(plant, tmp_path):
    bad = bad_bags(tmp_path)
    told = calibrate(*bad, a_bag(tmp_path / "good.bag"), "--project", plant)
    assert told.exit_code == 1 and rows()["quiet", ""]["noise"] == "25.000"
    lines = told.output.splitlines()
    for said in bad.values():
        assert len([line for line in lines if said in line]) == 1, told.output


def test_nothing_is_written_where_no_bag_can_be_used(plant, tmp_path):
    for bag in bad_bags(tmp_path):
        refused = calibrate(bag, "--project", plant)
        assert refused.exit_code == 2 and "no bag tells levels of a variant" in refused.output
        assert refused.output.count("\n") <= 3 and not (tmp_path / "qa.csv").exists()
    refused = CliRunner().invoke(metacontrol, ["calibrate", "--bags"])
    assert refused.exit_code == 2 and "give bags and --bags together" in refused.output
