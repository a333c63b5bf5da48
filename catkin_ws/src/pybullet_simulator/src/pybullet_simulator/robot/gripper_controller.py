"""The controller of a gripper with two fingers: closes or opens, and tells when it has arrived or holds something."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pybullet_simulator.robot.manipulator import MAX_WIDTH

MAX_FORCE = 20.0
"""N of a finger (effort of its joint in pybullet_data's panda.urdf)."""
USUAL_FORCE = MAX_FORCE
"""N where a command asks for none."""
WIDTH_TOLERANCE = 0.002
"""m: how near to the wanted width the fingers must come."""
STALLED_AFTER = 0.3
"""s in which the fingers do not move: they hold something, or are blocked."""
_STILL = 0.0005
"""m: fingers that move less do not move."""


class GripperError(ValueError):
    """A command can't be carried out; the text says why."""


@dataclass(frozen=True)
class GripperOutcome:
    """How a command ended: the fingers are where they should be, or something keeps them apart."""

    width: float
    reached: bool

    @property
    def stalled(self) -> bool:
        """Whether the fingers stopped before."""
        return not self.reached


class GripperController:
    """Carries out one command at a time; the fingers keep width and force until the next one. Times: ROS time in s."""

    def __init__(self) -> None:
        """Prepare; without a command the fingers stay as they are."""
        self.width: float | None = None
        """Wanted, m; None before the first reading."""
        self.force = USUAL_FORCE
        self._waits = False
        self._last = math.inf
        self._still_since = 0.0

    def command(self, width: float, force: float, now: float) -> None:
        """Take a command in place of the former one.

        Args:
            width: m between the fingers.
            force: N at most; 0: the usual one.
            now: s.

        Raises:
            GripperError: width or force are out of range.
        """
        if not (math.isfinite(width) and 0.0 <= width <= MAX_WIDTH):
            raise GripperError(f"width {width:g} m is not within 0 and {MAX_WIDTH:g}")
        if not (math.isfinite(force) and 0.0 <= force <= MAX_FORCE):
            raise GripperError(f"force {force:g} N is not within 0 and {MAX_FORCE:g}")
        self.width, self.force = width, force or USUAL_FORCE
        self._waits, self._last, self._still_since = True, math.inf, now

    def update(self, now: float, width: float) -> GripperOutcome | None:
        """Take the width of the fingers, m; return how the command ended, if it did now."""
        if self.width is None:
            self.width = width
        if abs(width - self._last) > _STILL:
            self._last, self._still_since = width, now
        self._still_since = min(self._still_since, now)  # the clock may be set back
        if not self._waits:
            return None
        reached = abs(width - self.width) <= WIDTH_TOLERANCE
        if not reached and now - self._still_since < STALLED_AFTER:
            return None
        self._waits = False
        return GripperOutcome(width, reached)
