"""What managers decide: rules by hand for D2, random choices, respawn."""

import csv
from pathlib import Path

import pytest
from metacontrol_experiments.managers.d2_rules import RuleError, by_rules, variants_of
from metacontrol_experiments.managers.manager import ManagerError, Restart, Situation, find_manager
from metacontrol_experiments.managers.reactive import COOL_DOWN_S, WINDOW_S, ReactiveManager, Trouble, at_random
from metacontrol_experiments.managers.respawn import RESPAWN_S, RespawnManager
from metacontrol_experiments.managers.violations import Violations
from mros1_reasoner.knowledge.model import Design, Direction, Need, Objective, Quality
from mros1_reasoner.loop.entries import ActiveFact, ComponentFact, LevelFact, StaleFact

TABLE = Path(__file__).parents[4] / "catkin_ws/src/metacontrol_sim/models/variants.csv"
SAFETY, ENERGY, LASER = Trouble(quality="safety"), Trouble(quality="energy"), Trouble(component="front_laser")
DARK = Trouble(surroundings="light", words="light 0.1 < 0.25")


class Models:
    """A knowledge base of a pump with three designs; one needs a valve, and a depth of water that is not too small."""

    qualities = {"noise": Quality(), "flow": Quality(Direction.HIGHER_IS_BETTER)}
    environment = frozenset({"depth", "frost"})

    def solving(self, function):
        assert function == "f_pump"
        needs = {"quiet": (), "strong": (), "valved": ("valve",)}
        wet = {"valved": (Need("depth", least=0.4), Need("frost", most=2.0))}
        return tuple(
            Design(name, function, components=frozenset(parts), needs=wet.get(name, ()))
            for name, parts in needs.items()
        )


def reactive(choose, limits=None):
    objective = Objective("o_pump", "f_pump", limits or {"noise": 0.5})
    manager = ReactiveManager("pump", Situation("strong", 1, Models(), (objective,)), choose)
    manager.take(0.0, ActiveFact("f_pump", "strong", "STABLE"))
    return manager


def fed(manager, quality, level, start=0.0, end=WINDOW_S):
    for tick in range(int(start * 10), int(end * 10) + 1):
        manager.take(tick / 10, LevelFact(quality, level))
    return manager.step(end, heartbeat=True)


@pytest.fixture(scope="module")
def table():
    with TABLE.open() as file:
        rows = {row.pop("name"): row for row in csv.DictReader(file)}
    for row in rows.values():
        row |= {column: float(row[column]) for column in row if column != "observation_source" and row[column]}
    return variants_of(rows, "variants.csv")


@pytest.mark.parametrize(
    ("trouble", "running", "chosen"),
    [
        (SAFETY, "f2_v3_r2", "f2_v2_r2"),
        (SAFETY, "f2_v2_r2", "f2_v1_r2"),
        (SAFETY, "f2_v1_r2", "f2_v1_r3"),
        (SAFETY, "f2_v1_r3", None),
        (ENERGY, "f3_v2_r2", "f2_v2_r2"),
        (ENERGY, "f1_v2_r2", "f1_v1_r2"),
        (ENERGY, "f1_v1_r2", None),
        (LASER, "f2_v2_r2", "f2_v1_r2_b"),
        (LASER, "f3_v3_r1", "f1_v3_r1_k"),
        (DARK, "f1_v3_r1_k", "f1_v3_r1"),
    ],
)
def test_rules_take_the_next_step_that_an_engineer_would_write(table, trouble, running, chosen):
    others = tuple(sorted(set(table) - {running}))
    assert by_rules(table)(trouble, running, others) == chosen


def test_rules_take_none_that_cannot_run(table):
    thirty = tuple(name for name in table if not name.endswith("_b"))
    assert by_rules(table)(LASER, "f2_v2_r2", thirty) == "f2_v1_r3_k"
    with_camera = tuple(name for name in table if name.endswith("_k"))
    assert by_rules(table)(SAFETY, "f1_v3_r1_k", with_camera) == "f1_v1_r3_k"
    assert by_rules(table)(SAFETY, "f2_v1_r3_k", ()) is None


def test_rules_refuse_another_table():
    with pytest.raises(RuleError, match=r"pumps\.csv: a: controller_frequency_hz is None"):
        variants_of({"a": {"flow": 2}}, "pumps.csv")


def test_random_choice_is_among_those_that_can_run_and_follows_the_seed():
    others = tuple("abcdefgh")
    drawn = [[at_random(seed)(SAFETY, "x", others) for _ in range(3)] for seed in (1, 1, 2, 3)]
    assert drawn[0] == drawn[1] and {name for row in drawn for name in row} <= set(others)
    choose = at_random(5)
    assert {choose(SAFETY, "x", others) for _ in range(200)} == set(others)
    assert choose(SAFETY, "x", ()) is None


