"""What to do next: single decisions, and whole runs with failures and takeovers on a simulated table."""

from dataclasses import replace

import pytest
from helpers.simulated_table import ARMS, Table, lying, reach, run
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st
from metacontrol_manipulation.perception.blocks import BlockView
from metacontrol_manipulation.pick_place.actions import Done, Look, MoveBase, Open, Pick, Place, PutDown, Retreat, Stuck
from metacontrol_manipulation.pick_place.next_step import BOTH_ARMS, TRIES, Situation, next_step, one_arm
from metacontrol_manipulation.pick_place.progress import Progress, acted, perceived
from metacontrol_manipulation.pick_place.pyramid import SLOTS, Slot

LEFT_BLOCK, RIGHT_BLOCK, FAR_LEFT = lying(-0.2, 0.4), lying(-0.2, -0.4), lying(-0.2, 0.65)


def situation(*blocks, filled=(), hidden=(), held=(), working=ARMS, base_y=0.0, clear=True):
    view = BlockView(tuple(blocks), frozenset(filled), frozenset(hidden), 1.0)
    progress = perceived(Progress(), view, base_y, clear=clear)
    return Situation(progress, frozenset(held), frozenset(working), base_y)


def decide(now, design=BOTH_ARMS, under_way=()):
    return next_step(now, design, reach, under_way)


def test_each_arm_picks_on_its_side():
    now = situation(LEFT_BLOCK, RIGHT_BLOCK)
    first = decide(now)
    second = decide(now, under_way=[first])
    assert {first, second} == {Pick("left", LEFT_BLOCK), Pick("right", RIGHT_BLOCK)}
    assert decide(now, under_way=[first, second]) is None


def test_one_arm_at_a_time_is_over_the_pyramid():
    now = situation(held=ARMS)
    first = decide(now)
    assert isinstance(first, Place)
    assert decide(now, under_way=[first]) is None


def test_the_other_arm_picks_while_one_places():
    now = situation(RIGHT_BLOCK, held=["left"])
    place = decide(now)
    assert place == Place("left", Slot(0, 0))
    assert decide(now, under_way=[place]) == Pick("right", RIGHT_BLOCK)


def test_a_block_by_the_pyramid_waits_until_the_other_arm_is_away():
    now = situation(lying(-0.25, -0.15), held=["left"])
    assert decide(now, under_way=[Place("left", Slot(0, 0))]) is None


def test_no_more_blocks_are_picked_than_slots_are_free():
    now = situation(LEFT_BLOCK, RIGHT_BLOCK, filled=SLOTS[:5])
    assert decide(now, under_way=[decide(now)]) is None


def test_layers_are_built_from_below():
    assert decide(situation(held=["left"], filled=SLOTS[:2])) == Place("left", Slot(0, 2))
    assert decide(situation(held=["left"], filled=[*SLOTS[:3], Slot(1, 0)])) == Place("left", Slot(1, 1))


def test_a_hand_that_was_left_at_the_blocks_goes_away_before_the_base_moves():
    now = replace(situation(FAR_LEFT, base_y=0.3, clear=False), away=frozenset(["right"]))
    assert decide(now) == Look()
    assert decide(replace(now, away=frozenset())) == MoveBase(0.0)
    assert decide(situation(FAR_LEFT, base_y=0.3)) == MoveBase(0.0)
    progress = now.progress
    for _ in range(TRIES):  # it can't
        progress = acted(progress, Look(), 0.3, succeeded=False)
    assert decide(replace(now, progress=progress)) == MoveBase(0.0)


def test_an_arm_that_does_not_work_lets_go():
    assert decide(situation(held=["right"], working=["left"])) == Open("right")
    assert decide(situation(held=["right"], working=["left"]), one_arm("left")) == Open("right")


def test_an_arm_that_does_not_work_goes_out_of_the_way_and_drops_nothing_on_the_pyramid():
    now = situation(held=["right"], working=["left"])
    over = replace(now, away=frozenset(["right"]), over_pyramid=frozenset(["right"]))
    beside = replace(now, away=frozenset(["right"]))
    empty = replace(situation(working=["left"]), away=frozenset(["left", "right"]))
    assert decide(over, one_arm("left")) == Retreat("right")
    assert decide(beside, one_arm("left")) == Open("right")
    assert decide(empty, one_arm("left")) == Retreat("right")
    progress = over.progress
    for _ in range(TRIES):
        progress = acted(progress, Retreat("right"), 0.0, succeeded=False)
    assert decide(replace(over, progress=progress), one_arm("left")) == Open("right")


def test_an_arm_that_works_but_is_not_of_the_design_puts_its_block_down():
    assert isinstance(decide(situation(LEFT_BLOCK, held=["right"]), one_arm("left")), PutDown)


