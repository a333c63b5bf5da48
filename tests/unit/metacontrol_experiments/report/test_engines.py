"""Missions on both engines compared, and the delays that lockstep takes from missions on ROS."""

import numpy as np
import pyarrow
import pytest
from click.testing import CliRunner
from metacontrol_experiments.campaign.matrix import Run
from metacontrol_experiments.campaign.progress import Attempt, Result, Status
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.io.campaign_folder import write_table
from metacontrol_experiments.io.tables import read_delays, write_delays
from metacontrol_experiments.lockstep.delays import KINDS, DelayError, Delays, delays_of
from metacontrol_experiments.report.engines import markdown
from metacontrol_experiments.report.missions import Mission, ReportError
from pyarrow import parquet


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


def a_mission(engine, seed=1, manager="mros", status=Status.DONE, **changes):
    run = Run("p", "r1", "f2_v2_r2", 0, 1.0, "none", (), manager, 1, seed, engine)
    return Mission(run, status, summary=a_summary(**changes), provenance={"commit": "0123456789abcdef"})


def both(seed, ros=None, lockstep=None, **what):
    return [a_mission("ros", seed, **what, **(ros or {})), a_mission("lockstep", seed, **what, **(lockstep or {}))]


def test_table_holds_both_engines_and_the_paired_difference():
    missions = []
    for seed in (1, 2, 3):
        missions += both(seed, {"duration_s": 40.0 + seed}, {"duration_s": 39.5 + seed, "reconfigurations": []})
    text = markdown(missions)
    lines = text.splitlines()
    assert "| duration, s | 3 | 42.000 ± 2.484 | 41.500 ± 2.484 | -0.500 ± 0.000 | differs by -1.2% |" in lines
    assert "| reconfigurations | 3 | 1.000 ± 0.000 | 0.000 ± 0.000 | -1.000 ± 0.000 | differs by -100.0% |" in lines
    assert "| way, m | 3 | 19.000 ± 0.000 | 19.000 ± 0.000 | 0.000 ± 0.000 | no difference seen |" in lines
    assert not [line for line in lines if line.startswith("| execute")]  # only one of the engines tells it
    story = r"ROS f2\_v2\_r2 → f2\_v1\_r3\_k (9.0); lockstep f2\_v2\_r2"
    assert f"- `p/r1-f2_v2_r2-clutter0-power1-none/mros-1`: {story}" in lines
    assert "same configurations in the same order: `mros` 0 of 3." in text
    assert "Of 10 figures, 2 differ at 95 %, where chance alone would give 0.5: duration, s of `mros` (-0.5" in text
    assert "3 missions, each on ROS (at 1.00 simulated seconds per second) and in lockstep; code 0123456789ab." in text


def test_difference_within_its_interval_is_none():
    text = markdown([one for seed in (1, 2, 3, 4) for one in both(seed, lockstep={"duration_s": 40.0 + (-1) ** seed})])
    assert "| 0.000 ± 1.837 | no difference seen |" in text
    assert "`mros` 4 of 4. Of 13 figures, 0 differ at 95 %, where chance alone would give 0.7." in text
    assert text.endswith("## Missions with other changes\n\nNone.\n")


def test_one_mission_tells_no_difference():
    text = markdown(both(1, lockstep={"duration_s": 50.0}))
    assert "| 40.000 | 50.000 | 10.000 | needs more missions |" in text and "takes more missions." in text


def test_managers_are_compared_by_themselves():
    text = markdown([*both(1), *both(2), *both(1, manager="none", reconfigurations=[])])
    assert "## `none`, 1 mission\n" in text and "## `mros`, 2 missions\n" in text
    assert text.index("## `none`") < text.index("## `mros`") < text.index("## Missions")


def test_missions_without_a_counterpart_are_left_out_and_told():
    text = markdown([*both(1), a_mission("ros", 2), a_mission("ros", 3), a_mission("lockstep", 3, status=Status.HUNG)])
    assert "1 mission, each on ROS" in text
    assert " 3 missions of one engine alone, or not driven to the end, left out." in text


@pytest.mark.parametrize(
    ("missions", "told"),
    [
        ([], "none at all"),
        ([a_mission("ros", 1), a_mission("ros", 2), a_mission("lockstep", 3)], "2 by ros, 1 by lockst"),
    ],
)
def test_nothing_to_compare_is_told_with_a_remedy(missions, told):
    with pytest.raises(ReportError, match=rf"on both engines \({told}.*metacontrol campaign --engine ros"):
        markdown(missions)


def a_table(folder, missions):
    folder.mkdir()
    results = {
        mission.run.name: Result(mission.run, (Attempt(mission.status, 1.0),), mission.summary) for mission in missions
    }
    return write_table(folder, [mission.run for mission in missions], results, {})


def command(*words):
    return CliRunner().invoke(metacontrol, [str(word) for word in words])


def test_page_says_how_it_was_made(tmp_path):
    ros, lockstep = both(1)
    folders = [a_table(tmp_path / "ros", [ros]).parent, a_table(tmp_path / "lockstep", [lockstep])]
    page = tmp_path / "docs" / "engines.md"
    printed = command("compare", *folders)
    assert printed.exit_code == 0 and "## `mros`, 1 mission" in printed.stdout
    assert command("compare", *folders, "--output", page).exit_code == 0
    assert f"Made by `metacontrol compare {folders[0]} {folders[1]} --output {page}`." in page.read_text()


def test_results_that_are_none_are_named(tmp_path):
    result = command("compare", tmp_path / "absent")
    assert result.exit_code == 2 and "absent: no such table" in result.output
    parquet.write_table(pyarrow.table({"a": [1]}), tmp_path / "other.parquet")
    result = command("compare", tmp_path / "other.parquet")
    assert result.exit_code == 2 and "is no table of a campaign" in result.output


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
    energy = change("qa:energy", "f1_v1_r1")
    killed = a_table(tmp_path / "killed", [a_mission("ros", 1), a_mission("ros", 2, manager="rules")])
    loaded = a_table(tmp_path / "loaded", [a_mission("ros", 1, reconfigurations=[energy])])
    driven = a_table(tmp_path / "driven", [a_mission("lockstep", 1, reconfigurations=[energy])])
    target = tmp_path / "d.csv"
    lacking = command("delays", killed, driven, "--output", target)
    assert lacking.exit_code == 2 and "no sample of parameters in 1 missions of mros on ROS" in lacking.output
    assert not target.exists()
    result = command("delays", killed, loaded, "--output", target)
    assert result.exit_code == 0 and "1 of detect, 1 of decide, 1 of restart, 1 of parameters" in result.output
