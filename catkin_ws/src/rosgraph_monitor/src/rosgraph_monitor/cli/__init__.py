"""Commands that are not ROS nodes."""
