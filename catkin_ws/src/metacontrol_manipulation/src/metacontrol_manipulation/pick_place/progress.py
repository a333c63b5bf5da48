"""What is known of the work: the table as it was seen last, and what was tried in vain.

A program that takes over begins with `Progress()`, looks, and goes on: what it does not know makes it look more often
and try again what another one gave up, but never touch a block that is in place.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from metacontrol_manipulation.pick_place.actions import MoveBase, Open, Pick, Place, PutDown, Retreat
from metacontrol_manipulation.pick_place.pyramid import SLOTS, Slot, carrying

if TYPE_CHECKING:
    from collections.abc import Mapping

    from metacontrol_manipulation.perception.blocks import Block, BlockView
    from metacontrol_manipulation.pick_place.actions import Action

_HANDLING = Pick | Place | PutDown | Open | Retreat
"""Actions that move blocks, or try to."""
_SAME_BASE = 0.1
"""m within which the base stands where it stood."""
_SAME_PLACE = 0.02
"""m within which a block that was not taken is still the same."""


@dataclass(frozen=True)
class Progress:
    """The work as far as it is known.

    Attributes:
        filled: slots with a block in place.
        hidden: slots of which it is not known whether they are filled: all, before the first look.
        blocks: loose blocks that were seen last.
        unclear: where something was seen then that may be a block.
        clear: whether the arms were out of the camera's way then.
        looked_from: m along the table, where the base stood for looks with clear sight since blocks last moved.
        driven_to: m along the table, where the base was sent since then.
        failures: how often an action was tried in vain since a block was placed, by `key_of`.
    """

    filled: frozenset[Slot] = frozenset()
    hidden: frozenset[Slot] = frozenset(SLOTS)
    blocks: tuple[Block, ...] = ()
    unclear: tuple[Block, ...] = ()
    clear: bool = False
    looked_from: tuple[float, ...] = ()
    driven_to: tuple[float, ...] = ()
    failures: Mapping[object, int] = field(default_factory=dict)

    def failed(self, action: Action, base_y: float) -> int:
        """Return how often an action was tried in vain from where the base stands, m along the table."""
        return self.failures.get(key_of(action, base_y), 0)


def perceived(progress: Progress, view: BlockView, base_y: float, *, clear: bool) -> Progress:
    """Return what is known after a look.

    Args:
        progress: what was known.
        view: what was seen.
        base_y: m, where the base stood along the table.
        clear: whether the arms were out of the way, as far as they can go.
    """
    progress = pyramid_perceived(progress, view)
    looked_from = (*progress.looked_from, base_y) if clear else progress.looked_from
    return replace(progress, blocks=view.blocks, unclear=view.unclear, clear=clear, looked_from=looked_from)


def pyramid_perceived(progress: Progress, view: BlockView) -> Progress:
    """Return what is known after a look at the pyramid only, as where an arm is at work beside it."""
    filled = carrying(view.filled | (view.hidden & progress.filled))
    return replace(progress, filled=filled, hidden=frozenset(view.hidden & progress.hidden) - filled)


def acted(progress: Progress, action: Action, base_y: float, *, succeeded: bool) -> Progress:
    """Return what is known after an action has ended.

    Args:
        progress: what was known.
        action: that has ended.
        base_y: m, where the base stood along the table when it began.
        succeeded: whether it has done what it was to do.
    """
    if not succeeded:
        failures = Counter(progress.failures)
        failures[key_of(action, base_y)] += 1
        progress = replace(progress, failures=dict(failures))
    elif isinstance(action, Place):  # what is in the way of one block may not be in that of the next
        progress = replace(progress, failures={})
    elif isinstance(action, Pick):
        progress = replace(progress, blocks=tuple(block for block in progress.blocks if block != action.block))
    if isinstance(action, Place):  # a look will tell whether it is filled
        progress = replace(progress, hidden=progress.hidden | ({action.slot} - progress.filled))
    if isinstance(action, MoveBase):
        return replace(progress, driven_to=(*progress.driven_to, action.y))
    if isinstance(action, _HANDLING):
        return replace(progress, looked_from=(), driven_to=(), clear=False)
    return progress


def key_of(action: Action, base_y: float) -> object:
    """Return what makes two actions the same: a block that has hardly moved is the same block.

    What an arm can't do from one place of the base, it may do from another one.
    """
    base = round(base_y / _SAME_BASE)
    if isinstance(action, Pick):
        block = action.block
        return Pick, action.arm, round(block.x / _SAME_PLACE), round(block.y / _SAME_PLACE), base
    if isinstance(action, Place):
        return Place, action.arm, action.slot, base
    if isinstance(action, PutDown):
        return PutDown, action.arm, base
    if isinstance(action, MoveBase):
        return MoveBase, round(action.y / _SAME_PLACE)
    return action
