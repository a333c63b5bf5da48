"""PyBullet world, robot and drivers of the demonstrators."""
