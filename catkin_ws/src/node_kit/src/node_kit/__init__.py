"""How our nodes start, watch the ROS master and end."""
