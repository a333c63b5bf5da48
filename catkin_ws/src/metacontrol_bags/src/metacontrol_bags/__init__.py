"""Missions as plain data: read from bags without ROS, summarised, drawn."""
