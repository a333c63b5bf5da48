"""Recorded runs: what was decided, and what would have been. Without ROS."""
