"""Missions and decisions as plain data: read from bags without ROS, summarised, drawn.

`bag` reads files and `figure` writes them; no other module touches one.
"""
