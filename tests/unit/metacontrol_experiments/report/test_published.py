"""Published figures and targets, as the file of this package and those of others have them."""

from pathlib import Path

import pytest
from metacontrol_experiments.io.report_files import read_published
from metacontrol_experiments.report.published import Aim, PublishedError, Target, parse_published

FILE = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_experiments/config/published.yaml"
LEAST = {"source": "a paper", "tables": {}, "targets": []}


def test_file_of_the_package_has_the_papers_figures_and_the_targets():
    published = read_published(FILE)
    assert published.figure("safety", "clutter 14", "none") == pytest.approx(0.0173)
    assert published.figure("energy", "power 1", "mros") == pytest.approx(0.0126)
    assert published.figure("success", "component failure", "mros") == pytest.approx(0.73)
    assert [len(published.rows[table]) for table in ("safety", "energy", "success")] == [5, 5, 10]
    assert published.targets[1] == Target(Aim.BASELINE_OVER, 2.6, "safety", "total")
    assert published.targets[4] == Target(Aim.AT_LEAST, 0.9, "success", "total")
    assert published.targets[-1] == Target(Aim.BETTER, managers=("none", "random", "rules"))
    assert len(published.targets) == 9


def test_totals_of_the_paper_lie_among_its_rows():
    for table, rows in read_published(FILE).rows.items():
        for manager in ("mros", "none"):
            others = [figures[manager] for row, figures in rows.items() if row not in ("total", "component failure")]
            assert min(others) <= rows["total"][manager] <= max(others), table


def test_what_is_not_published_is_not_known():
    published = parse_published(LEAST, "p.yaml")
    assert published.figure("safety", "total", "mros") is None
    assert published.reconfiguration_s is None and published.targets == ()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ([], "p.yaml: the file: is '[]', must be a mapping"),
        ({"source": "a", "tables": {}}, "targets: is missing"),
        (LEAST | {"tables": {"safety": {"total": {"title": "t", "mros": "much"}}}}, "tables.safety.total.mros: is"),
        (LEAST | {"targets": [{"table": "safety", "row": "total"}]}, r"targets\[0\]: give one of at_most"),
        (LEAST | {"targets": [{"at_most": 1, "at_least": 2}]}, r"targets\[0\]: give one of"),
        (LEAST | {"targets": [{"at_most": 1}]}, r"targets\[0\]: give its table and its row"),
        (LEAST | {"targets": [{"at_most": 1, "tabel": "safety"}]}, r"targets\[0\].tabel: unknown key"),
    ],
)
def test_nonsense_is_refused_with_its_place(content, said):
    with pytest.raises(PublishedError, match=said.replace("'[]'", r"'\[\]'")):
        parse_published(content, "p.yaml")


def test_file_that_is_not_there_is_named():
    with pytest.raises(PublishedError, match=r"nowhere\.yaml: No such file"):
        read_published(Path("nowhere.yaml"))
