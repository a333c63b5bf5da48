"""The tray that the simulated camera looks at: parts lie on it, apart from each other."""

from __future__ import annotations

import numpy as np

WIDTH, HEIGHT = 160, 120
"""Pixels of the camera's image."""
RADIUS = 5
"""Pixels; of a part."""
REACH = 15.0
"""Pixels; how far beside the jaw a part may lie that it grips."""
PARTS = 5
"""That many parts lie on the tray."""


class Tray:
    """Parts at random places, each at least six radii from the others."""

    def __init__(self, seed: int = 1) -> None:
        self._random = np.random.default_rng(seed)
        self.parts: list[tuple[float, float]] = []
        self.fill()

    def fill(self) -> None:
        """Lay parts on the tray until it is full."""
        while len(self.parts) < PARTS:
            x, y = self._random.uniform((10, 10), (WIDTH - 10, HEIGHT - 10))
            if all(np.hypot(x - other_x, y - other_y) > 6 * RADIUS for other_x, other_y in self.parts):
                self.parts.append((float(x), float(y)))

    def take(self, x: float, y: float) -> bool:
        """Take the part at a place, and lay another one somewhere; return False if there is none in reach."""
        ways = [np.hypot(x - part_x, y - part_y) for part_x, part_y in self.parts]
        nearest = int(np.argmin(ways))
        if ways[nearest] > REACH:
            return False
        del self.parts[nearest]
        self.fill()
        return True

    def image(self, light: float) -> np.ndarray:
        """Return what a camera sees: bright parts on a dark tray, both as bright as the light (0 to 1), and noise."""
        rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
        picture = np.full((HEIGHT, WIDTH), 40.0)
        for x, y in self.parts:
            picture[(columns - x) ** 2 + (rows - y) ** 2 <= RADIUS**2] = 200.0
        return np.clip(light * picture + self._random.normal(0.0, 3.0, picture.shape), 0, 255).astype(np.uint8)
