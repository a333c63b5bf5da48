"""The text of a report: in which order it tells what, and what it does with tables of other campaigns."""

import re

import pytest
from helpers.campaign_tables import LOG, change, missions, result, violation
from metacontrol_experiments.campaign.progress import Status
from metacontrol_experiments.report.page import page
from metacontrol_experiments.report.pair import read_series
from metacontrol_experiments.report.published import Aim, Published, Target
from metacontrol_experiments.report.report import Single, Table, make_report
from metacontrol_experiments.report.text import plain, table

PAPER = Published(
    "a paper",
    {"energy": {"total": {"mros": 0.0186, "none": 0.0298}}},
    {"energy": {"total": "all of it"}},
    targets=(Target(Aim.AT_MOST, 0.0186, "energy", "total"),),
)


def report(told, published=PAPER, single=None):
    return make_report(Table(missions(told), "t.parquet"), published, single or Single(told="None here."), None)


def campaign():
    told = []
    for n in range(1, 5):
        level = 0.02 * n
        places = {"cell_m": 0.5, "energy": [[1, n, 0.5]], "safety": []}
        told += [result("none", n, power=1.4, energy=level, duration=40.0 + n, summary={"violation_places": places})]
        violations = {"energy": [violation(3.0, 1.0)], "safety": []}
        summary = {"reconfigurations": [change()], "violations": violations}
        told += [result("mros", n, power=1.4, energy=level / 2, duration=45.0, summary=summary)]
    return told


def section(markdown, title):
    return markdown.partition(f"## {title}\n")[2].partition("\n## ")[0]


def test_losses_come_first_then_targets_then_doubts_then_tables():
    found = report(campaign()).markdown
    places = [
        found.index(f"## {title}")
        for title in (
            "Where the meta-controller loses",
            "Targets",
            "Before you read on",
            "Missions",
            "The paper's tables",
        )
    ]
    assert places == sorted(places) and found.count("\n## ", 0, places[0]) == 0


def test_loss_is_told_with_the_figure_that_is_better():
    found = report(campaign())
    told = section(found.markdown, "Where the meta-controller loses")
    assert "It is behind in 1 of" in told
    row = next(line for line in told.splitlines() if "the published MROS" in line and line.startswith("| Time"))
    assert "| all of it | 2.50" in row and "| 1.86 |" in row
    assert [contest.rival for contest in found.losses] == ["published"]


def test_target_is_told_as_missed_with_its_figure():
    told = section(report(campaign()).markdown, "Targets")
    assert "Time above the energy threshold, all of it: at most 1.86 % | 2.50" in told and "**missed**" in told
    assert "0 of 1 are reached." in told


def test_published_figures_stand_beside_ours_with_tests_below():
    told = section(report(campaign()).markdown, "The paper's tables")
    energy = told.partition("### Time above the energy threshold")[2].partition("###")[0]
    assert re.search(r"\| all of it \| 1\.86 \| 2\.98 \| 5\.00 \(.*\) \| 2\.50 \(.*\) \| 4 \|", energy)
    difference = next(line for line in energy.splitlines() if line.startswith("| all of it") and "A12" in line)
    assert "-2.50" in difference and difference.endswith("| 4 |")


def test_nowhere_behind_is_told_as_such():
    told = [result("none", n, energy=0.04, safety=0.04, success=False) for n in (1, 2)]
    told += [result("mros", n, energy=0.01) for n in (1, 2)]
    assert section(report(told).markdown, "Where the meta-controller loses").strip().startswith("Nowhere: in none of")


def test_runs_that_crashed_or_hung_are_counted_and_named():
    told = [*campaign(), result("mros", 5, status=Status.CRASHED, problem="it *broke* | badly")]
    found = report([*told, result("none", 5, status=Status.HUNG, problem="no end")]).markdown
    doubts = section(found, "Before you read on")
    assert "2 missions crashed or hung; no figure has them:" in doubts
    assert "`main/east-slow-clutter0-power1-none/mros-5` crashed: it \\*broke\\* | badly" in doubts
    assert "| `mros` | 5 | 4 | 1 | 0 |" in section(found, "Missions")
    assert "of `mros` that crashed or hung counted as failures" in section(found, "Missions")


@pytest.mark.parametrize(
    "told",
    [
        [result("rules")],
        [result("mros")],
        [result("none")],
        [result("none"), result("zeal")],
        [result("mros", status=Status.CRASHED, problem="x")],
        [result("mros", failures=["kill:lidar"]), result("none", failures=["kill:lidar"])],
        [result("mros", reached=False), result("none", summary={"time_above_threshold": {}})],
        [result("mros", route="a", power=3.0), result("none", route="b", clutter=2)],
    ],
    ids=[
        "no ours nor baseline",
        "ours only",
        "baseline only",
        "no ours",
        "crashed",
        "failures",
        "no levels",
        "no pair",
    ],
)
def test_other_campaigns_give_what_can_be_had(told):
    found = report(told)
    assert "nan" not in found.markdown.lower() and "None |" not in found.markdown
    assert section(found.markdown, "Before you read on").strip()
    assert page(found.markdown, "t", {}).count("<h2>") == found.markdown.count("\n## ")


def test_figures_are_of_what_is_there():
    told = campaign()
    mission, *_ = missions(told)
    single = Single(((mission, read_series(LOG)), (mission, read_series(LOG))), "Told.")
    names = [picture.name for picture in report(told, single=single).pictures]
    assert names == ["pair", "tradeoff", "distributions", "map", "reconfigurations"]
    found = report([result("none", reached=False, summary={"time_above_threshold": {}})])
    assert found.pictures == () and "No figure “A pair of missions”: None here." in found.markdown


def test_pictures_are_in_the_page():
    found = report(campaign())
    made = page(found.markdown, "A <title>", {"figures/map.png": b"PNG"})
    assert 'src="data:image/png;base64,UE5H"' in made and "<title>A &lt;title&gt;</title>" in made
    assert "<table>" in made and "<script" not in made


def test_text_from_elsewhere_is_no_markup():
    assert "<b>" not in page(f"# x\n\n{plain('a <b>b</b> [c](d) _e_')}\n", "t", {})
    assert "[c](d) _e_" in page(plain("[c](d) _e_"), "t", {})
    assert "<img" not in page("<img src=x onerror=y>", "t", {})


def test_columns_of_figures_are_flushed_right():
    rows = [["a", "b", "c"], ["x", "+1.0 (0 to 2)", "1 of x"], ["y", "-", "z|z"]]
    assert table(rows).splitlines()[1:] == ["|---|---:|---|", "| x | +1.0 (0 to 2) | 1 of x |", "| y | - | z\\|z |"]
