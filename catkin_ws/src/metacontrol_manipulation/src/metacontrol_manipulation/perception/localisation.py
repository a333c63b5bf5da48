"""Where the cell is in the odometry's frame: views of its tags, put together while the base drives and stands."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from robot_formulas.geometry import Pose, wrap

from metacontrol_manipulation.perception.tags import Expected, find_cell

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from metacontrol_manipulation.perception.camera import Camera
    from metacontrol_manipulation.perception.tags import TagView

SLIP = 0.03
"""m of error that the odometry adds per m of way: mecanum wheels slip that much sideways."""
DRIFT = 0.004
"""rad of error that it adds per m of way."""
_STANDING = 0.003
"""m, and rad, within which the base stands where it stood."""
_HISTORY = 4.0
"""s for which places of the base are remembered: an image is that old at most when it has been read."""
_MOST_PLACES = 4000
"""Places that are remembered at most, whatever their times: as many as odometry at 1 kHz gives."""
AHEAD = 1.0
"""s: how far a clock may be ahead of another one. More means that the clock was set back, or that a stamp is wrong."""


@dataclass(frozen=True, slots=True)
class Localisation:
    """Where the cell is.

    Attributes:
        cell: pose of the cell frame in the frame odom.
        base: pose of the base in odom when that was known last.
        deviation: m, the standard deviation of the cell's x and y, seen from the base.
        turn: rad, that of its yaw.
    """

    cell: Pose
    base: Pose
    deviation: float
    turn: float

    def seen_from(self, base: Pose) -> Pose:
        """Return the pose of the cell frame in base_link while the base is at a pose in odom."""
        return base.inverse() @ self.cell

    def moved(self, base: Pose) -> Localisation:
        """Return what is known when the base has moved to a pose in odom."""
        way = base.distance(self.base)
        return replace(
            self,
            base=base,
            deviation=math.hypot(self.deviation, SLIP * way),
            turn=math.hypot(self.turn, DRIFT * way),
        )


class CellTracker:
    """Keeps the knowledge of where the cell is."""

    def __init__(self, known: Localisation | None = None) -> None:
        """Begin.

        Args:
            known: where the cell is; None if that is not known.
        """
        self.known = known
        self._before = known  # what was known before the base came to where it stands
        self._tags = 0  # in the best view from there

    def look(self, image: NDArray[np.uint8], camera: Camera, base: Pose) -> TagView | None:
        """Look for tags in an image, and return what was found.

        The errors of views from one place go together: looking twice does not halve them. So only the best view from a
        place counts.

        Args:
            image: see `find_cell`.
            camera: that took it.
            base: pose of the base in odom when it was taken.
        """
        if self.known is not None and not _is_near(base, self.known.base):
            self.known = self._before = self.known.moved(base)
            self._tags = 0
        before = self._before
        expected = Expected(before.seen_from(base), before.deviation, before.turn) if before else None
        view = find_cell(image, camera, expected)
        if view is not None and len(view.ids) > self._tags:
            self.known = Localisation(base @ view.cell, base, view.deviation, view.turn)
            self._tags = len(view.ids)
        return view


def _is_near(base: Pose, other: Pose) -> bool:
    return base.distance(other) < _STANDING and abs(wrap(base.yaw - other.yaw)) < _STANDING


class Track:
    """Where the base was of late, for images that are older than the newest odometry."""

    def __init__(self) -> None:
        """Begin without a place."""
        self._times: deque[float] = deque(maxlen=_MOST_PLACES)
        self._poses: deque[Pose] = deque(maxlen=_MOST_PLACES)

    def add(self, time: float, pose: Pose) -> None:
        """Take a pose of the base in odom, at a time in s. A time before the last one begins the track anew."""
        if self._times and time < self._times[-1]:
            self._times.clear()
            self._poses.clear()
        self._times.append(time)
        self._poses.append(pose)
        while time - self._times[0] > _HISTORY:
            self._times.popleft()
            self._poses.popleft()

    def is_set_back(self, time: float) -> bool:
        """Tell whether the clock was set back before a time in s at which a pose is to be added."""
        return bool(self._times) and time < self._times[-1] - AHEAD

    @property
    def latest(self) -> Pose | None:
        """The newest pose."""
        return self._poses[-1] if self._poses else None

    def at(self, time: float) -> Pose | None:
        """Return the pose that is nearest to a time in s; None if there is none yet, or the time is `AHEAD` of them."""
        if not self._times or time > self._times[-1] + AHEAD:
            return None
        after = min(bisect_left(self._times, time), len(self._times) - 1)
        before = max(after - 1, 0)
        nearer = before if time - self._times[before] < self._times[after] - time else after
        return self._poses[nearer]
