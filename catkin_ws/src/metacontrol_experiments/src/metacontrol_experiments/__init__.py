"""Missions and campaigns of missions, on ROS and in lockstep."""
