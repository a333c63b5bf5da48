"""Which missions a campaign has, and what is said of a file that makes no sense."""

import itertools
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from metacontrol_experiments.campaign.matrix import (
    FIRST_SEED,
    CampaignError,
    Known,
    contingencies_of,
    parse_campaign,
    seed_of,
)
from mros1_reasoner.loop.settings import setting_names

FILES = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_experiments/campaigns"
VARIANTS = [f"f{f}_v{v}_r{r}" for f in (1, 2, 3) for v in (1, 2, 3) for r in (1, 2, 3)]
MANAGERS = ["none", "mros", "as_published", "random", "rules", "respawn"]
KNOWN = Known(["r1", "r2", "r3", "r4", "r5", "r6"], VARIANTS, MANAGERS, ["front_laser", "camera"], ["calm", "horizon"])
SMALL = {
    "seed": 3,
    "parts": {
        "small": {
            "routes": ["r1", "r2"],
            "initial_configurations": ["f1_v1_r1"],
            "clutter": [0, 7],
            "power": [1.0, 1.6],
            "failures": {"none": [], "killed": ["kill:front_laser@share:0.4"]},
            "managers": {"none": 2, "rules": 1},
        }
    },
}


PROFILES = {"profiles": {"slow": {"horizon": 0.5, "calm": 3}}}


def campaign(**changes):
    return parse_campaign({**SMALL, **changes}, KNOWN, "small.yaml")


def read(name):
    return parse_campaign(yaml.safe_load((FILES / name).read_text()), KNOWN, name)


def changed(key, value):
    """The small campaign with another value in its part; None takes the key out."""
    part = {**SMALL["parts"]["small"], key: value}
    return {**SMALL, "parts": {"small": {name: v for name, v in part.items() if v is not None}}}


def test_every_cell_is_driven_by_every_manager_as_often_as_asked():
    runs = campaign().runs
    assert Counter(run.manager for run in runs) == {"none": 2 * 16, "rules": 16}
    assert len({run.name for run in runs}) == len(runs)
    assert [run.repeat for run in runs] == sorted(run.repeat for run in runs)


def test_managers_meet_the_same_seed_and_contingencies_and_no_two_cells_do():
    worlds = {}
    for run in campaign().runs:
        cell = (run.route, run.initial_configuration, run.clutter, run.power, run.failure, run.repeat)
        worlds.setdefault(cell, set()).add((run.seed, run.contingencies))
    assert all(len(met) == 1 for met in worlds.values())
    assert len({seed for ((seed, _),) in worlds.values()}) == len(worlds) == 32


def test_another_manager_or_order_changes_no_seed():
    seeds = {run.name: run.seed for run in campaign().runs}
    other = parse_campaign(changed("managers", {"mros": 3, "rules": 1, "none": 2}), KNOWN, "")
    again = {run.name: run.seed for run in other.runs}
    assert {name: again[name] for name in seeds} == seeds


def test_seeds_are_the_same_everywhere_and_not_those_of_calibration():
    assert seed_of(0, "r1", 1) == 792328737
    assert min(seed_of(0, n) for n in range(1000)) >= FIRST_SEED > 1000
    assert {run.seed for run in campaign(seed=4).runs}.isdisjoint(run.seed for run in campaign().runs)


def test_what_goes_wrong_is_clutter_power_and_the_failure():
    run = next(run for run in campaign().runs if (run.clutter, run.power, run.failure) == (7, 1.6, "killed"))
    assert run.contingencies == ("clutter:7@time:0", "power:1.6@share:0.6", "kill:front_laser@share:0.4")
    assert [str(entry) for entry in contingencies_of(run)] == list(run.contingencies)
    calm = [run for run in campaign().runs if (run.clutter, run.power, run.failure) == (0, 1.0, "none")]
    assert calm and {run.contingencies for run in calm} == {()}


def test_first_part_is_a_sample_of_the_whole_with_all_managers_of_a_cell():
    runs = [run for run in read("paper.yaml").runs if run.repeat == 1]
    first = runs[:600]
    assert {run.route for run in first} == {run.route for run in runs}
    assert {run.part for run in first} == {"disturbances", "component_failure"}
    cells = [list(cell) for _, cell in itertools.groupby(first, key=lambda run: run.seed)]
    assert {len(cell) for cell in cells[:-1]} == {6}


def test_paper_has_the_matrix_of_the_paper():
    runs = read("paper.yaml").runs
    matrix = [run for run in runs if run.part == "disturbances"]
    cells = {(run.route, run.initial_configuration, run.clutter, run.power) for run in matrix}
    assert len(cells) == 864
    per_manager = Counter(run.manager for run in matrix)
    assert per_manager["none"] + per_manager["mros"] >= 6727
    assert {per_manager[manager] for manager in ("as_published", "random", "rules", "respawn")} == {864}
    assert {run.failure for run in runs} == {"none", "killed", "unplugged"}


