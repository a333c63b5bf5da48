"""When all is well again after a fault."""

from soak.observed import Event, Observed, Process, Sample, Strike, Told
from soak.plan import PARTS, Fault, Kind, Mission
from soak.recovery import recoveries

ALL = tuple(Process(100 + place, role) for place, role in enumerate((*PARTS, "move_base")))
STABLE = {"f_navigate": ("f2_v2_r2", "STABLE")}


def mission(*gone, told=(), lasts=0.0, end=60.0):
    """A mission whose fault at 10 s takes the first process at these moments."""
    fault = Fault(Kind.KILL, 10.0, ("rosgraph_monitor",), "", lasts)
    strikes = [Strike(10.0, 0, False, "")] + [Strike(10.0 + lasts, 0, True, "")] * bool(lasts)
    samples = [Sample(t / 2, ALL[1:] if t / 2 in gone else ALL) for t in range(120)]
    observed = Observed(samples, [Told(0.0, 0.0, STABLE), *told], strikes=strikes)
    observed.events = [Event(end, "MISSION_END", {})]
    return recoveries(Mission(0, 1, "r1", "f2_v2_r2", "pellet", (fault,)), observed)


def test_recovery_ends_when_all_runs_and_is_stable():
    assert mission() == {0: 0.0}
    assert mission(10.0, 10.5, 11.0) == {0: 1.5}
    under_way = Told(10.1, 10.1, {"f_navigate": ("f2_v2_r2", "RECOVERING")})
    assert mission(told=(under_way, Told(14.2, 14.2, STABLE))) == {0: 4.5}


def test_process_that_dies_again_at_once_has_not_recovered():
    assert mission(10.0, 11.0, 11.5) == {0: 2.0}


def test_fault_that_is_taken_back_counts_from_then():
    assert mission(10.0, 10.5, 15.0, lasts=5.0) == {0: 0.5}


def test_mission_that_ends_before_has_no_recovery():
    assert mission(*(t / 2 for t in range(20, 120)), end=20.0) == {0: None}


def test_fault_that_has_not_struck_has_none():
    observed = Observed([Sample(0.0, ALL)])
    assert recoveries(Mission(0, 1, "r1", "f2_v2_r2", "pellet", (Fault(Kind.KILL, 10.0),)), observed) == {}
