"""Synthetic bags of missions as fixtures."""

from helpers.mission_bags import bag, mission_bag  # noqa: F401