def test_papers_missions_do_without_spares_and_others_may_use_them():
    assert not any(run.spares for run in read("paper.yaml").runs)
    assert all(run.spares for run in read("ci.yaml").runs)


@pytest.mark.parametrize(("name", "count"), [("smoke.yaml", 40), ("ci.yaml", 8), ("steps.yaml", 648)])
def test_other_campaigns_of_the_project(name, count):
    known = replace(KNOWN, parameters=setting_names())
    assert len(parse_campaign(yaml.safe_load((FILES / name).read_text()), known, name).runs) == count


def test_profile_is_the_meta_controller_with_its_parameters():
    content = {**changed("managers", {"mros": 1, "slow": 1, "rules": 1}), **PROFILES}
    runs = parse_campaign(content, KNOWN, "").runs
    assert {(run.manager, run.plug_in, run.parameters) for run in runs} == {
        ("mros", "mros", ""),
        ("slow", "mros", '{"calm": 3, "horizon": 0.5}'),
        ("rules", "rules", ""),
    }


def test_surroundings_are_observed_unless_the_file_says_otherwise():
    assert {run.environment for run in campaign().runs} == {True}
    assert {run.environment for run in campaign(environment=False).runs} == {False}
    known = replace(KNOWN, parameters=setting_names())
    for name, observed in (("paper.yaml", False), ("steps.yaml", False), ("ci.yaml", True)):
        runs = parse_campaign(yaml.safe_load((FILES / name).read_text()), known, name).runs
        assert {run.environment for run in runs} == {observed}


def test_engine_that_is_given_takes_the_place_of_that_of_the_file():
    assert {run.engine for run in parse_campaign({**SMALL, "engine": "ros"}, KNOWN, "").runs} == {"ros"}
    assert {run.engine for run in parse_campaign({**SMALL, "engine": "ros"}, KNOWN, "", "lockstep").runs} == {
        "lockstep"
    }
    assert {run.engine for run in parse_campaign(SMALL, KNOWN, "", "ros").runs} == {"ros"}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "small.yaml: the file: is empty, must be a mapping with the key parts"),
        ({"parts": {}}, "parts: is '{}', must be a mapping of names to matrices"),
        ({**SMALL, "engines": "ros"}, "engines: unknown key, allowed here: engine, seed"),
        ({**SMALL, "engine": "gazebo"}, "engine: is 'gazebo', must be lockstep or ros"),
        ({**SMALL, "profiles": {"mros": {"calm": 3}}}, "profiles.mros: there is a manager of that name: take another"),
        ({**SMALL, "profiles": {"slow": {"clam": 3}}}, "profiles.slow: no parameter 'clam'; there are calm, horizon"),
        ({**SMALL, "profiles": {"slow": {}}}, "profiles.slow: is '{}', must be a mapping of parameters to values"),
        ({**SMALL, "seed": 1.5}, "seed: is 1.5; give a whole number, 0 or more"),
        ({**SMALL, "deadline": 0}, "deadline: is '0', must be wall s for a run, more than 0"),
        ({"parts": {"a/b": SMALL["parts"]["small"]}}, "'a/b' must be a name of letters, digits and _"),
        (changed("routes", None), "parts.small.routes: is missing, must be a list of names"),
        (changed("routes", "r1"), "parts.small.routes: is 'r1', must be a list of names"),
        (changed("routes", ["r9"]), "parts.small.routes: no route 'r9'; there are r1, r2"),
        (changed("routes", ["r1", "r1"]), "parts.small.routes: 'r1' stands there more than once"),
        (changed("initial_configurations", ["f9"]), "initial_configurations: no variant 'f9'; there are f1_v1_r1"),
        (changed("managers", {"magic": 1}), "managers: no manager 'magic'; there are none, mros"),
        (changed("managers", {"none": 2**63}), "missions; give fewer, at most 1,000,000"),
        (changed("managers", {"none": 0}), "managers.none: is 0; give a whole number, 1 or more"),
        (changed("clutter", [101]), "parts.small.clutter: clutter: is 101; give a whole number from 0 to 100"),
        (changed("power", [-1]), "parts.small.power: power: is -1; give a number 0 or more"),
        (changed("failures", {"x": ["kill:arm"]}), "failures.x: kill:arm: no component 'arm'; there are front_laser"),
        (changed("failures", {"x": ["kill"]}), "failures.x: 'kill': expected KIND:WHAT"),
    ],
)
def test_bad_file_is_refused_with_the_place(content, said):
    with pytest.raises(CampaignError) as refused:
        parse_campaign(content, KNOWN, "small.yaml")
    assert str(refused.value).startswith("small.yaml: ") and said in str(refused.value)
