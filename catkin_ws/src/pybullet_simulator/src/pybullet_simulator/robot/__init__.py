"""The robot: shape, drive, sensors, their noise and faults."""
