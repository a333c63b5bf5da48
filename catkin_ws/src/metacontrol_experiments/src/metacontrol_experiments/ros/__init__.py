"""Missions on ROS: the runner and its nodes."""
