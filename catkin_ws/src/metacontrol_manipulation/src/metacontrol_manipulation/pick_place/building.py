"""Builds the pyramid: looks, decides, acts, until it stands or nothing can be done. It knows its robot by a protocol.

Nothing is remembered that could not be seen: whoever begins anew, on the same table, goes on with the work.

Where two arms build, one takes a block while the other one puts its own. An arm keeps out of everywhere that the other
one comes, or came, in what it is at: so either may stop, or go back, at any moment. What lies loose is known then from
the last look with both arms out of the way; only of the pyramid it is looked after each block. As soon as anything is
not as expected, nothing new begins before both arms are out of the way and all is seen again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from metacontrol_manipulation.handling.deeds import LET_GO, OPEN, Grip, HandlingError
from metacontrol_manipulation.perception.blocks import find_blocks
from metacontrol_manipulation.pick_place.actions import Done, Look, MoveBase, Open, Pick, Place, PutDown, Retreat, Stuck
from metacontrol_manipulation.pick_place.next_step import OVER_PYRAMID, Situation, next_step
from metacontrol_manipulation.pick_place.progress import Progress, acted, perceived, pyramid_perceived
from metacontrol_manipulation.pick_place.pyramid import SLOTS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray
    from robot_formulas.geometry import Pose

    from metacontrol_manipulation.handling.deeds import Deed
    from metacontrol_manipulation.handling.handler import Handler
    from metacontrol_manipulation.perception.camera import Camera
    from metacontrol_manipulation.pick_place.actions import Action
    from metacontrol_manipulation.pick_place.next_step import Design


PATIENCE = 10.0
"""s for which a program that needs all of its arms waits for one that does not work."""
_IN_SLOT = 0.006
"""m between a hand that holds a block and a slot within which the block stands in the slot."""
_STEPS_BACK = 4
"""How often a stopped arm goes a part of its way back, so that the cell can be seen."""
_PAUSE = 0.1
"""s between two looks at whether it works again."""


class Robot(Protocol):
    """What builds: two arms, a base, a camera."""

    @property
    def joints(self) -> Mapping[str, Sequence[float]]:
        """The joints of each arm, rad."""

    @property
    def held(self) -> frozenset[str]:
        """Arms whose grippers hold a block."""

    @property
    def working(self) -> frozenset[str]:
        """Arms that work."""

    @property
    def cell(self) -> Pose:
        """Pose of the cell frame in base_link."""

    def sees_cell(self) -> bool:
        """Return whether it is seen where the cell is, or known well enough without."""

    def depth(self) -> tuple[NDArray[np.float32], Camera]:
        """Take a depth image, and tell by which camera."""

    def do(self, arm: str, deeds: Sequence[Deed]) -> bool:
        """Have an arm do something; return whether it has."""

    def begin(self, arm: str, deeds: Sequence[Deed]) -> None:
        """Have an arm begin something, and do not wait for its end."""

    def ended(self) -> tuple[str, bool]:
        """Wait until an arm has ended what it has begun; return which one, and whether it has done it."""

    def halt(self) -> None:
        """Have all arms that move stop where they are, whoever moves them."""

    def retreat(self, arm: str) -> bool:
        """Have an arm that does not work go back to where its last motion began; return whether it has."""

    def wait(self, duration: float) -> None:
        """Let time (s) pass."""

    def move_base(self, y: float) -> bool:
        """Drive along the table, to y in m of the cell frame; return whether the base is there."""


class Building:
    """One program's work on the pyramid."""

    def __init__(self, robot: Robot, handler: Handler, design: Design, tell: Callable[[Action], None]) -> None:
        """Begin without knowing anything of the table.

        Args:
            robot: that builds.
            handler: plans its motions.
            design: by which arms, and where the base stands.
            tell: is called with each action before it begins.
        """
        self._robot, self._handler, self._design, self._tell = robot, handler, design, tell
        self._under_way: dict[str, tuple[Pick | Place, Sequence[Deed], float]] = {}
        self._is_expected = True
        self.progress = Progress()

    def run(self, is_wanted: Callable[[], bool] = lambda: True) -> Done | Stuck | None:
        """Build; return how it ended, None if it is not wanted any more.

        Args:
            is_wanted: is asked before each action.
        """
        self._robot.halt()
        self._rise()
        self._show_the_cell()
        self.look(clear=False)
        self._is_expected = len(self._design.arms) == 1 or not self._situation().away & self._robot.working
        try:
            while is_wanted():
                missing = self._missing_arms(is_wanted)
                if missing:
                    arms = " and the ".join(missing)
                    return Stuck(f"the {arms} arm is stopped: free it, or take a design without it")
                if not is_wanted():
                    break
                ending = self._step()
                if ending is not None:
                    return ending
            return None
        finally:
            if self._under_way:
                self._robot.halt()

    def _step(self) -> Done | Stuck | None:
        """Begin the next action, or wait for the end of one; return how all ended, if it has."""
        if not self._is_expected and not self._under_way:
            self._is_expected = True
            self.look(clear=self._clear_the_view())
        under_way = [action for action, _, _ in self._under_way.values()]
        action = next_step(self._situation(), self._design, self._reach, under_way) if self._is_expected else None
        if isinstance(action, Pick | Place) and len(self._design.arms) > 1:
            if not self._begin(action):
                self._take_in_an_end()
        elif self._under_way:
            self._take_in_an_end()
        elif action is None:
            return Stuck("nothing is under way, and there is nothing to begin")
        else:
            self._tell(action)
            if isinstance(action, Done | Stuck):
                return action
            self._act(action)
        return None

    def _missing_arms(self, is_wanted: Callable[[], bool]) -> list[str]:
        """Return the arms without which nothing can be done, after some patience."""
        waited, missing = 0.0, sorted(self._design.arms - self._robot.working)
        while self._design.needs_all and missing and waited < PATIENCE and is_wanted():
            self._robot.wait(_PAUSE)
            waited += _PAUSE
            missing = sorted(self._design.arms - self._robot.working)
        return missing if self._design.needs_all else []

    def look(self, *, clear: bool) -> None:
        """See where the blocks are; `clear`: the arms are out of the way."""
        depth, camera = self._robot.depth()
        view = find_blocks(depth, camera, self._robot.cell)
        self.progress = perceived(self.progress, view, self._base_y(), clear=clear)

    def _act(self, action: Action) -> None:
        """Do what was decided, and look what came of it."""
        succeeded, base_y, cleared = True, self._base_y(), None
        try:
            if isinstance(action, Pick | Place | PutDown):
                deeds = self._handler.deeds(action, self._robot.joints, self._robot.cell, self.progress)
                succeeded = self._robot.do(action.arm, deeds)
                succeeded = succeeded and (action.arm in self._robot.held) == isinstance(action, Pick)
            elif isinstance(action, Open):
                succeeded = self._robot.do(action.arm, [Grip(OPEN)])
            elif isinstance(action, Retreat):
                succeeded = self._robot.retreat(action.arm)
            elif isinstance(action, MoveBase):
                succeeded = self._robot.move_base(action.y)
            elif isinstance(action, Look):
                succeeded = cleared = self._clear_the_view()
        except HandlingError:
            succeeded = False
        self.progress = acted(self.progress, action, base_y, succeeded=succeeded)
        if cleared is None:
            cleared = not isinstance(action, Pick) and self._clear_the_view()
        self.look(clear=cleared)

    def _begin(self, action: Pick | Place) -> bool:
        """Have an arm begin an action beside what is under way; return False where that has to end first."""
        robot, handler = self._robot, self._handler
        other = next((deeds for _, deeds, _ in self._under_way.values()), ())
        try:
            if isinstance(action, Place):
                deeds = handler.place_and_leave(action, robot.joints, robot.cell, self.progress, other)
            else:
                deeds = handler.deeds(action, robot.joints, robot.cell, self.progress, other)
        except HandlingError:
            if self._under_way:
                return False
            self._tell(action)
            self.progress = acted(self.progress, action, self._base_y(), succeeded=False)
            self._is_expected = False
            return True
        self._tell(action)
        self._under_way[action.arm] = action, deeds, self._base_y()
        self._robot.begin(action.arm, deeds)
        return True

    def _take_in_an_end(self) -> None:
        """Wait until an arm has ended what it is at, and look what came of it."""
        arm, succeeded = self._robot.ended()
        action, _, base_y = self._under_way.pop(arm)
        succeeded = succeeded and (arm in self._robot.held) == isinstance(action, Pick)
        self.progress = acted(self.progress, action, base_y, succeeded=succeeded)
        if isinstance(action, Place) and succeeded:
            depth, camera = self._robot.depth()
            before = self.progress.filled
            self.progress = pyramid_perceived(self.progress, find_blocks(depth, camera, self._robot.cell))
            succeeded = self.progress.filled >= before | {action.slot}
        self._is_expected = self._is_expected and succeeded

    def _rise(self) -> None:
        """Have the hands rise that another program has left among the blocks, before anything else moves.

        One that holds a block in a slot lets go of it first: that program was about to.
        """
        for arm in sorted(self._robot.working):
            try:
                way = self._handler.rise(arm, self._robot.joints, self._robot.cell, self.progress)
            except HandlingError:
                continue  # something is over it: it will be planned around
            self._robot.do(arm, [LET_GO, *way] if self._holds_in_slot(arm) else way)

    def _show_the_cell(self) -> None:
        """Have arms go out of the way that hide where the cell is: another program has left them there."""
        for _ in range(_STEPS_BACK):
            if self._robot.sees_cell():
                return
            self._clear_the_view()
            for arm in sorted(self._situation().away - self._robot.working):
                self._robot.retreat(arm)

    def _holds_in_slot(self, arm: str) -> bool:
        hand = self._handler.hand(arm, self._robot.joints[arm], self._robot.cell)
        return arm in self._robot.held and any(math.dist(hand, slot.position) < _IN_SLOT for slot in SLOTS)

    def _clear_the_view(self) -> bool:
        """Have the arms that work go out of the way; return whether they have."""
        cleared = True
        for arm in sorted(self._robot.working):
            try:
                holds = arm in self._robot.held
                way = self._handler.away(arm, self._robot.joints, self._robot.cell, self.progress, holds=holds)
                cleared &= self._robot.do(arm, way)
            except HandlingError:
                cleared = False
        return cleared

    def _situation(self) -> Situation:
        joints, cell = self._robot.joints, self._robot.cell
        away = frozenset(arm for arm in joints if self._handler.is_away(arm, joints[arm]))
        over = frozenset(arm for arm in joints if abs(self._handler.hand(arm, joints[arm], cell)[1]) < OVER_PYRAMID)
        return Situation(self.progress, self._robot.held, self._robot.working, self._base_y(), away, over)

    def _base_y(self) -> float:
        return self._robot.cell.inverse().y

    def _reach(self, arm: str, position: tuple[float, float, float], base_y: float) -> bool:
        return self._handler.reach(arm, position, base_y, self._robot.cell.inverse().x)
