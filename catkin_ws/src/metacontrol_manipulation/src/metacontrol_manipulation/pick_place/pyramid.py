"""The pyramid: its slots, and which of them carry which."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection

TABLE_HEIGHT = 0.40
"""m above the floor."""
SIDE = 0.05
"""m, edge of a block, which is a cube."""
PITCH = 0.056
"""m between the slots of a layer."""
ROW_X = -0.20
"""m, where the pyramid stands on the table, cell frame."""
LAYERS = 3


@dataclass(frozen=True, slots=True, order=True)
class Slot:
    """A place for a block in the pyramid.

    Attributes:
        layer: 0 is on the table.
        number: within its layer, from the smallest y on.
    """

    layer: int
    number: int

    def __str__(self) -> str:
        return f"slot {self.number + 1} of layer {self.layer + 1}"

    @property
    def position(self) -> tuple[float, float, float]:
        """The centre of a block in it, m in the cell frame; its yaw is 0."""
        count = LAYERS - self.layer
        y = (self.number - (count - 1) / 2.0) * PITCH
        return ROW_X, y, TABLE_HEIGHT + (self.layer + 0.5) * SIDE

    @property
    def supports(self) -> tuple[Slot, ...]:
        """The slots on whose blocks a block in this one stands."""
        if self.layer == 0:
            return ()
        return Slot(self.layer - 1, self.number), Slot(self.layer - 1, self.number + 1)


SLOTS = tuple(Slot(layer, number) for layer in range(LAYERS) for number in range(LAYERS - layer))
"""All slots, from below."""


def can_be_filled(slot: Slot, filled: Collection[Slot]) -> bool:
    """Return whether a slot is free and the slots below it are filled."""
    return slot not in filled and all(below in filled for below in slot.supports)


def carrying(filled: Collection[Slot]) -> frozenset[Slot]:
    """Return the filled slots with all that must be filled below them, though a camera may not see it."""
    found = set(filled)
    for slot in reversed(SLOTS):
        if slot in found:
            found.update(slot.supports)
    return frozenset(found)
