"""Both engines compared, and the delays that lockstep takes from missions on ROS."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from metacontrol_experiments import comparison
from metacontrol_experiments.cli import metacontrol
from metacontrol_experiments.comparison import Pair
from metacontrol_experiments.delays import KINDS, DelayError, Delays, delays_of, read_delays, write_delays


def change(trigger="component:front_laser", to="f2_v1_r3_k", **times):
    usual = {"detect_s": 0.02, "decide_s": 0.1, "execute_s": 1.5, "stamp_s": 9.0, "degraded": False}
    return {"trigger": trigger, "from": "f2_v2_r2", "to": to} | usual | times


def a_summary(**changes):
    usual = {
        "goal_reached": True,
        "duration_s": 40.0,
        "path_length_m": 19.0,
        "collisions": 0,
        "mean_qa": {"safety": 0.1, "energy": 0.5},
        "time_above_threshold": {"safety": 0.0, "energy": 0.1},
        "reconfigurations": [change()],
        "control": {"rate_hz": 20.0, "periods_missed": 0.01},
        "initial_configuration": "f2_v2_r2",
    }
    return usual | changes


def test_table_holds_both_engines_and_the_paired_difference():
    pairs = [
        Pair(seed, a_summary(duration_s=40.0 + seed), a_summary(duration_s=39.5 + seed, reconfigurations=[]))
        for seed in (1, 2, 3)
    ]
    lines = comparison.markdown(pairs).splitlines()
    assert "| duration, s | 42.000 ± 2.484 | 41.500 ± 2.484 | -0.500 ± 0.000 |" in lines
    assert "| reconfigurations | 1.000 ± 0.000 | 0.000 ± 0.000 | -1.000 ± 0.000 |" in lines
    assert not [line for line in lines if line.startswith("| execute")]  # only one of the engines tells it
    assert "- seed 2: ros f2_v2_r2 → f2_v1_r3_k (9.0); lockstep f2_v2_r2" in lines


def test_command_runs_each_mission_once_with_the_options_of_run(tmp_path, monkeypatch):
    asked = []

    def drive(engine, seed, output, arguments):
        asked.append((engine, seed, tuple(arguments)))
        output.mkdir(parents=True)
        (output / "summary.json").write_text(json.dumps(a_summary()))

    monkeypatch.setattr(comparison, "drive", drive)
    arguments = ["compare", "--seeds", "2", "--output", str(tmp_path), "--route", "r2", "--contingency", "power:1.4"]
    options = ("--route", "r2", "--contingency", "power:1.4")
    for _ in range(2):
        result = CliRunner().invoke(metacontrol, arguments)
        assert result.exit_code == 0, result.output
    assert asked == [(engine, seed, options) for seed in (1, 2) for engine in ("ros", "lockstep")]
    assert "| goal reached | 1.000" in (tmp_path / "comparison.md").read_text()


def test_mission_that_is_refused_ends_the_comparison_with_its_reason(tmp_path):
    arguments = ["compare", "--seeds", "1", "--output", str(tmp_path), "--route", "r99"]
    result = CliRunner().invoke(metacontrol, arguments)
    assert result.exit_code == 2
    assert "no route 'r99'" in result.output


def test_lockstep_alone_leaves_the_summary_that_is_compared(tmp_path):
    (tmp_path / "routes.yaml").write_text("short: {start: [-8, -8, 0.78], goal: [-6, -6.5, 0]}\n")
    options = ["--routes", str(tmp_path / "routes.yaml"), "--route", "short", "--no-metacontrol", "--failure", "none"]
    comparison.drive("lockstep", 1, tmp_path / "out", options)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["engine"] == "lockstep" and summary["goal_reached"]


def test_delays_come_from_the_changes_of_missions():
    sources = {"f2_v2_r2": ("scan",), "f1_v1_r1": ("scan",), "f2_v1_r3_k": ("point_cloud",)}
    energy = change("qa:energy", "f1_v1_r1", detect_s=0.5, decide_s=2.0, execute_s=0.2)
    found = list(delays_of(a_summary(reconfigurations=[change(), energy]), sources))
    assert found == [("detect", 0.02), ("decide", 0.1), ("restart", 1.5), ("parameters", 0.2)]


def test_draws_follow_the_samples():
    delays = Delays(dict.fromkeys(KINDS, (3.0, 1.0, 2.0)))
    rng = np.random.default_rng(1)
    drawn = [delays.draw("restart", rng) for _ in range(2000)]
    assert min(drawn) >= 1.0 and max(drawn) <= 3.0
    assert np.median(drawn) == pytest.approx(2.0, abs=0.05)


def test_delays_of_the_package_are_there():
    drawn = {kind: read_delays().draw(kind, np.random.default_rng(0)) for kind in KINDS}
    assert all(0.0 <= value < 10.0 for value in drawn.values())


def test_written_delays_are_read_again(tmp_path):
    write_delays(tmp_path / "d.csv", [(kind, 0.25) for kind in reversed(KINDS)])
    assert read_delays(tmp_path / "d.csv").draw("detect", np.random.default_rng(0)) == 0.25


@pytest.mark.parametrize("text", [None, "a,b\n1,2\n", "delay,seconds\ndetect,soon\n", "delay,seconds\ndetect,1\n"])
def test_file_without_delays_is_refused(tmp_path, text):
    if text is not None:
        (tmp_path / "d.csv").write_text(text)
    with pytest.raises(DelayError, match=r"d\.csv.*metacontrol delays"):
        read_delays(tmp_path / "d.csv")


def test_command_collects_delays_and_tells_what_is_lacking(tmp_path):
    for name, changes in (("a", [change()]), ("b", [change("qa:energy", "f1_v1_r1")])):
        (tmp_path / f"{name}.json").write_text(json.dumps(a_summary(reconfigurations=changes)))
    target = tmp_path / "d.csv"
    lacking = CliRunner().invoke(metacontrol, ["delays", str(tmp_path / "a.json"), "--output", str(target)])
    assert lacking.exit_code == 2 and "no sample of parameters" in lacking.output and not target.exists()
    files = [str(tmp_path / "a.json"), str(tmp_path / "b.json")]
    result = CliRunner().invoke(metacontrol, ["delays", *files, "--output", str(target)])
    assert result.exit_code == 0 and "1 of detect, 1 of decide, 1 of restart, 1 of parameters" in result.output
