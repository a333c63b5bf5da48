"""`rosmodel check` tells what the reasoner would refuse at its start."""

from pathlib import Path

import pytest
import yaml
from ros_model.cli.rosmodel import main

ROOT = Path(__file__).parents[4]


@pytest.fixture
def check(tmp_path, monkeypatch, capsys):
    """Check a project with a utility, where an example's utility function is installed; return status and text."""
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{ROOT / 'examples' / 'example_utility'}:{ROOT / 'catkin_ws' / 'src'}")
    monkeypatch.syspath_prepend(str(ROOT / "examples" / "example_utility" / "src"))
    for name in ("base", "one"):
        (tmp_path / f"{name}.rossystem").write_text(f"RosSystem {{ Name {name} }}")

    def run(utility):
        settings = {
            "package": "wagon",
            "base": "base.rossystem",
            "variants": {"files": ["one.rossystem"]},
            "functions": {"f_go": {"designs": "all"}},
            "quality_attributes": {"noise": {"direction": "lower_is_better"}},
            "utility": utility,
            "objectives": {"o_go": {"function": "f_go"}},
        }
        (tmp_path / "metacontrol.yaml").write_text(yaml.safe_dump(settings, sort_keys=False))
        with pytest.raises(SystemExit) as done:
            main(["check", str(tmp_path)])
        captured = capsys.readouterr()
        return done.value.code, captured.out + captured.err

    return run


@pytest.mark.parametrize(
    "utility",
    ["noise", {"quality": "noise"}, {"weights": {"noise": -1}}, {"expression": "-noise"}, {"worst": ["noise"]}],
)
def test_utility_that_can_be_made_passes(check, utility):
    status, told = check(utility)
    assert (status, "error" in told) == (0, False), told


@pytest.mark.parametrize(
    ("utility", "message"),
    [
        ({"worst": ["battery"]}, "error: utility.worst: utility worst: ['battery']: expected a list of qualities"),
        ({"weights": {"battery": 1}}, "error: utility.weights: utility: no quality is called 'battery'"),
        ({"expression": "noise +"}, "error: utility.expression: utility expression 'noise +'"),
        ({"expression": "battery"}, "no quality is called 'battery': known: noise"),
    ],
)
def test_utility_function_that_refuses_its_parameters_is_an_error(check, utility, message):
    status, told = check(utility)
    assert status == 1
    assert message in told
    assert "metacontrol.yaml:" in told


def test_utility_function_that_nobody_exports_is_a_warning(check):
    status, told = check({"wurst": ["noise"]})
    assert status == 0
    assert "warning: utility.wurst: no package here exports a utility function of that name" in told
    assert "expression, quality, weights, worst" in told