def test_the_base_goes_where_one_arm_reaches_a_block_and_then_a_slot():
    drive = decide(situation(RIGHT_BLOCK), one_arm("left"))
    assert isinstance(drive, MoveBase)
    assert reach("left", (-0.2, -0.4, 0.425), drive.y)
    there = situation(RIGHT_BLOCK, base_y=drive.y)
    assert decide(there, one_arm("left")) == Pick("left", RIGHT_BLOCK)
    far = situation(held=["left"], base_y=0.6)
    assert any(reach("left", slot.position, decide(far, one_arm("left")).y) for slot in SLOTS[:3])


def test_the_base_stands_at_home_for_both_arms():
    assert decide(situation(LEFT_BLOCK, base_y=0.3)) == MoveBase(0.0)
    assert decide(situation(LEFT_BLOCK, base_y=0.01)) == Pick("left", LEFT_BLOCK)


def test_a_block_in_the_way_of_the_next_slot_is_taken_first():
    beside = lying(-0.27, 0.05)
    now = situation(LEFT_BLOCK, beside, filled=[Slot(0, 0), Slot(0, 1)])
    assert decide(now) == Pick("left", beside)


def test_a_hand_that_is_needed_for_a_block_in_the_way_is_freed():
    beside = lying(-0.27, 0.05)
    now = situation(beside, filled=[Slot(0, 0), Slot(0, 1)], held=["left"], working=["left"])
    down = decide(situation(beside, filled=SLOTS[:2], held=["left"], working=["left"]), one_arm("left"))
    assert isinstance(decide(now, one_arm("left")), Place)  # another slot is free: the first one of the second layer
    assert isinstance(down, Place)
    blocked = situation(lying(-0.2, 0.0, layer=1), filled=SLOTS[:3], held=["left"], working=["left"])
    assert isinstance(decide(blocked, one_arm("left")), PutDown)


def test_arms_go_out_of_the_way_when_they_hide_what_matters():
    assert decide(Situation(Progress(), frozenset(), frozenset(ARMS), 0.0)) == Look()
    assert decide(situation(hidden=SLOTS, held=["left"], clear=False)) == Look()
    assert decide(situation(clear=False)) == Look()


def test_a_hidden_slot_is_not_filled_again():
    now = situation(LEFT_BLOCK, hidden=SLOTS[:3], held=["left"], clear=False)
    assert decide(now) == Look()


def test_what_was_seen_once_is_known_while_it_is_hidden():
    before = situation(LEFT_BLOCK, filled=SLOTS[:2]).progress
    after = perceived(before, BlockView((LEFT_BLOCK,), frozenset(), frozenset(SLOTS), 0.5), 0.0, clear=False)
    assert (after.filled, after.hidden) == (frozenset(SLOTS[:2]), frozenset())
    placed = acted(after, Place("left", SLOTS[2]), 0.0, succeeded=True)
    assert perceived(placed, BlockView((), frozenset(), frozenset(SLOTS), 0.5), 0.0, clear=False).hidden == {SLOTS[2]}


def test_the_base_looks_from_elsewhere_for_blocks_that_an_arm_hides():
    assert isinstance(decide(situation(working=["left"]), one_arm("left")), MoveBase)


def test_what_may_be_a_block_is_tried_when_no_other_is_left():
    leaning = lying(-0.25, 0.3)
    now = situation()
    for block, found in ((RIGHT_BLOCK, [RIGHT_BLOCK]), (leaning, [])):
        view = BlockView(tuple(found), frozenset(), frozenset(), 1.0, (leaning,))
        progress = perceived(Progress(), view, 0.0, clear=True)
        assert decide(Situation(progress, now.held, now.working, 0.0)).block == block


def test_done_when_all_slots_are_filled():
    assert decide(situation(filled=SLOTS)) == Done()


@pytest.mark.parametrize(
    ("now", "design", "reason"),
    [
        (situation(LEFT_BLOCK, working=[]), BOTH_ARMS, "no arm of the design works"),
        (situation(), BOTH_ARMS, "no loose block is seen"),
        (situation(lying(0.3, 0.0)), BOTH_ARMS, "no arm can take any of 1 loose blocks"),
        (situation(lying(0.3, 0.0), filled=SLOTS[:5]), BOTH_ARMS, "no arm can take"),
        (situation(LEFT_BLOCK, hidden=SLOTS, held=["left"]), BOTH_ARMS, "it can't be seen whether"),
    ],
)
def test_stuck_says_why(now, design, reason):
    said = decide(now, design)
    assert isinstance(said, Stuck)
    assert reason in said.reason


