"""A table with blocks, arms that fail and programs that take each other over, without physics."""

import math
from dataclasses import dataclass, field

from metacontrol_manipulation.perception.blocks import Block, BlockView
from metacontrol_manipulation.pick_place.actions import (
    Done,
    Look,
    MoveBase,
    Open,
    Pick,
    Place,
    PutDown,
    Stuck,
)
from metacontrol_manipulation.pick_place.next_step import BOTH_ARMS, Situation, next_step, one_arm
from metacontrol_manipulation.pick_place.progress import Progress, acted, perceived
from metacontrol_manipulation.pick_place.pyramid import SIDE, SLOTS, TABLE_HEIGHT, can_be_filled, carrying

ARMS = ("left", "right")
BLOCKS = tuple((-0.15 - 0.05 * (n % 3), side * (0.30 + 0.13 * (n % 3))) for n in range(3) for side in (1, -1))
FAR, NEAR, STEP = 0.72, 0.25, 0.01


def reach(arm, place, base_y):
    """What an arm like a Panda reaches: a ring around its shoulder, 0.7 m before the table's centre."""
    shoulder = (-0.70, base_y + (0.30 if arm == "left" else -0.30))
    return NEAR < math.hypot(place[0] - shoulder[0], place[1] - shoulder[1]) < FAR


def lying(x, y, layer=0):
    return Block(x, y, TABLE_HEIGHT + SIDE * (layer + 0.5), 0.0)


@dataclass
class Table:
    """The truth, and what happens to it; `luck()` says of each action whether it goes well."""

    loose: list = field(default_factory=lambda: [lying(*place) for place in BLOCKS])
    filled: set = field(default_factory=set)
    held: set = field(default_factory=set)
    working: set = field(default_factory=lambda: set(ARMS))
    jammed: set = field(default_factory=set)
    in_the_way: set = field(default_factory=set)
    base_y: float = 0.0
    placed: list = field(default_factory=list)

    def view(self):
        """What the camera sees: an arm in the way hides the blocks and the slots of the lowest layer that it is over.

        Arms drive with the base, so another part of the table is hidden from elsewhere.
        """
        arms = [self.base_y + (0.2 if arm == "left" else -0.2) for arm in self.in_the_way]
        hidden = {slot for slot in SLOTS if slot.layer == 0 and any(abs(slot.position[1] - y) < 0.22 for y in arms)}
        seen = [block for block in self.loose if not any(abs(block.y - y) < 0.15 for y in arms)]
        filled = carrying(self.filled - hidden)
        return BlockView(tuple(seen), filled, frozenset(hidden - filled), 1.0)

    def put(self, x, y):
        """Let a block lie at a place, or beside it where another one lies."""
        while any(math.hypot(x - block.x, y - block.y) < 0.075 for block in self.loose):
            x -= STEP
            y += 0.08 if y > 0 else -0.08
        self.loose.append(lying(x, y))

    def do(self, action, luck=True):
        """Carry out an action; return whether it went well. An arm without luck fails, with or without its block."""
        match action:
            case Look():
                self.in_the_way &= set(ARMS) - self.working
                return True
            case MoveBase(y):
                self.base_y = y
                return True
            case Open(arm):
                if arm in self.jammed:
                    return False
                self.held.discard(arm)
                self.put(-0.25, 0.2 if arm == "left" else -0.2)
                return True
        return self._handle(action, luck)

    def _handle(self, action, luck):
        arm = action.arm
        assert arm in self.working, f"{action} of an arm that does not work"
        self.in_the_way.add(arm)
        match action:
            case Pick(_, block):
                assert arm not in self.held
                assert reach(arm, (block.x, block.y, block.z), self.base_y)
                if not luck or block not in self.loose:
                    return False
                self.loose.remove(block)
                self.held.add(arm)
            case Place(_, slot):
                assert arm in self.held
                assert can_be_filled(slot, self.filled), f"{slot} can't be filled"
                assert reach(arm, slot.position, self.base_y)
                self.held.discard(arm)
                if not luck:
                    self.put(-0.27, 0.03)  # it slips beside the pyramid, where the hand has to be
                    return False
                self.filled.add(slot)
                self.placed.append(slot)
            case PutDown(_, x, y):
                assert arm in self.held
                assert reach(arm, (x, y, TABLE_HEIGHT + SIDE / 2), self.base_y)
                self.held.discard(arm)
                self.put(x, y)
        return True


def design_for(table):
    """Return the design that a reasoner would choose, None where there is none."""
    if table.working == set(ARMS):
        return BOTH_ARMS
    return one_arm(min(table.working)) if table.working else None


def run(table, disturb, luck, steps=300, forget=lambda: False, side_by_side=lambda count: None):
    """Let programs build until one says that it is done or stuck; return its last word and how many steps it took.

    Args:
        table: what they work on.
        disturb: is called before each step, and may change the table.
        luck: says whether the next action goes well.
        steps: after which the test gives up.
        forget: says whether another program takes over, which knows nothing.
        side_by_side: says which of so many actions under way ends next; None has one action at a time.
    """
    progress, under_way = Progress(), []
    for step in range(steps):
        disturb(table)
        design = design_for(table)
        if design is None:
            return Stuck("no design"), step
        if forget():
            progress, under_way = Progress(), []
        under_way = [action for action in under_way if getattr(action, "arm", None) not in set(ARMS) - table.working]
        while True:
            clear = not (table.in_the_way & table.working)
            progress = perceived(progress, table.view(), table.base_y, clear=clear)
            situation = Situation(progress, frozenset(table.held), frozenset(table.working), table.base_y)
            action = next_step(situation, design, reach, under_way)
            if action is None:
                break
            if isinstance(action, Done | Stuck):
                assert not under_way
                return action, step
            under_way.append(action)
            if side_by_side(len(under_way)) is None:
                break
        number = side_by_side(len(under_way)) or 0
        action = under_way.pop(number % len(under_way))
        began_at = table.base_y
        progress = acted(progress, action, began_at, succeeded=table.do(action, luck(action)))
    raise AssertionError(f"no end after {steps} steps: {sorted(map(str, table.filled))}, {table.loose}, {table.held}")
