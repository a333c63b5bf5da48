"""The figure of a mission."""

import struct
from dataclasses import replace

from metacontrol_bags.bag import read_record
from metacontrol_bags.figure import configuration_spans, draw, others_observed
from metacontrol_bags.record import ConfigurationReport, Event, MissionRecord, QualityReport


def test_configuration_counts_from_stable_on():
    record = MissionRecord(
        events=(Event(10.0, "MISSION_START", "r1"), Event(20.0, "MISSION_END", "r1")),
        configurations=(
            ConfigurationReport(8.0, "f", "a", "STABLE"),
            ConfigurationReport(14.0, "f", "b", "RECONFIGURING"),
            ConfigurationReport(15.0, "f", "b", "STABLE"),
        ),
    )
    assert configuration_spans(record) == [(10.0, 15.0, "a"), (15.0, 20.0, "b")]


def test_figure_has_its_size(mission_bag, tmp_path):
    draw(read_record(mission_bag.write(tmp_path / "mission.bag")), tmp_path / "mission.png")
    header = (tmp_path / "mission.png").read_bytes()[:24]
    assert struct.unpack(">II", header[16:24]) == (1600, 2000)


def test_figure_shows_what_else_was_observed(mission_bag, tmp_path):
    record = read_record(mission_bag.write(tmp_path / "mission.bag"))
    assert others_observed(record) == []
    told = [QualityReport(record.start_stamp + t, "slope", degrees) for t, degrees in ((1.0, -3.0), (2.0, None))]
    climbing = replace(record, observed=(*record.observed, *told))
    assert others_observed(climbing) == ["slope"]
    draw(climbing, tmp_path / "climbing.svg")
    assert "<!-- slope -->" in (tmp_path / "climbing.svg").read_text()
    draw(record, tmp_path / "mission.svg")
    assert "<!-- slope -->" not in (tmp_path / "mission.svg").read_text()
