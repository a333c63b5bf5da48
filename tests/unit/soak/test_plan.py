"""Which faults strike in which mission."""

from collections import Counter

from soak.plan import FAULTS_EACH, GROUPS, PHASES, SPOILED, Kind, mission

MANY = [mission(7, number) for number in range(300)]
FAULTS = [fault for one in MANY for fault in one.faults]


def test_plan_follows_from_seed_and_number_alone():
    assert mission(7, 33) == mission(7, 33) == MANY[33]
    assert mission(8, 33) != MANY[33] != mission(7, 34)


def test_every_kind_strikes_within_some_missions():
    assert {fault.kind for one in MANY[:30] for fault in one.faults} == set(Kind)


def test_every_way_is_drawn():
    ways = Counter((fault.kind, fault.how) for fault in FAULTS)
    assert all(ways[Kind.DATA, how] for how in SPOILED)
    assert all(ways[Kind.KILL_IN_CHANGE, phase] for phase in PHASES)


def test_faults_come_one_after_the_other():
    for one in MANY:
        times = [fault.at for fault in one.faults]
        assert times == sorted(times) and len(times) <= FAULTS_EACH and times[0] >= 2.0


def test_what_ends_a_mission_comes_last_and_once():
    for one in MANY:
        assert not any(fault.kind.ends_mission for fault in one.faults[:-1])


def test_pellet_is_hit_only_where_it_runs():
    assert not [one for one in MANY if one.engine == "rules" for fault in one.faults if "pellet" in fault.targets]
    assert any("pellet" in fault.targets for fault in FAULTS)


def test_each_kind_is_in_one_group():
    assert sorted(kind.value for group in GROUPS.values() for kind in group) == sorted(kind.value for kind in Kind)
