"""The files of a report: what is read, what is refused, and that the same table gives the same bytes."""

import pyarrow
import pytest
from click.testing import CliRunner
from helpers.campaign_tables import LOG, change, result, violation, write
from metacontrol_experiments.cli.main import metacontrol
from metacontrol_experiments.io.report_files import find_table, read_floor, read_published, read_table, write_report
from metacontrol_experiments.io.report_pair import find_pair
from metacontrol_experiments.report.missions import ReportError
from metacontrol_experiments.report.report import make_report
from pyarrow import parquet

CAMPAIGN = "parts: {main: {routes: [east], initial_configurations: [slow], power: [1.4], managers: {none: 4, mros: 4}}}"


def campaign():
    told = []
    for n in range(1, 5):
        violations = {"energy": [violation(3.0, 1.0)], "safety": []}
        places = {"cell_m": 0.5, "energy": [[1, -n, 0.5]], "safety": [[3, 2, 0.1]]}
        told += [result("none", n, power=1.4, energy=0.02 * n, summary={"violation_places": places})]
        summary = {"reconfigurations": [change(), change("component:arm")], "violations": violations}
        told += [result("mros", n, power=1.4, energy=0.01 * n, duration=43.0, summary=summary)]
    return told


def written(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def silent(_text):
    raise AssertionError("nothing is driven")


def make(table, folder):
    found = read_table(table)
    single = find_pair(found.missions, table, silent, anew=False)
    write_report(make_report(found, read_published(), single, read_floor()), folder)
    return written(folder)


def test_same_table_gives_the_same_bytes_on_any_day(tmp_path):
    told = campaign()
    logs = {told[2].run.name: LOG, told[3].run.name: LOG}
    table = write(tmp_path / "out", told, CAMPAIGN, logs)
    first = make(table, tmp_path / "first")
    assert first == make(table, tmp_path / "second")
    names = ["distributions", "map", "pair", "reconfigurations", "tradeoff"]
    expected = {f"figures/{name}.{kind}" for name in names for kind in ("png", "svg")}
    assert first.keys() == {"report.md", "report.html"} | expected
    text = first["report.md"].decode()
    assert "until 2026-01-02T03:04:05+00:00" in text and str(tmp_path) not in text


def test_table_tells_its_campaign(tmp_path):
    found = read_table(write(tmp_path, campaign(), CAMPAIGN))
    assert (found.asked, len(found.missions), found.name) == (8, 8, "results.parquet")
    assert found.campaign == CAMPAIGN
    assert read_table(write(tmp_path, campaign(), "]")).asked is None


def test_table_is_found_by_its_path_and_by_its_folder(tmp_path):
    table = write(tmp_path, campaign())
    assert find_table(tmp_path) == find_table(table) == table
    with pytest.raises(ReportError, match=r"elsewhere: no such table; name the folder of a campaign"):
        find_table(tmp_path / "elsewhere")


def test_file_that_is_no_table_of_a_campaign_is_refused(tmp_path):
    path = tmp_path / "results.parquet"
    path.write_text("no table")
    with pytest.raises(ReportError, match=r"results\.parquet: is no Parquet table"):
        read_table(path)
    parquet.write_table(pyarrow.table({"x": [1]}), path)
    with pytest.raises(ReportError, match=r"row 1: has no column part, route"):
        read_table(path)


@pytest.mark.parametrize("content", [None, "no table"])
def test_command_refuses_with_one_line_and_leaves_nothing(tmp_path, content):
    if content:
        (tmp_path / "results.parquet").write_text(content)
    before = written(tmp_path)
    refused = CliRunner().invoke(metacontrol, ["report", str(tmp_path), "--output", str(tmp_path / "made")])
    assert refused.exit_code == 2 and refused.stderr.count("\n") == 1
    assert "results.parquet" in refused.stderr and written(tmp_path) == before


def test_pair_without_a_log_is_not_drawn_unless_it_is_driven(tmp_path):
    table = write(tmp_path, campaign())
    found = find_pair(read_table(table).missions, table, silent, anew=False)
    assert found.missions == () and found.told == "Its runs left no log."


def test_pair_that_cannot_be_driven_is_told(tmp_path):
    table, said = write(tmp_path, campaign()), []
    found = find_pair(read_table(table).missions, table, said.append, anew=True)
    assert len(said) == 1 and found.missions == ()
    assert "could not be driven: " in found.told and "no route 'east'" in found.told


def test_log_of_something_else_is_no_series(tmp_path):
    told = campaign()
    table = write(tmp_path, told, "", {told[2].run.name: "roslaunch says", told[3].run.name: LOG})
    assert find_pair(read_table(table).missions, table, silent, anew=False).missions == ()


def test_floor_of_the_factory_has_walls():
    floor = read_floor()
    assert floor.occupied.any() and not floor.occupied.all()


def test_folder_that_cannot_be_made_is_named(tmp_path):
    write(tmp_path, campaign())
    (tmp_path / "report").write_text("in the way")
    refused = CliRunner().invoke(metacontrol, ["report", str(tmp_path), "--no-drive"])
    assert refused.exit_code == 2 and refused.stderr.endswith("report/figures: Not a directory\n")
