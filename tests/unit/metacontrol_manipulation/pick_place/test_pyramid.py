"""The pyramid: where its slots are, and what carries what."""

import pytest
from metacontrol_manipulation.pick_place.pyramid import SLOTS, Slot, can_be_filled, carrying


def test_slots_are_where_the_cell_has_them():
    ys = {layer: [round(slot.position[1], 3) for slot in SLOTS if slot.layer == layer] for layer in range(3)}
    assert ys == {0: [-0.056, 0.0, 0.056], 1: [-0.028, 0.028], 2: [0.0]}
    assert [round(Slot(layer, 0).position[2], 3) for layer in range(3)] == [0.425, 0.475, 0.525]
    assert {slot.position[0] for slot in SLOTS} == {-0.20}


@pytest.mark.parametrize("slot", SLOTS, ids=str)
def test_a_block_stands_astride_those_below(slot):
    below = [support.position for support in slot.supports]
    if slot.layer:
        assert sum(y for _, y, _ in below) / 2 == pytest.approx(slot.position[1])
    else:
        assert not below


def test_a_slot_can_be_filled_when_those_below_are():
    assert [slot for slot in SLOTS if can_be_filled(slot, {Slot(0, 0), Slot(0, 1)})] == [Slot(0, 2), Slot(1, 0)]


def test_what_a_filled_slot_stands_on_is_filled():
    assert carrying({Slot(1, 1)}) == {Slot(1, 1), Slot(0, 1), Slot(0, 2)}
    assert carrying({Slot(2, 0)}) == set(SLOTS)
