"""When limits were violated, until when and where, against values worked out by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metacontrol_bags.bag import read_record
from metacontrol_bags.metrics import summarise
from metacontrol_bags.record import Event, MissionRecord
from metacontrol_bags.series import share_above
from metacontrol_bags.side_by_side import table
from metacontrol_bags.violations import CALM_S, Violation, describe, pieces_above, places, violations

LEVELS = ((0.0, 0.2), (2.0, 0.9), (3.0, 0.8), (4.0, 0.1), (6.0, 0.7), (7.0, 0.0), (20.0, 0.9), (21.0, 0.5))


def test_pieces_are_the_times_above_the_limit():
    assert pieces_above(LEVELS, 0.6, 0.0, 30.0) == [(2.0, 4.0), (6.0, 7.0), (20.0, 21.0)]
    assert pieces_above(LEVELS, 0.6, 2.5, 20.5) == [(2.5, 4.0), (6.0, 7.0), (20.0, 20.5)]
    assert pieces_above(LEVELS, 0.9, 0.0, 30.0) == []
    assert pieces_above(LEVELS, 0.6, -5.0, 0.0) is None and pieces_above((), 0.6, 0.0, 1.0) is None


def test_pieces_with_short_pauses_are_one_violation():
    found = violations(pieces_above(LEVELS, 0.6, 0.0, 30.0), 30.0)
    assert found == [Violation(2.0, 7.0, 3.0, 2), Violation(20.0, 21.0, 1.0, 1)]
    pause = [(0.0, 1.0), (1.0 + CALM_S, 7.0)]
    assert len(violations(pause, 30.0)) == 2
    assert len(violations([(0.0, 1.1), pause[1]], 30.0)) == 1


def test_violation_that_lasts_to_the_end_has_no_relief():
    assert violations([(2.0, 4.0)], 4.0) == [Violation(2.0, None, 2.0, 1)]


def test_places_are_cells_with_the_seconds_above_the_limit():
    poses = np.array([(0.0, 0.1, 0.1), (2.5, 0.6, 0.1), (3.5, -0.1, -0.1), (6.5, 0.6, 0.1)])
    found = places([(2.0, 4.0), (6.0, 8.0)], poses, 10.0)
    assert found == pytest.approx({(-1, -1): 1.0, (0, 0): 0.5, (1, 0): 2.5})
    assert places([], poses, 10.0) == {} and places([(1.0, 2.0)], np.empty((0, 3)), 10.0) == {}


@given(
    st.lists(st.tuples(st.floats(0.01, 9.0), st.sampled_from([0.1, 0.6, 0.7])), min_size=1, max_size=20),
    st.floats(1.0, 60.0),
)
def test_pieces_add_up_to_the_share_of_time_and_places_to_the_pieces(steps, end):
    stamps = np.cumsum([step for step, _ in steps]) - steps[0][0]
    samples = tuple((float(stamp), level) for stamp, (_, level) in zip(stamps, steps, strict=True))
    pieces = pieces_above(samples, 0.6, 0.0, end)
    total = sum(until - begin for begin, until in pieces)
    assert total == pytest.approx(share_above(samples, 0.6, 0.0, end) * end)
    assert sum(found.above_s for found in violations(pieces, end)) == pytest.approx(total)
    poses = np.column_stack((stamps, np.arange(len(stamps)), np.zeros(len(stamps))))
    assert sum(places(pieces, poses, end).values()) == pytest.approx(total)


def test_summary_has_violations_and_places(mission_bag, tmp_path):
    summary = summarise(read_record(mission_bag.write(tmp_path / "mission.bag")))
    assert summary["violations"] == {
        "safety": [{"stamp_s": 6.0, "relief_s": 0.4, "above_s": 0.4, "pieces": 1}],
        "energy": [],
    }
    # 0.8 m/s: at x = 4.8 m after 6 s, and at 5.0 m after 6.25 s, which is told at the next pose
    places = summary["violation_places"]
    assert places == {"cell_m": 0.5, "safety": [[9, 0, 0.3], [10, 0, 0.1]], "energy": []}


def test_what_is_not_known_of_violations_is_null():
    assert describe((), np.empty((0, 3)), 0.5, 0.0, 9.0) == (None, None)
    assert describe(((0.0, 0.9),), np.empty((0, 3)), 0.5, 0.0, 9.0)[1] is None
    assert summarise(MissionRecord())["violations"] == {"safety": None, "energy": None}


def test_violations_stand_side_by_side():
    ends = (Event(0.0, "MISSION_START", "r1"), Event(9.0, "MISSION_END", "r1"))
    levels = {"safety": ((0.0, 0.9), (2.0, 0.1), (8.0, 0.9)), "energy": ((0.0, 0.1),)}
    rows = dict(table({"a": summarise(MissionRecord(events=ends, true_quality=levels))})[1:])
    assert rows["violations of the safety threshold"] == "2, relief after 2.00 s, the last one to the end"
    assert rows["violations of the energy threshold"] == "0"
