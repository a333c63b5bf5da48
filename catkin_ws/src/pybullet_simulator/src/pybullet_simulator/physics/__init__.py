"""PyBullet: bodies, the simulation that steps them, its window."""
