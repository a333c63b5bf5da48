"""A costmap at one moment, as planner and controller get it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from move_base.costmap.grid import INSCRIBED, UNKNOWN

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from move_base.costmap.grid import Geometry


@dataclass(frozen=True)
class Snapshot:
    """A costmap at one moment; its arrays are never written to again.

    Attributes:
        geometry: where the grid lies.
        costs: 0..255 (H, W).
        uninflated: the same before inflation (H, W).
        clearance: distance from each cell's centre to the nearest obstacle cell's centre (H, W), m, never beyond
            `clearance_limit`.
        clearance_limit: larger distances are not told apart, m.
        inscribed_radius: of the padded footprint, m.
        circumscribed_radius: of the padded footprint, m.
        pinch_radius: inscribed radius of the footprint with half of its padding, m.
    """

    geometry: Geometry
    costs: NDArray[np.uint8]
    uninflated: NDArray[np.uint8]
    clearance: NDArray[np.float32]
    clearance_limit: float
    inscribed_radius: float
    circumscribed_radius: float
    pinch_radius: float

    @cached_property
    def pinched(self) -> NDArray[np.bool_]:
        """Known cells (H, W) where the robot fits with half of its padding, but not with all of it."""
        near: NDArray[np.bool_] = (self.costs == INSCRIBED) & (self.clearance > self.pinch_radius)
        return near & (self.uninflated != UNKNOWN)
