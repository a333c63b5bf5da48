"""Missions without ROS: all parts stepped together in one process."""
