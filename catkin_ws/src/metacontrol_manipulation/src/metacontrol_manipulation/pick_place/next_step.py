"""What to do next, from what is perceived alone: any program may take over at any moment."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from metacontrol_manipulation.pick_place.actions import (
    Action,
    Done,
    Look,
    MoveBase,
    Open,
    Pick,
    Place,
    PutDown,
    Retreat,
    Stuck,
)
from metacontrol_manipulation.pick_place.pyramid import ROW_X, SIDE, SLOTS, TABLE_HEIGHT, Slot, can_be_filled

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from metacontrol_manipulation.perception.blocks import Block
    from metacontrol_manipulation.pick_place.progress import Progress

Reach = Callable[[str, tuple[float, float, float], float], bool]
"""Whether an arm reaches a place (m, cell frame) while the base stands at a y (m, along the table); asked often."""

TRIES = 3
"""How often the same action may fail before it is given up."""
FAILURES = 12
"""How many actions may fail before one more block is placed, whatever they are."""
DRIVES = 2
"""How often the base is sent to a place before an arm takes or leaves a block."""
_SAME_PLACE = 0.075
"""m along the table within which places of the base are the same."""
AT_HOME = 0.05
"""m from its place at home within which the base is there."""
OVER_PYRAMID = 0.20
"""m along the table from the middle of the pyramid within which one arm at a time may be."""
BEFORE_SLOT = (0.095, 0.055)
"""m along x and y: a loose block within it is in the way of the fingers, which close along x, or of the block."""
_STANDING_ERROR = 0.03
"""m by which the base may miss where it is sent."""
_PLACES_OF_BASE = tuple(round(0.05 * step, 2) for step in range(-12, 13))
"""m along the table, where the base may be sent."""
_VIEWPOINTS = (0.0, 0.3, -0.3, 0.6, -0.6)
"""m along the table, from where the base lets the camera look for what is hidden."""
_FREE_AROUND = 0.11
"""m from other blocks at which a block is put down: room for the fingers."""


@dataclass(frozen=True, slots=True)
class Design:
    """By what the pyramid is built.

    Attributes:
        arms: that build.
        home: m, where along the table the base stands; None where it drives to what is out of reach.
        needs_all: nothing is done while one of the arms does not work.
    """

    arms: frozenset[str]
    home: float | None = None
    needs_all: bool = False


BOTH_ARMS = Design(frozenset(("left", "right")), 0.0, needs_all=True)
"""Both arms, the base stands at home."""


def one_arm(arm: str) -> Design:
    """Return the design of one arm and the base."""
    return Design(frozenset((arm,)))


@dataclass(frozen=True)
class Situation:
    """What there is to decide from.

    Attributes:
        progress: the table.
        held: arms whose grippers hold a block.
        working: arms that work.
        base_y: m, where the base stands along the table.
        away: arms that are not at home.
        over_pyramid: arms whose hand is near the pyramid.
    """

    progress: Progress
    held: frozenset[str]
    working: frozenset[str]
    base_y: float
    away: frozenset[str] = frozenset()
    over_pyramid: frozenset[str] = frozenset()


def next_step(situation: Situation, design: Design, reach: Reach, under_way: Sequence[Action] = ()) -> Action | None:
    """Return the next action, or None where there is nothing to begin before an action under way has ended.

    Call it again with each action that has begun, until it returns None: then all arms that have something to do are at
    it. Where nothing is under way it returns an action always.

    Args:
        situation: what is perceived.
        design: by what the pyramid is built.
        reach: what the arms reach.
        under_way: actions of this program that have begun and not ended.
    """
    decision = _Decision(situation, design, reach, tuple(under_way))
    action = decision.now()
    if action is None and not under_way:
        action = decision.later()
    return Look() if isinstance(action, MoveBase) and decision.is_in_the_way() else action


class _Decision:
    """One decision."""

    def __init__(self, situation: Situation, design: Design, reach: Reach, under_way: tuple[Action, ...]) -> None:
        self.progress = situation.progress
        self.held = situation.held
        self.working = situation.working
        self.base_y = situation.base_y
        self.away, self.over_pyramid = situation.away, situation.over_pyramid
        self.design = design
        self.reach = reach
        self.under_way = under_way
        self.busy = {action.arm for action in under_way if isinstance(action, Pick | Place | PutDown | Open | Retreat)}
        self.arms = sorted(design.arms & situation.working)
        # Before everything was seen once, a slot that is hidden may be free or not.
        self.empty = [slot for slot in SLOTS if slot not in self.progress.filled and slot not in self.progress.hidden]
        self.fillable = [slot for slot in self.empty if can_be_filled(slot, self.progress.filled)]
        self.free = [slot for slot in self.fillable if not any(self._is_before(block, slot) for block in self.blocks)]

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The loose blocks; where there are none and no arm is in the way, whatever may be one."""
        progress = self.progress
        return progress.unclear if progress.clear and not progress.blocks else progress.blocks

    def is_in_the_way(self) -> bool:
        """Return whether a hand is among the blocks that could go out of the way before the base moves."""
        return bool(self.away & self.working) and not self.progress.clear and not self._is_given_up(Look())

    # -- what can begin at once ---------------------------------------------------------------------------------------

    def now(self) -> Action | None:
        """Return an action that can begin beside those under way."""
        if any(isinstance(action, Look | MoveBase) for action in self.under_way):
            return None
        for step in (self._let_go, self._end, self._go_home, self._hand_over, self._place, self._pick):
            action = step()
            if action is not None:
                return action
        return None

    def _let_go(self) -> Action | None:
        """Have arms that do not work drop their blocks, not on the pyramid, and go out of the way."""
        return self._first(
            action for arm in sorted((self.held | self.away) - self.working) for action in self._free(arm)
        )

    def _free(self, arm: str) -> Iterator[Action]:
        if arm in self.busy:
            return
        if arm in self.held and arm not in self.over_pyramid:
            yield Open(arm)
        if arm in self.away:
            yield Retreat(arm)
        if arm in self.held:
            yield Open(arm)

    def _end(self) -> Action | None:
        if self.under_way:
            return None
        if self.progress.filled.issuperset(SLOTS):
            return Done()
        if not self.arms:
            arms = " and ".join(sorted(self.design.arms))
            return Stuck(f"no arm of the design works ({arms}): free the arm, or take a design with another one")
        if sum(self.progress.failures.values()) >= FAILURES:
            return Stuck(f"{FAILURES} actions have failed in vain since a block was placed: see what the arms report")
        return None

    def _go_home(self) -> Action | None:
        home = self.design.home
        if home is None or abs(self.base_y - home) <= AT_HOME:
            return None
        if self.under_way:
            return None
        if self._is_given_up(MoveBase(home)):
            return Stuck("the base does not get home, where it stands for both arms: clear its way")
        return MoveBase(home)

    def _hand_over(self) -> Action | None:
        """Put down what an arm holds that works, but is not of the design."""
        others = (self.held & self.working) - self.design.arms - self.busy
        return self._first(self._put_down(arm) for arm in sorted(others))

    def _place(self) -> Action | None:
        if self._pyramid_is_taken():
            return None
        taken = {action.slot for action in self.under_way if isinstance(action, Place)}
        holding = [arm for arm in self.arms if arm in self.held and arm not in self.busy]
        return self._first(
            Place(arm, slot) for arm in holding for slot in self.free if slot not in taken and self._reaches(arm, slot)
        )

    def _pick(self) -> Action | None:
        if self._missing() <= 0:
            return None
        idle = [arm for arm in self.arms if arm not in self.held and arm not in self.busy]
        return self._first(
            Pick(arm, block)
            for block in self._wanted()
            for arm in idle
            if self._is_for(arm, block) and not (self._is_at_pyramid(block) and self._pyramid_is_taken())
        )

    def _missing(self) -> int:
        """Return how many blocks are still to be picked for slots that are known to be free."""
        on_the_way = {arm for arm in self.arms if arm in self.held}
        on_the_way |= {action.arm for action in self.under_way if isinstance(action, Pick | Place)}
        return len(self.empty) - len(on_the_way)

    def _wanted(self) -> list[Block]:
        """Return the blocks that may be picked, those that are in the way of a slot first."""
        taken = [action.block for action in self.under_way if isinstance(action, Pick)]
        left = [block for block in self.blocks if all(_apart(block, other) > SIDE / 2.0 for other in taken)]
        in_the_way = [block for block in left if any(self._is_before(block, slot) for slot in self.fillable)]
        if self.fillable and not self.free:
            return in_the_way
        rest = sorted((block for block in left if block not in in_the_way), key=lambda block: (abs(block.y), block.y))
        return in_the_way + rest

    def _is_for(self, arm: str, block: Block) -> bool:
        """Return whether an arm takes a block: it reaches the block and a slot, and the arm of that side does not."""
        if not self._can_take(arm, block, self.base_y):
            return False
        others = [other for other in self.arms if other != arm and self._can_take(other, block, self.base_y)]
        return not others or (block.y >= self.base_y) == (arm == "left")

    def _can_take(self, arm: str, block: Block, base_y: float) -> bool:
        if self._is_given_up(Pick(arm, block), base_y) or not self.reach(arm, (block.x, block.y, block.z), base_y):
            return False
        return self.design.home is None or any(self._reaches(arm, slot) for slot in self.empty)

    # -- what to do when the arms can do nothing where the base stands ------------------------------------------------

    def later(self) -> Action:
        """Return what helps when no arm can do anything where the base stands."""
        steps = (
            self._drive_to_slot,
            self._look_for_what_is_missing,
            self._make_room,
            self._look,
            self._drive_to_block,
            self._look_from_elsewhere,
        )
        return self._first(step() for step in steps) or Stuck(self._reason())

    def _drive_to_slot(self) -> Action | None:
        places = [Place(arm, slot) for arm in self._holding() for slot in self.free]
        return self._drive([(place, place.slot.position) for place in places])

    def _look_for_what_is_missing(self) -> Action | None:
        return self._look() if self.progress.hidden or not self.blocks else None

    def _look(self) -> Action | None:
        return None if self.progress.clear else Look()

    def _drive_to_block(self) -> Action | None:
        if self._missing() <= 0:
            return None
        idle = [arm for arm in self.arms if arm not in self.held]
        picks = [Pick(arm, block) for arm in idle for block in self._wanted()]
        return self._drive([(pick, (pick.block.x, pick.block.y, pick.block.z)) for pick in picks])

    def _drive(self, aims: Sequence[tuple[Pick | Place, tuple[float, float, float]]]) -> Action | None:
        """Return the shortest drive to where an arm reaches one of the places, also if the base stops a little off."""
        if self.design.home is not None:
            return None
        for error in (_STANDING_ERROR, 0.0):
            for y in sorted(_PLACES_OF_BASE, key=lambda y: (abs(y - self.base_y), y)):
                if abs(y - self.base_y) < _STANDING_ERROR / 2.0 or self._is_given_up(MoveBase(y)):
                    continue
                for action, place in aims:
                    is_reached = all(self.reach(action.arm, place, y + off) for off in {-error, 0.0, error})
                    if is_reached and not self._is_given_up(action, y):
                        return MoveBase(y)
        return None

    def _make_room(self) -> Action | None:
        """Put a block down where the hand is needed for one that is in the way, or where no free slot is in reach."""
        for arm in self._holding():
            is_blocked = self.fillable and not self.free
            if is_blocked and any(self._may_ever_take(arm, block) for block in self._wanted()):
                return self._put_down(arm)
            is_in_reach = self.design.home is None or any(self._reaches(arm, slot) for slot in self.empty)
            if not is_in_reach and not self.progress.hidden:
                return self._put_down(arm)
        return None

    def _may_ever_take(self, arm: str, block: Block) -> bool:
        places = [self.base_y] if self.design.home is not None else [self.base_y, *_PLACES_OF_BASE]
        return any(self._can_take(arm, block, y) for y in places)

    def _look_from_elsewhere(self) -> Action | None:
        if self.design.home is not None or not (self.progress.hidden or self._missing() > 0):
            return None
        seen_from = self.progress.looked_from
        unseen = [y for y in _VIEWPOINTS if all(abs(y - other) > 2.0 * AT_HOME for other in seen_from)]
        return self._first(MoveBase(y) for y in sorted(unseen, key=lambda y: abs(y - self.base_y)))

    def _reason(self) -> str:
        """Say why nothing can be done; each sentence is true of what is known."""
        keeping = sorted(self.held - set(self.arms))
        lost = f"; the {' and the '.join(keeping)} gripper still holds a block" if keeping else ""
        if any(count >= TRIES for count in self.progress.failures.values()):
            lost = f"; some actions were tried {TRIES} times in vain{lost}"
        if self._holding():
            if self.free:
                return f"no free slot can be filled from where the arms reach: {self._names(self.free)}{lost}"
            if self.fillable:
                return f"loose blocks that can't be taken are in the way of {self._names(self.fillable)}{lost}"
            return f"it can't be seen whether these are filled: {self._names(self.progress.hidden)}{lost}"
        missing = f"{len(SLOTS) - len(self.progress.filled)} slots are not filled"
        if not self.blocks:
            return f"{missing}, and no loose block is seen: put blocks on the table{lost}"
        if self.fillable and not self.free and not self._wanted():
            return f"loose blocks that can't be taken are in the way of {self._names(self.fillable)}{lost}"
        return f"{missing}, and no arm can take any of {len(self.blocks)} loose blocks: put them in reach{lost}"

    # -- helpers ------------------------------------------------------------------------------------------------------

    def _first(self, actions: Iterator[Action | None]) -> Action | None:
        """Return the first action that has not been given up."""
        return next((action for action in actions if action is not None and not self._is_given_up(action)), None)

    def _is_given_up(self, action: Action, base_y: float | None = None) -> bool:
        """Return whether an action was tried in vain too often, from where the base stands or would stand."""
        if isinstance(action, MoveBase):
            # What was to be done there can't be done: a broken arm hides the block, say, which drives along.
            near = [y for y in self.progress.driven_to if abs(y - action.y) < _SAME_PLACE]
            return len(near) >= DRIVES
        return self.progress.failed(action, self.base_y if base_y is None else base_y) >= TRIES

    def _holding(self) -> list[str]:
        return [arm for arm in self.arms if arm in self.held]

    def _reaches(self, arm: str, slot: Slot) -> bool:
        return self.reach(arm, slot.position, self.base_y)

    def _pyramid_is_taken(self) -> bool:
        return any(
            isinstance(action, Place) or (isinstance(action, Pick) and self._is_at_pyramid(action.block))
            for action in self.under_way
        )

    @staticmethod
    def _is_at_pyramid(block: Block) -> bool:
        return abs(block.y) < OVER_PYRAMID

    @staticmethod
    def _is_before(block: Block, slot: Slot) -> bool:
        """Return whether a loose block is in the way of a slot: in it, beside it, or on what carries it."""
        x, y, z = slot.position
        near = abs(block.x - x) < BEFORE_SLOT[0] and abs(block.y - y) < BEFORE_SLOT[1]
        return near and block.z > z - 0.9 * SIDE

    def _put_down(self, arm: str) -> Action | None:
        """Return where an arm puts its block: the free place in reach that is nearest to the pyramid, away from it."""
        free = [
            (x, y)
            for x in (-0.15, -0.25)
            for y in (round(side * (0.28 + 0.06 * step), 2) for step in range(6) for side in (1, -1))
            if all(math.hypot(x - block.x, y - block.y) >= _FREE_AROUND for block in self.blocks)
            and self.reach(arm, (x, y, TABLE_HEIGHT + SIDE / 2.0), self.base_y)
        ]
        if not free:
            return None
        return PutDown(arm, *min(free, key=lambda place: (math.hypot(place[0] - ROW_X, place[1]), place)))

    @staticmethod
    def _names(slots: Collection[Slot]) -> str:
        return ", ".join(str(slot) for slot in sorted(slots))


def _apart(block: Block, other: Block) -> float:
    return math.dist((block.x, block.y, block.z), (other.x, other.y, other.z))