def test_violated_limit_asks_for_another_variant_once():
    manager = reactive(lambda trouble, running, others: others[0])
    (decision,) = fed(manager, "noise", 0.7)
    assert (decision.trigger, decision.from_configuration, decision.to_configuration) == ("qa:noise", "strong", "quiet")
    assert manager.step(WINDOW_S + 0.1, heartbeat=True) == []  # under way
    done = manager.executed(3.0, decision.id)
    assert (done.state, done.stamp_executed, done.id) == ("EXECUTED", 3.0, decision.id)


def test_levels_after_a_change_count_only_after_the_cool_down():
    manager = reactive(lambda trouble, running, others: "quiet")
    (decision,) = fed(manager, "noise", 0.7)
    manager.executed(3.0, decision.id)
    manager.take(3.0, ActiveFact("f_pump", "quiet", "STABLE"))
    assert fed(manager, "noise", 0.7, 3.0, 3.0 + WINDOW_S) == []
    assert fed(manager, "noise", 0.7, 5.1, 3.0 + COOL_DOWN_S)


def test_kept_limits_and_unknown_levels_ask_for_nothing():
    manager = reactive(lambda trouble, running, others: others[0])
    assert fed(manager, "noise", 0.4) == [] and fed(manager, "heat", 9.0) == []
    manager.take(WINDOW_S, LevelFact("noise", 0.9))
    manager.take(WINDOW_S, StaleFact("noise"))
    assert manager.step(WINDOW_S, heartbeat=True) == []


def test_failed_component_is_answered_at_once_and_its_variants_are_left_out():
    asked = []
    manager = reactive(lambda trouble, running, others: asked.append(others) or "quiet")
    manager.take(0.5, ComponentFact("valve", "FALSE"))
    assert manager.step(0.5, heartbeat=False) == []  # the running variant does not need it
    fed(manager, "noise", 0.7)
    assert asked == [("quiet",)]
    needing = reactive(lambda trouble, running, others: others[0])
    needing.take(0.0, ActiveFact("f_pump", "valved", "STABLE"))
    needing.take(0.5, ComponentFact("valve", "FALSE"))
    (decision,) = needing.step(0.5, heartbeat=False)
    assert decision.trigger == "component:valve"


def test_variant_that_the_surroundings_do_not_suit_is_left_at_once_and_not_taken():
    manager = reactive(lambda trouble, running, others: others[0])
    manager.take(0.0, ActiveFact("f_pump", "valved", "STABLE"))
    manager.take(0.5, LevelFact("depth", 0.9))
    assert manager.step(0.5, heartbeat=False) == []
    manager.take(0.6, LevelFact("depth", 0.1))
    manager.take(0.6, StaleFact("depth"))  # the last value holds
    (decision,) = manager.step(0.6, heartbeat=False)
    assert (decision.trigger, decision.causes) == ("environment:depth", ("depth 0.1 < 0.4",))
    asked = []
    manager = reactive(lambda trouble, running, others: asked.append(others))
    manager.take(0.0, LevelFact("frost", 5.0))
    fed(manager, "noise", 0.7)
    assert asked == [("quiet",)]


def test_mean_of_the_window_counts_and_the_worst_quality_comes_first():
    found = Violations(Models.qualities, {"noise": 0.5, "flow": 2.0}, 2.0)
    for now in (0.0, 1.0, 2.0):
        found.observe(now, "noise", 0.7 if now != 1.0 else 0.4)
        found.observe(now, "flow", 1.0)
        assert found.found(now) == ([] if now < 2.0 else ["flow", "noise"])
    found.observe(9.0, "noise", 0.1)
    assert found.found(9.0) == ["flow"]


def test_request_that_failed_is_followed_by_another_choice_after_a_while():
    chosen = iter(["quiet", "valved"])
    manager = reactive(lambda trouble, running, others: next(chosen))
    (decision,) = fed(manager, "noise", 0.7)
    failed = manager.failed(3.0, decision.id, "no power")
    assert (failed.state, failed.id) == ("FAILED", decision.id) and failed.explanation.endswith("; failed: no power")
    assert fed(manager, "noise", 0.7, 3.0, 3.0 + COOL_DOWN_S - 0.1) == []
    (second,) = fed(manager, "noise", 0.7, 3.0 + COOL_DOWN_S, 6.0 + COOL_DOWN_S)
    assert second.to_configuration == "valved" and second.id != decision.id


def test_driver_that_ended_is_started_again_after_a_while():
    manager = RespawnManager()
    manager.ended(1.0, "laser")
    assert list(manager.step(1.0 + RESPAWN_S / 2, heartbeat=False)) == []
    assert list(manager.step(1.0 + RESPAWN_S, heartbeat=False)) == [Restart("laser")]
    assert list(manager.step(9.0, heartbeat=False)) == []


@pytest.mark.parametrize("name", ["none", "mros", "as_published", "random", "rules", "respawn"])
def test_managers_are_plug_ins(name):
    assert callable(find_manager(name).load())


def test_unknown_manager_is_refused_with_those_that_there_are():
    with pytest.raises(
        ManagerError, match="no manager 'magic'; there are as_published, mros, none, random, respawn, rules"
    ):
        find_manager("magic")
