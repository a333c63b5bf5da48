"""Types of what has several numbers: joints, positions, quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Vector: TypeAlias = Sequence[float] | NDArray[np.float64]
"""What may be given: a list, a tuple or an array."""
