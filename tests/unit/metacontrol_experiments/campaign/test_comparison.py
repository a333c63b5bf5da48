"""Both engines compared, and the delays that lockstep takes from missions on ROS."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from metacontrol_experiments.campaign import comparison
from metacontrol_experiments.campaign.comparison import Pair
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.io import comparison_runs
from metacontrol_experiments.io.processes import RunError
from metacontrol_experiments.io.tables import read_delays, write_delays
from metacontrol_experiments.lockstep.delays import KINDS, DelayError, Delays, delays_of


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
        "route": "r1",
        "metacontrol": True,
        "perturbations": [{"stamp_s": 8.0, "name": "component:front_laser"}],
        "real_time_factor": 1.0,
        "outcome": "reached",
        "commit": "0123456789abcdef",
    }
    return usual | changes


def test_table_holds_both_engines_and_the_paired_difference():
    pairs = [
        Pair(seed, a_summary(duration_s=40.0 + seed), a_summary(duration_s=39.5 + seed, reconfigurations=[]))
        for seed in (1, 2, 3)
    ]
    text = comparison.markdown(pairs)
    lines = text.splitlines()
    assert "| duration, s | 3 | 42.000 ± 2.484 | 41.500 ± 2.484 | -0.500 ± 0.000 | differs by -1.2% |" in lines
    assert "| reconfigurations | 3 | 1.000 ± 0.000 | 0.000 ± 0.000 | -1.000 ± 0.000 | differs by -100.0% |" in lines
    assert "| way, m | 3 | 19.000 ± 0.000 | 19.000 ± 0.000 | 0.000 ± 0.000 | no difference seen |" in lines
    assert not [line for line in lines if line.startswith("| execute")]  # only one of the engines tells it
    assert "- seed 2: ROS f2_v2_r2 → f2_v1_r3_k (9.0); lockstep f2_v2_r2" in lines
    assert "with 0 of 3 seeds. Of 10 figures, 2 differ by more than chance: duration, s (-0.500 ± 0.000), " in text


def test_difference_within_its_interval_is_none():
    pairs = [Pair(seed, a_summary(), a_summary(duration_s=40.0 + (-1) ** seed)) for seed in (1, 2, 3, 4)]
    text = comparison.markdown(pairs)
    assert "| 0.000 ± 1.837 | no difference seen |" in text
    assert "with 4 of 4 seeds. None of the 13 figures differs by more than chance." in text


def test_one_seed_tells_no_difference():
    text = comparison.markdown([Pair(1, a_summary(), a_summary(duration_s=50.0))])
    assert "| 40.000 | 50.000 | 10.000 | needs more seeds |" in text and "takes more seeds." in text


@pytest.fixture
def asked(monkeypatch):
    """The missions that a comparison has run."""
    asked = []

    def drive(engine, seed, output, arguments):
        asked.append((engine, seed, tuple(arguments)))
        output.mkdir(parents=True)
        (output / "summary.json").write_text(json.dumps(a_summary()))

    monkeypatch.setattr(comparison_runs, "drive", drive)
    return asked


def compare(folder, *arguments):
    return CliRunner().invoke(metacontrol, ["compare", "--runs", str(folder), *arguments])


def test_command_runs_each_mission_once_and_goes_on_with_more_seeds(tmp_path, asked):
    options = ("--route", "r2", "--contingency", "power:1.4")
    for seeds in ("1", "2", "2"):
        result = compare(tmp_path, "--seeds", seeds, *options)
        assert result.exit_code == 0, result.output
    assert asked == [(engine, seed, options) for seed in (1, 2) for engine in ("ros", "lockstep")]
    assert "| goal reached | 2 | 1.000" in result.stdout and "seed 2, lockstep: reached after 40.0 s" in result.output


def test_page_says_how_it_was_made_and_what_was_compared(tmp_path, asked):
    page = tmp_path / "docs" / "engines.md"
    assert compare(tmp_path / "runs", "--seeds", "2", "--output", str(page), "--failure", "front_laser").exit_code == 0
    text = page.read_text()
    assert f"Made by `metacontrol compare --seeds 2 --output {page} --failure front_laser`." in text
    assert "Route r1 from configuration f2_v2_r2, with the meta-controller" in text
    assert "component:front_laser; seeds 1, 2, each on ROS (at 1.00 simulated" in text and "code 0123456789ab" in text


def test_folder_of_other_missions_is_refused(tmp_path, asked):
    assert compare(tmp_path, "--seeds", "1", "--route", "r2").exit_code == 0
    result = compare(tmp_path, "--seeds", "1", "--route", "r3")
    assert result.exit_code == 2 and "holds other missions (--route r2)" in result.output
    assert len(asked) == 2


@pytest.mark.parametrize("text", ["", "{", "{}", "[]"])
def test_summary_that_is_none_is_named(tmp_path, asked, text):
    (tmp_path / "ros_1").mkdir()
    (tmp_path / "ros_1" / "summary.json").write_text(text)
    result = compare(tmp_path, "--seeds", "1")
    assert result.exit_code == 2 and "ros_1/summary.json: is no" in result.output and asked == []


def test_mission_that_is_refused_ends_the_comparison_with_its_reason(tmp_path):
    result = compare(tmp_path, "--seeds", "1", "--route", "r99")
    assert result.exit_code == 2
    assert "no route 'r99'" in result.output


def test_mission_that_breaks_is_told(tmp_path, monkeypatch):
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho 'ImportError: no such module' >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setattr(comparison_runs.sys, "executable", str(broken))
    with pytest.raises(RunError, match="ended with status 1: ImportError: no such module"):
        comparison_runs.drive("lockstep", 1, tmp_path / "out", ())


def test_lockstep_alone_leaves_the_summary_that_is_compared(tmp_path):
    (tmp_path / "routes.yaml").write_text("short: {start: [-8, -8, 0.78], goal: [-6, -6.5, 0]}\n")
    options = ["--routes", str(tmp_path / "routes.yaml"), "--route", "short", "--no-metacontrol", "--failure", "none"]
    comparison_runs.drive("lockstep", 1, tmp_path / "out", options)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["engine"] == "lockstep" and summary["goal_reached"]


def test_delays_come_from_the_changes_of_missions():
    def restarts(running, wanted):
        return running.endswith("_k") != wanted.endswith("_k")

    energy = change("qa:energy", "f1_v1_r1", detect_s=0.5, decide_s=2.0, execute_s=0.2)
    found = list(delays_of(a_summary(reconfigurations=[change(), energy]), restarts))
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