def test_what_fails_again_and_again_is_given_up():
    now = situation(LEFT_BLOCK)
    progress = now.progress
    for _ in range(TRIES):
        action = next_step(Situation(progress, now.held, now.working, 0.0), BOTH_ARMS, reach)
        assert action == Pick("left", LEFT_BLOCK)
        progress = perceived(acted(progress, action, 0.0, succeeded=False), view_of(LEFT_BLOCK), 0.0, clear=True)
    said = next_step(Situation(progress, now.held, now.working, 0.0), BOTH_ARMS, reach)
    assert isinstance(said, Stuck)
    assert "in vain" in said.reason


def test_the_base_is_not_sent_to_and_fro_for_ever():
    """A broken arm that drives along hides each block just when the other arm would reach it."""
    now = situation(RIGHT_BLOCK)
    progress = now.progress
    for _ in range(40):
        action = next_step(Situation(progress, now.held, now.working, 0.0), one_arm("left"), reach)
        if not isinstance(action, MoveBase):
            break
        progress = acted(progress, action, 0.0, succeeded=True)
    assert isinstance(action, Stuck)


def test_a_gripper_that_does_not_open_is_given_up_and_named():
    table = Table(working={"left"}, held={"right"}, jammed={"right"}, loose=[])
    said, _ = run(table, lambda table: None, lambda action: True)
    assert isinstance(said, Stuck)
    assert "the right gripper still holds a block" in said.reason


def view_of(*blocks):
    return BlockView(tuple(blocks), frozenset(), frozenset(), 1.0)


# -- whole runs -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("working", [("left", "right"), ("left",), ("right",)], ids="+".join)
def test_the_pyramid_is_built_by_each_design_without_a_needless_step(working):
    table = Table(working=set(working))
    said, steps = run(table, lambda table: None, lambda action: True)
    assert said == Done()
    assert steps <= 18  # six blocks to pick and to place, a look, drives along the table


@st.composite
def troubles(draw):
    """Arms that break and come back, actions that fail, programs that take over: which of them at which step."""
    events = draw(st.lists(st.sampled_from(["left", "right", "takeover", "bad luck", "both", "nothing"]), max_size=40))
    back = draw(st.sampled_from([set(ARMS), {"left"}, {"right"}]))
    order = draw(st.none() | st.lists(st.integers(0, 1), min_size=1, max_size=10))
    return events, back, order


@given(troubles())
@settings(max_examples=250, phases=[Phase.explicit, Phase.reuse, Phase.generate])
def test_whatever_fails_in_whatever_order_the_pyramid_is_built(trouble):
    """Failures end some time; then the pyramid stands, unless actions have failed so often that they were given up."""
    events, back, order = trouble
    events = list(reversed(events))
    current = [None]
    fails = [0]
    placed = {}

    def disturb(table):
        for slot in placed:
            assert slot in table.filled, "a placed block was touched"
        placed.update(dict.fromkeys(table.filled))
        current[0] = events.pop() if events else None
        if current[0] is None:
            table.working |= back
        elif current[0] in ARMS:
            table.working = {current[0]}
        elif current[0] == "both":
            table.working = set(ARMS)

    def luck(_action):
        bad = current[0] == "bad luck" and fails[0] < TRIES - 1
        fails[0] += bad
        return not bad

    table = Table()
    turns = iter((order or []) * 200)
    said, _ = run(
        *(table, disturb, luck),
        forget=lambda: current[0] == "takeover",
        side_by_side=lambda count: None if order is None else next(turns, 0),
    )
    assert said == Done(), (said, table)
    assert table.filled == set(SLOTS)
    assert len(table.placed) == len(set(table.placed)) == len(SLOTS)


@given(st.lists(st.tuples(st.floats(-0.39, 0.39), st.floats(-0.79, 0.79)), min_size=6, max_size=6))
@example([(0.0195, 0.5), (-0.031, -0.5), (0.0, 0.5)])  # each block is hidden by the arm that is about to take it
@settings(max_examples=100, phases=[Phase.explicit, Phase.reuse, Phase.generate])
def test_it_is_stuck_only_where_it_has_to_be(places):
    """Blocks lie anywhere: one arm builds the pyramid, or reaches none of the blocks that are left."""
    table = Table(loose=[], working={"left"})
    for x, y in places:
        if abs(y) > 0.12:
            table.put(x, y)
    said, _ = run(table, lambda table: None, lambda action: True, steps=60)
    if said == Done():
        assert table.filled == set(SLOTS)
        return
    assert isinstance(said, Stuck)
    positions = [0.05 * step for step in range(-12, 13)]
    left = [(block.x, block.y, block.z) for block in table.loose]
    assert not [place for place in left if any(reach("left", place, y) for y in positions)], (said, table)
