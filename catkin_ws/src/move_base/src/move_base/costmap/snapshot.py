"""A costmap at one moment, as planner and controller get it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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
        clearance: distance from each cell's centre to the nearest obstacle cell's centre (H, W), m, never beyond
            `clearance_limit`.
        clearance_limit: larger distances are not told apart, m.
        inscribed_radius: of the padded footprint, m.
    """

    geometry: Geometry
    costs: NDArray[np.uint8]
    clearance: NDArray[np.float32]
    clearance_limit: float
    inscribed_radius: float
