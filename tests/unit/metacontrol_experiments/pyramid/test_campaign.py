"""A campaign of D1: its file, and its report."""

import pytest
from helpers.campaign_tables import pyramid_summary
from metacontrol_experiments.campaign.matrix import CampaignError
from metacontrol_experiments.pyramid.campaign import PyramidRun, asks_for_pyramids, levels, parse_pyramids, report, rows

ASKED = {"mission": "manipulation", "scenarios": [1, 2], "seeds": 2, "managers": ["mros", "none"]}


def test_missions_come_seed_by_seed():
    assert asks_for_pyramids(ASKED)
    names = [run.name for run in parse_pyramids(ASKED, "a.yaml")]
    assert names[:4] == [
        "scenario1_seed001_mros",
        "scenario1_seed001_none",
        "scenario2_seed001_mros",
        "scenario2_seed001_none",
    ]
    assert len(names) == len(set(names)) == 8


def test_designs_are_driven_side_by_side():
    asked = ASKED | {"scenarios": [0], "initial_configurations": ["fd2", "fd1_left,fd1_1,fd2_1"], "managers": ["none"]}
    first, second = parse_pyramids(asked, "a.yaml")[:2]
    assert (first.name, second.name) == ("scenario0_seed001_none_fd2", "scenario0_seed001_none_fd1_left-fd1_1-fd2_1")
    assert second.arguments[-3:] == ["--initial-configuration", "fd1_left,fd1_1,fd2_1", "--no-metacontrol"]


def test_baseline_differs_in_one_word():
    run, baseline = parse_pyramids(ASKED, "a.yaml")[:2]
    assert baseline.arguments == [*run.arguments, "--no-metacontrol"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"scenarios": [9]}, "scenarios"),
        ({"seeds": 0}, "seeds"),
        ({"seeds": 2.5}, "seeds"),
        ({"seeds": 2**64}, "seeds: asks for .* missions; give fewer, at most 1,000,000"),
        ({"managers": ["rules"]}, "managers"),
        ({"managers": []}, "managers"),
        ({"engine": "ros"}, "engine"),
    ],
)
def test_file_that_makes_no_sense_is_refused_by_its_place(change, said):
    with pytest.raises(CampaignError, match=rf"a\.yaml: .*{said}"):
        parse_pyramids(ASKED | change, "a.yaml")


def test_other_files_are_not_about_it():
    assert not asks_for_pyramids({"parts": {}})
    assert not asks_for_pyramids(None)


def test_table_has_a_row_for_each_mission_in_the_order_of_scenarios():
    table = rows(
        {PyramidRun(2, 1, "mros"): pyramid_summary(True, 2.5), PyramidRun(1, 2, "none"): pyramid_summary(False)}
    )
    assert [(row["scenario"], row["manager"], row["success"]) for row in table] == [
        (1, "none", False),
        (2, "mros", True),
    ]
    assert table[1]["recover_s"] == "light:0.04=2.5"


def test_report_tells_success_and_how_fast_it_recovers():
    told = report(
        {
            PyramidRun(1, 1, "mros"): pyramid_summary(True, 0.5, None),
            PyramidRun(1, 2, "mros"): pyramid_summary(True, 0.9),
            PyramidRun(1, 1, "none"): pyramid_summary(False),
        }
    )
    assert "| `mros` | 2 | 100% (34% to 100%) | 70 s | 1.2 mm | 0 | 1.00 |" in told
    assert "| `none` | 1 | 0% (0% to 79%) | - | - | 0 | 1.00 |" in told
    assert "| the light changes | 2 | 0.7 s | 0.9 s |" in told


def test_levels_of_designs_come_from_missions_in_which_nothing_went_wrong():
    def built(success, duration):
        return {**pyramid_summary(success), "duration_s": duration}

    one, both = "fd1_left,fd1_1,fd2_1", "fd2"
    fast, slow = levels(
        {
            PyramidRun(0, 1, "none", one): built(True, 80.0),
            PyramidRun(0, 2, "none", one): built(False, 10.0),
            PyramidRun(0, 1, "none", both): built(True, 40.0),
            PyramidRun(0, 2, "none", both): built(True, 50.0),
            PyramidRun(2, 1, "mros"): built(True, 5.0),
        }
    )[::-1]
    assert (fast["name"], fast["performance"], fast["duration"], fast["success"]) == ("fd2", 1.0, 45.0, 1.0)
    assert (slow["name"], slow["performance"], slow["duration"], slow["success"]) == ("fd1_left", 0.25, 80.0, 0.5)
    assert slow["placement_error"] == pytest.approx(0.0012)
    assert levels({PyramidRun(2, 1, "mros"): built(True, 5.0)}) == []
